//! Wind: its force on both sides of a triangle, which never exceeds the relative momentum.

use glam::Vec3;
use sim_solver::{Kernels, Particle, Scene, Solver};

use super::{assert_at_most, assert_close, assert_near, solver, step, stepped, velocity};

/// Returns a square of 1 m^2 in the xy plane, in a wind.
fn triangle(wind: &str, rate: u32) -> String {
    // A cloth of 2 x 2 has two triangles.
    format!(
        "gravity = [0, 0, 0]\n[solver]\nrate_hz = {rate}\nsubsteps = 1\n[wind]\n{wind}\n\
         [[generate]]\nshape = \"cloth\"\ncolumns = 2\nrows = 2\nspacing = 1\nmass = 3\npinned = \"none\"\n"
    )
}

#[test]
fn a_sheet_gains_drag_area_speed_squared_over_mass_from_either_side() {
    // Area 1 m^2, 12 kg: F = drag v^2. The corners on the diagonal take two thirds of it.
    for wind in [4.0, -4.0] {
        let h = 1e-3;
        let solver = stepped(&triangle(&format!("velocity = [0, 0, {wind}]\ndrag = 0.6"), 1000), 1);
        let force = 0.6 * wind * f64::abs(wind);
        let momentum: f64 = (0..4).map(|index| 3.0 * velocity(&solver, index)[2]).sum();
        assert_close("momentum", force * h, momentum, 1e-4);
    }
}

#[test]
fn an_oblique_wind_pushes_in_its_own_direction_by_its_normal_component() {
    let solver = stepped(&triangle("velocity = [3, 0, 4]\ndrag = 0.5", 1000), 1);
    // F = drag A |u n| u with |u n| = 4.
    let sum = |axis: usize| (0..4).map(|index| 3.0 * velocity(&solver, index)[axis]).sum::<f64>();
    assert_close("along x", 0.5 * 4.0 * 3.0 * 1e-3, sum(0), 1e-3);
    assert_close("along z", 0.5 * 4.0 * 4.0 * 1e-3, sum(2), 1e-3);
}

#[test]
fn a_wind_parallel_to_a_sheet_has_no_effect() {
    let solver = stepped(&triangle("velocity = [5, 2, 0]\ndrag = 1", 100), 10);
    for index in 0..4 {
        assert_near("speed", 0.0, velocity(&solver, index)[0].abs(), 1e-9);
    }
}

#[test]
fn no_wind_accelerates_a_sheet_beyond_its_own_speed() {
    let mut solver = solver(&triangle("velocity = [0, 0, 20]\ndrag = 1e6", 60));
    for _ in 0..120 {
        step(&mut solver, 1);
        for index in 0..4 {
            assert_at_most("speed", 20.0 * (1.0 + 1e-5), velocity(&solver, index)[2]);
        }
    }
    assert_close("final speed", 20.0, velocity(&solver, 0)[2], 1e-3);
}

#[test]
fn an_infinite_force_accelerates_a_sheet_to_the_speed_of_the_wind() {
    for drag in ["1e30", "3e38"] {
        let text = triangle(&format!("velocity = [0, 0, 10]\ndrag = {drag}"), 60);
        let solver = stepped(&text, 1);
        for index in 0..4 {
            assert_close("speed", 10.0, velocity(&solver, index)[2], 1e-5);
        }
    }
}

#[test]
fn still_air_slows_a_falling_sheet_to_its_terminal_speed() {
    // m g = drag A v^2: 12 kg on 1 m^2.
    let text =
        triangle("drag = 0.6", 240).replace("gravity = [0, 0, 0]", "gravity = [0, 0, -9.81]");
    let solver = stepped(&text, 240 * 20);
    assert_close("speed", -(12.0 * 9.81 / 0.6_f64).sqrt(), velocity(&solver, 0)[2], 1e-3);
}

#[test]
fn the_force_of_gusts_varies_with_their_period() {
    // At a quarter of the period the wind is 1 + gust times as fast. Its force is the square of that.
    let text = triangle("velocity = [0, 0, 1]\ndrag = 1e-3\ngust = 0.5\ngust_period = 4", 100);
    let mut solver = solver(&text);
    let mut speeds = vec![0.0];
    for _ in 0..400 {
        step(&mut solver, 1);
        speeds.push((0..4).map(|index| velocity(&solver, index)[2]).sum::<f64>());
    }
    let gain = |step: usize| speeds[step] - speeds[step - 1];
    assert_close("at its height", 1.5 * 1.5, gain(100) / gain(200), 1e-2);
    assert_close("at its lowest", 0.5 * 0.5, gain(300) / gain(400), 1e-2);
}

/// Velocities after a step of 1/64 s without other forces, by the law for one triangle after the other.
fn velocities_in_wind(triangles: &[[u32; 3]], before: &[Particle]) -> Vec<Vec3> {
    let (wind, drag, h) = (Vec3::new(3.0, -5.0, 8.0), 0.7, 1.0 / 64.0);
    let vector = |corner: u32| {
        let one = before[corner as usize];
        (Vec3::from_array(one.position), Vec3::from_array(one.velocity))
    };
    let mut gains = vec![Vec3::ZERO; before.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(vector);
        let relative = wind - (a.1 + b.1 + c.1) * (1.0 / 3.0);
        let pressure =
            relative.dot((b.0 - a.0).cross(c.0 - a.0)).abs() * (drag * h * (0.5_f32 / 3.0));
        for corner in triangle {
            let count = triangles.iter().flatten().filter(|other| *other == corner).count();
            let share = pressure * before[*corner as usize].inverse_mass;
            let share_max = 1.0 / count as f32;
            gains[*corner as usize] += relative * if share < share_max { share } else { share_max };
        }
    }
    before.iter().zip(gains).map(|(one, gain)| Vec3::from_array(one.velocity) + gain).collect()
}

/// The triangles without a torn side, where no two constraints join the same particles.
fn whole_triangles(solver: &Solver) -> Vec<[u32; 3]> {
    let ends: Vec<_> = solver.constraints().map(|one| [one.a, one.b]).collect();
    let is_torn = |a: u32, b: u32| {
        solver
            .torn()
            .iter()
            .any(|one| ends[*one as usize] == [a, b] || ends[*one as usize] == [b, a])
    };
    let triangles = solver.triangles().iter().copied();
    triangles.filter(|[a, b, c]| !is_torn(*a, *b) && !is_torn(*b, *c) && !is_torn(*c, *a)).collect()
}

#[test]
fn every_kernel_adds_the_whole_triangles_up_in_their_order_to_the_last_bit() {
    let wind = "gravity = [0, 0, 0]\n[solver]\nrate_hz = 64\nsubsteps = 1\n\
        [wind]\nvelocity = [3, -5, 8]\ndrag = 0.7\n";
    // Constraints without an effect, so that triangles have sides.
    let soft = "compliance = { structural = 1e20, shear = 1e20 }\n";
    let sizes = [[1, 3], [2, 2], [8, 3], [9, 4], [17, 2], [131, 3]];
    for ([columns, rows], cut_every) in
        sizes.into_iter().flat_map(|size| [(size, 0), (size, 7), (size, 1)])
    {
        let text = format!(
            "version = 1\n{wind}[[generate]]\nshape = \"cloth\"\ncolumns = {columns}\nrows = {rows}\n\
             spacing = 0.1\nmass = 0.002\npinned = \"top-even\"\n{soft}"
        );
        let scene = Scene::from_toml(&text, "test").unwrap();
        for kernels in Kernels::available() {
            let mut solver = Solver::with_kernels(&scene, kernels);
            for constraint in
                (0..solver.constraint_count()).filter(|one| cut_every > 0 && one % cut_every == 0)
            {
                solver.cut(u32::try_from(constraint).unwrap()).unwrap();
            }
            step(&mut solver, 1);
            let mut particles = solver.particles().to_vec();
            for (index, one) in particles.iter_mut().enumerate() {
                let angle = (index * index) as f32;
                one.position = (Vec3::from_array(one.position) + 0.03 * angle.sin()).to_array();
                if one.inverse_mass > 0.0 {
                    one.velocity = [angle.cos(), (2.0 * angle).sin(), 20.0 * (3.0 * angle).cos()];
                }
            }
            solver.restore(&particles, &solver.keyframe()).unwrap();
            // The first step starts from the restored state, and the second one is compared.
            step(&mut solver, 1);
            let triangles = whole_triangles(&solver);
            if columns > 1 {
                assert_eq!(triangles == solver.triangles(), solver.torn().is_empty());
            }
            let expected = velocities_in_wind(&triangles, solver.particles());
            step(&mut solver, 1);
            for (index, expected) in expected.into_iter().enumerate() {
                let one = solver.particle(index);
                if one.inverse_mass > 0.0 {
                    assert_eq!(expected, Vec3::from_array(one.velocity), "{kernels:?}, {index}");
                }
            }
        }
    }
}

/// A cloth that hangs by its first row, or by its first column, in a strong wind that blows upwards, too.
fn hanging(columns: u32, rows: u32, is_flag: bool) -> String {
    let pole: Vec<_> = (0..rows).map(|row| (columns * row).to_string()).collect();
    let pinned = if is_flag { format!("[{}]", pole.join(", ")) } else { "\"top\"".to_owned() };
    format!(
        "version = 1\n[solver]\nrate_hz = 240\nsubsteps = 2\ndamping = 0.1\ntethers = 2\n[wind]\nvelocity = [9, 3, 2]\n\
         drag = 0.6\ngust = 0.4\ngust_period = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = {columns}\n\
         rows = {rows}\nspacing = 0.05\nmass = 0.0005\nlinks = [\"structural\", \"shear\", \"bend\"]\n\
         pinned = {pinned}\n"
    )
}

/// The wind pushes neither part of a cut cloth at the triangles between them, and a particle at the cut divides its mass
/// among the triangles that are left.
#[test]
fn the_part_of_a_cut_cloth_moves_in_wind_as_a_cloth_of_its_size_to_the_last_bit() {
    for ([columns, rows], [columns_left, rows_left]) in [([14, 12], [14, 5]), ([31, 9], [16, 9])] {
        let is_flag = rows == rows_left;
        let [whole, part] =
            [hanging(columns, rows, is_flag), hanging(columns_left, rows_left, is_flag)]
                .map(|text| Scene::from_toml(&text, "test").unwrap());
        for (kernels, threads) in
            Kernels::available().map(|one| (one, 1)).chain([(Kernels::best(), 3)])
        {
            let [mut cut, mut alone] =
                [&whole, &part].map(|scene| Solver::with_kernels(scene, kernels));
            for solver in [&mut cut, &mut alone] {
                solver.set_threads(threads);
                solver.compute_forces(true);
            }
            let is_left = |one: u32| one % columns < columns_left && one / columns < rows_left;
            let between: Vec<_> = (0_u32..).zip(cut.constraints()).collect();
            for (index, one) in between {
                if is_left(one.a) != is_left(one.b) {
                    cut.cut(index).unwrap();
                }
            }
            let left: Vec<_> = (0..columns * rows).filter(|one| is_left(*one)).collect();
            for number in 0..300 {
                step(&mut cut, 1);
                step(&mut alone, 1);
                for (index, particle) in left.iter().enumerate() {
                    let found = cut.particle(*particle as usize);
                    assert_eq!(
                        found,
                        alone.particle(index),
                        "{kernels:?}, step {number}, {particle}"
                    );
                }
            }
            let pulls = |solver: &Solver| {
                let forces = solver.forces().unwrap().particles.iter();
                forces.map(|one| one.impulse).collect::<Vec<_>>()
            };
            let pulled = pulls(&alone);
            assert!(pulled.iter().any(|one| one[0].abs() > 1e-5), "{pulled:?}");
            assert_eq!(pulls(&cut), pulled);
        }
    }
}

#[test]
fn a_triangle_with_a_torn_side_catches_no_wind_until_a_reset() {
    let text = triangle("velocity = [0, 0, 4]\ndrag = 0.6", 1000);
    // The diagonal from 0 to 3 is a side of both triangles, the side from 0 to 1 one of the upper one, and the other
    // diagonal none of any.
    for (cut, expected) in [([0, 3], 0.0), ([0, 1], 0.5), ([1, 2], 1.0)] {
        let mut solver = solver(&text);
        let place = solver.constraints().position(|one| [one.a, one.b] == cut).unwrap();
        let constraint = u32::try_from(place).unwrap();
        let momentum =
            |solver: &Solver| (0..4).map(|one| 3.0 * velocity(solver, one)[2]).sum::<f64>();
        let whole = 0.6 * 16.0 * 1e-3;
        solver.cut(constraint).unwrap();
        step(&mut solver, 1);
        assert_near(&format!("{cut:?}"), expected * whole, momentum(&solver), 1e-4 * whole);
        let (torn, keyframe) = (solver.particles().to_vec(), solver.keyframe());
        solver.reset();
        step(&mut solver, 2);
        assert_close("after a reset", whole, momentum(&solver), 1e-4);
        solver.restore(&torn, &keyframe).unwrap();
        step(&mut solver, 1);
        let twice = 2.0 * expected * whole;
        assert_near("after a restore", twice, momentum(&solver), 2e-3 * whole);
    }
}

/// A command may give the scene wind after a tear.
#[test]
fn wind_that_rises_later_passes_through_torn_triangles() {
    let text = triangle("velocity = [0, 0, 0]\ndrag = 0", 1000);
    let mut solver = solver(&text);
    let constraints: Vec<_> = (0..).zip(solver.constraints()).map(|(index, _)| index).collect();
    for constraint in constraints {
        solver.cut(constraint).unwrap();
    }
    step(&mut solver, 3);
    solver.set("wind.velocity", sim_solver::ParameterValue::Vector([0.0, 0.0, 2.0]), None).unwrap();
    solver.set("wind.drag", sim_solver::ParameterValue::Number(1.0), None).unwrap();
    step(&mut solver, 10);
    assert!((0..4).all(|one| velocity(&solver, one) == [0.0; 3]));
}

#[test]
fn a_scene_without_wind_has_no_air() {
    let text = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 2\nrows = 2\n\
         spacing = 1\npinned = \"none\"\n";
    let mut calm = solver(text);
    step(&mut calm, 10);
    assert_eq!(velocity(&calm, 0), [0.0; 3]);
    calm.set("wind.velocity", sim_solver::ParameterValue::Vector([0.0, 0.0, 2.0]), None).unwrap();
    calm.set("wind.drag", sim_solver::ParameterValue::Number(1.0), None).unwrap();
    step(&mut calm, 10);
    assert!(velocity(&calm, 0)[2] > 0.0);
}
