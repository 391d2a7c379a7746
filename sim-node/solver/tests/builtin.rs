//! The built-in scenes: they have the counts of the tutorials, and move as their names say.

use sim_solver::{ColliderGeometry, Scene, Solver, builtin};

fn scene(name: &str) -> Scene {
    Scene::from_toml(builtin::text(name).unwrap(), name).unwrap()
}

fn after(name: &str, steps: u32) -> Solver {
    let mut solver = Solver::new(&scene(name));
    for _ in 0..steps {
        solver.step();
    }
    solver
}

fn position(solver: &Solver, index: usize) -> [f64; 3] {
    solver.particle(index).position.map(f64::from)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (b[axis] - a[axis]).powi(2)).sum::<f64>().sqrt()
}

/// Returns the largest length / rest length of all constraints.
fn max_stretch(solver: &Solver) -> f64 {
    let lengths = solver.constraints().map(|one| {
        let length = distance(position(solver, one.a as usize), position(solver, one.b as usize));
        length / f64::from(one.rest_length)
    });
    lengths.fold(0.0, f64::max)
}

fn speed(solver: &Solver) -> f64 {
    (0..solver.particle_count())
        .map(|index| distance(solver.particle(index).velocity.map(f64::from), [0.0; 3]))
        .fold(0.0, f64::max)
}

/// Returns the area of the polygon of the first four particles.
fn box_area(solver: &Solver) -> f64 {
    let corner = |index: usize| position(solver, index % 4);
    let cross = |index: usize| {
        let ([x, y, _], [next_x, next_y, _]) = (corner(index), corner(index + 1));
        x * next_y - next_x * y
    };
    (0..4).map(cross).sum::<f64>().abs() / 2.0
}

#[test]
fn every_scene_has_the_counts_of_the_tutorials() {
    // Particles, constraints, pins.
    for (name, counts) in [
        ("drape", [1176, 6693, 49]),
        ("curtain", [168, 596, 14]),
        ("ragdoll", [15, 20, 0]),
        ("spider-web", [145, 288, 16]),
        ("rope-bridge", [50, 121, 4]),
        ("elastic-mesh", [96, 478, 0]),
        ("drop-box", [4, 4, 0]),
        ("drop-box-braced", [4, 6, 0]),
        ("tearable-cloth", [3993, 7832, 61]),
        ("spring-cloth", [168, 880, 2]),
        ("carried-cloth", [121, 320, 0]),
        ("folding-cloth", [1600, 9202, 0]),
        ("covered-bust", [2025, 7832, 0]),
        ("coiled-rope", [121, 120, 0]),
        ("two-flags", [930, 3448, 30]),
        ("ragdolls-in-net", [421, 764, 4]),
        ("pendulum", [2, 1, 1]),
        ("free-fall", [1, 0, 0]),
        ("flag", [651, 3648, 21]),
        ("rope", [41, 40, 1]),
    ] {
        let found = scene(name).counts();
        assert_eq!([found.particles, found.constraints, found.pins], counts, "{name}");
    }
    assert_eq!(scene("carried-cloth").anchors[0].particles.len(), 11);
    assert_eq!(builtin::names().count(), 20);
}

/// Runs a scene for a number of steps and asserts that it stays finite.
fn assert_finite_for(name: &str, steps: u32) {
    let mut solver = Solver::new(&scene(name));
    for step in 0..steps {
        solver.step();
        if step % 100 == 0 {
            assert!(speed(&solver).is_finite(), "{name} at step {step}");
        }
    }
    assert_eq!(solver.frozen_count(), 0, "{name}");
}

#[test]
fn every_scene_stays_finite() {
    std::thread::scope(|scope| {
        for name in builtin::names() {
            scope.spawn(move || assert_finite_for(name, 1_000));
        }
    });
}

#[test]
#[ignore = "needs half an hour"]
fn every_scene_stays_finite_for_an_hour_of_60_hz() {
    std::thread::scope(|scope| {
        for name in builtin::names() {
            scope.spawn(move || assert_finite_for(name, 216_000));
        }
    });
}

#[test]
fn a_box_without_braces_folds_and_a_braced_one_keeps_its_area() {
    let folded = box_area(&after("drop-box", 3000));
    assert!(folded < 100.0, "area {folded}");
    let kept = box_area(&after("drop-box-braced", 3000));
    assert!((kept - 2400.0).abs() < 1.0, "area {kept}");
}

#[test]
fn the_top_row_of_the_carried_cloth_follows_its_anchor() {
    for (seconds, translation) in
        [(1, [3.0, 0.0, 0.0]), (3, [6.0, 0.0, 3.0]), (12, [6.0, 0.0, 6.0])]
    {
        let solver = after("carried-cloth", 60 * seconds);
        for column in 0..11_u8 {
            let [x, y, z] = translation;
            let expected = [2.0 * f64::from(column) + x, y, z];
            let found = position(&solver, usize::from(column));
            assert!(distance(found, expected) < 1e-3, "{seconds} s: {found:?}");
        }
    }
}

#[test]
fn the_box_moves_through_the_carried_cloth_and_contains_none_of_it() {
    let mut solver = Solver::new(&scene("carried-cloth"));
    let mut pushed = 0.0;
    for _ in 0..60 * 6 {
        solver.step();
        let ColliderGeometry::Box { center, .. } = solver.colliders().next().unwrap().shape else {
            continue;
        };
        for index in 0..solver.particle_count() {
            // Inside the inscribed sphere of the box, which is independent of its rotation.
            let depth = 3.0 - distance(position(&solver, index), center.map(f64::from));
            assert!(depth < 1e-3, "particle {index} is {depth} deep");
            pushed = f64::max(pushed, position(&solver, index)[2]);
        }
    }
    assert!(pushed > 8.0, "the box pushes the cloth: {pushed}");
}

#[test]
fn the_spring_cloth_stretches_by_at_most_15_percent() {
    let mut solver = Solver::new(&scene("spring-cloth"));
    let mut most = 0.0;
    for _ in 0..60 * 20 {
        solver.step();
        most = f64::max(most, max_stretch(&solver));
    }
    println!("largest stretch {most}");
    assert!(most <= 1.15 && most > 1.02, "{most}");
}

#[test]
fn the_tearable_cloth_hangs_without_tears_and_tears_where_it_is_pulled() {
    let mut solver = after("tearable-cloth", 600);
    assert_eq!(solver.torn(), []);
    assert!(max_stretch(&solver) < 1.5, "{}", max_stretch(&solver));
    // Its lowest point is pulled down by 300 px in a quarter of a second, twice.
    let lowest = 32 * 121 + 60;
    for pull in 1..=3_u8 {
        let [x, y, _] = solver.particle(lowest).position;
        let target = [x, y + 150.0 * f32::from(pull), 0.0];
        let grab = sim_solver::Grab { particle: 32 * 121 + 60, target, over_s: 0.25 };
        solver.grab(1, grab).unwrap();
        for _ in 0..15 {
            solver.step();
        }
    }
    assert!(!solver.torn().is_empty());
    assert!(solver.torn().len() < 2000, "{} of 7,832 tore", solver.torn().len());
}

#[test]
fn the_ragdoll_falls_over_and_comes_to_rest_in_one_piece() {
    let solver = after("ragdoll", 60 * 20);
    let head = position(&solver, 0);
    assert!(head[1] < 0.8, "the head is at {head:?}");
    assert!((max_stretch(&solver) - 1.0).abs() < 0.05, "{}", max_stretch(&solver));
    assert!(speed(&solver) < 0.5, "{}", speed(&solver));
}

/// Returns the range of heights of the bridge's middle in six seconds.
fn range_of_height(mut bridge: Solver) -> f64 {
    let (mut low, mut high) = (9.0, -9.0);
    for _ in 0..240 * 6 {
        bridge.step();
        let height = position(&bridge, 24)[1];
        (low, high) = (f64::min(low, height), f64::max(high, height));
    }
    high - low
}

#[test]
fn the_web_the_bridge_and_the_flag_hang_and_move() {
    let web = after("spider-web", 240 * 10);
    let sag = 1.0 - position(&web, 0)[1];
    assert!(sag > 0.01 && sag < 0.5, "the hub sags by {sag}");
    assert_eq!(web.torn(), []);
    let bridge = after("rope-bridge", 240 * 10);
    let sag = 1.0 - position(&bridge, 24)[1];
    assert!(sag > 0.1 && sag < 0.8, "the middle sags by {sag}");
    // It comes to rest in still air, but not in gusts.
    let (in_gusts, mut calm) = (after("rope-bridge", 240 * 60), Solver::new(&scene("rope-bridge")));
    calm.set("wind.drag", sim_solver::ParameterValue::Off, None).unwrap();
    (0..240 * 60).for_each(|_| calm.step());
    let (moving, still) = (range_of_height(in_gusts), range_of_height(calm));
    assert!(moving > 0.02 && still < 0.005, "{moving} m in gusts, {still} m in still air");
    let flag = after("flag", 240 * 10);
    // Its free end points downwind, not straight down.
    let end = position(&flag, 30 + 31 * 10);
    assert!(end[0] > 0.7, "the middle of the free edge is at {end:?}");
}

#[test]
fn the_elastic_block_bounces_and_recovers_its_form() {
    let mut solver = Solver::new(&scene("elastic-mesh"));
    let height = |solver: &Solver| {
        let heights = (0..96).map(|index| position(solver, index)[1]);
        heights.clone().fold(0.0, f64::max) - heights.fold(9.0, f64::min)
    };
    let start = height(&solver);
    let (mut least, mut highest_low) = (start, 0.0);
    let mut has_landed = false;
    for _ in 0..240 * 30 {
        solver.step();
        least = f64::min(least, height(&solver));
        let low = (0..96).map(|index| position(&solver, index)[1]).fold(9.0, f64::min);
        has_landed |= low < 1e-3;
        if has_landed {
            highest_low = f64::max(highest_low, low);
        }
    }
    assert!(least < 0.95 * start, "the block is squeezed: {least} of {start}");
    assert!(highest_low > 0.02, "the block bounces: {highest_low}");
    let end = height(&solver);
    assert!((end / start - 1.0).abs() < 0.1, "the block recovers: {end} of {start}");
}

#[test]
fn the_pendulum_swings_with_its_period() {
    let mut solver = Solver::new(&scene("pendulum"));
    let mut crossings = Vec::new();
    let mut before = position(&solver, 1)[0];
    for step in 1..240 * 6_u32 {
        solver.step();
        let x = position(&solver, 1)[0];
        if before > 0.0 && x <= 0.0 {
            crossings.push((f64::from(step) - 1.0 + before / (before - x)) / 240.0);
        }
        before = x;
    }
    let period = crossings[1] - crossings[0];
    assert!((period - 2.139_138).abs() < 5e-3, "{period}");
}
