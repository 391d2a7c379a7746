//! The reach and the effect of cuts and pushes.

use sim_solver::{Push, Reason, Solver, Sphere, Sweep, TearCause};

use crate::physics::{assert_near, bits, position, solver, step, velocity};

/// A net of 5 x 4 particles, 1 m apart, in the xy plane. Particle (c, r) is at (c, -r, 0).
const NET: &str = "gravity = [0, 0, 0]\n[solver]\nrate_hz = 100\nsubsteps = 1\n[[generate]]\nshape = \"cloth\"\n\
     columns = 5\nrows = 4\nspacing = 1\nlinks = [\"structural\"]\npinned = \"none\"\n";

fn sphere(center: [f32; 3], radius: f32) -> Sphere {
    Sphere { center, radius }
}

/// Returns the two particles of each torn constraint.
fn torn_pairs(solver: &Solver) -> Vec<[u32; 2]> {
    let all: Vec<_> = solver.constraints().map(|one| [one.a, one.b]).collect();
    solver.torn().iter().map(|index| all[*index as usize]).collect()
}

#[test]
fn a_cut_tears_one_constraint_before_the_step() {
    let mut solver = solver(NET);
    solver.cut(7).unwrap();
    step(&mut solver, 1);
    assert_eq!((solver.torn(), solver.tear_causes()), (&[7][..], &[TearCause::Cut][..]));
    assert_eq!(solver.cut(7), Err(Reason::AlreadyTorn));
    assert_eq!(solver.cut(31), Err(Reason::UnknownConstraint));
}

#[test]
fn a_cut_with_a_radius_tears_constraints_with_an_end_strictly_inside() {
    let mut solver = solver(NET);
    // Particle 6 is at (1, -1). Its neighbours are exactly 1 m away, and thus not inside.
    solver.cut_radius(sphere([1.0, -1.0, 0.0], 1.0)).unwrap();
    step(&mut solver, 1);
    let mut pairs = torn_pairs(&solver);
    pairs.sort_unstable();
    assert_eq!(pairs, [[1, 6], [5, 6], [6, 7], [6, 11]]);
    // The same cut again tears nothing new.
    solver.cut_radius(sphere([1.0, -1.0, 0.0], 1.0)).unwrap();
    solver.cut_radius(sphere([1.0, -1.0, 0.0], 0.0)).unwrap();
    step(&mut solver, 1);
    assert_eq!(solver.new_torn_count(), 0);
}

#[test]
fn a_sweep_tears_constraints_that_cross_it_in_its_view_direction() {
    let mut solver = solver(NET);
    // Between the first and the second row, across columns 1 to 3, seen from far in front.
    let sweep =
        Sweep { from: [0.5, -0.5, 30.0], to: [3.5, -0.5, 30.0], direction: [0.0, 0.0, -2.0] };
    solver.cut_segment(sweep).unwrap();
    step(&mut solver, 1);
    assert_eq!(torn_pairs(&solver), [[1, 6], [2, 7], [3, 8]]);
}

#[test]
fn a_sweep_in_the_plane_of_the_net_cuts_in_its_view_direction() {
    let text = NET.replace("gravity", "dimensions = 2\ngravity");
    let mut solver = solver(&text);
    let (from, to, direction) = ([0.2, 0.3, 0.0], [0.8, -1.4, 0.0], [0.0, 0.0, 1.0]);
    solver.cut_segment(Sweep { from, to, direction }).unwrap();
    step(&mut solver, 1);
    assert_eq!(torn_pairs(&solver), [[0, 1], [5, 6]]);
    let leaves = Sweep { from: [0.0, 0.0, 1.0], to, direction };
    assert_eq!(solver.cut_segment(leaves), Err(Reason::OutOfRange));
}

#[test]
fn a_sweep_without_area_cuts_nothing_and_a_sweep_without_direction_is_refused() {
    let mut solver = solver(NET);
    let at = [0.5, 0.0, 0.0];
    let sweep = |to: [f32; 3], direction: [f32; 3]| Sweep { from: at, to, direction };
    solver.cut_segment(sweep(at, [0.0, 0.0, 1.0])).unwrap();
    solver.cut_segment(sweep([0.5, 0.0, 5.0], [0.0, 0.0, 1.0])).unwrap();
    assert_eq!(solver.cut_segment(sweep([0.0; 3], [0.0; 3])), Err(Reason::OutOfRange));
    let wrong = sweep([f32::INFINITY, 0.0, 0.0], [0.0, 0.0, 1.0]);
    assert_eq!(solver.cut_segment(wrong), Err(Reason::NonFinite));
    step(&mut solver, 1);
    assert_eq!(solver.torn(), []);
}

#[test]
fn a_push_gives_particles_strictly_inside_its_sphere_the_clamped_velocity_of_the_brush() {
    let mut solver = solver(NET);
    solver.pin(0).unwrap();
    // The push reaches (1, 0), (0, -1) and the pinned (0, 0). (1, -1) is sqrt(2) away.
    let push = Push { sphere: sphere([0.0; 3], 1.25), delta: [0.03, -0.5, 0.01], limit: Some(0.1) };
    solver.push(push).unwrap();
    for (index, expected) in
        [(1, [3.0, -10.0, 1.0]), (5, [3.0, -10.0, 1.0]), (0, [0.0; 3]), (6, [0.0; 3])]
    {
        let found = velocity(&solver, index);
        for axis in 0..3 {
            assert_near(&format!("velocity of {index}"), expected[axis], found[axis], 1e-5);
        }
    }
    assert_eq!(solver.particle(0).position, [0.0; 3]);
}

#[test]
fn a_pushed_particle_moves_as_far_as_the_brush_in_the_next_step() {
    let mut solver = solver(
        "gravity = [0, 0, 0]\n[solver]\nrate_hz = 240\nsubsteps = 4\n[[particle]]\nposition = [0, 0, 0]\n",
    );
    let push =
        Push { sphere: sphere([0.0; 3], 1.0), delta: [0.02, -30.0, 12.0], limit: Some(10.0) };
    solver.push(push).unwrap();
    step(&mut solver, 1);
    for (axis, expected) in [0.02, -10.0, 10.0].into_iter().enumerate() {
        assert_near("distance in one step", expected, position(&solver, 0)[axis], 1e-4);
    }
    solver
        .push(Push { limit: None, delta: [0.5, 0.0, 0.0], sphere: sphere([0.0, -10.0, 10.0], 1.0) })
        .unwrap();
    step(&mut solver, 1);
    assert_near("without a limit", 0.52, position(&solver, 0)[0], 1e-4);
}

#[test]
fn a_wrong_push_or_cut_changes_no_bit() {
    let mut solver = solver(NET);
    step(&mut solver, 3);
    let before = bits(&solver);
    let good = Push { sphere: sphere([0.0; 3], 1.0), delta: [1.0; 3], limit: None };
    for (wrong, reason) in [
        (Push { sphere: sphere([0.0; 3], -1.0), ..good }, Reason::OutOfRange),
        (Push { sphere: sphere([2e7, 0.0, 0.0], 1.0), ..good }, Reason::OutOfRange),
        (Push { sphere: sphere([f32::NAN, 0.0, 0.0], 1.0), ..good }, Reason::NonFinite),
        (Push { sphere: sphere([0.0; 3], f32::INFINITY), ..good }, Reason::NonFinite),
        (Push { delta: [0.0, f32::NAN, 0.0], ..good }, Reason::NonFinite),
        (Push { delta: [0.0, 1e8, 0.0], ..good }, Reason::OutOfRange),
        (Push { limit: Some(-0.1), ..good }, Reason::OutOfRange),
        (Push { limit: Some(f32::NAN), ..good }, Reason::NonFinite),
    ] {
        assert_eq!(solver.push(wrong), Err(reason), "{wrong:?}");
    }
    assert_eq!(solver.cut_radius(sphere([0.0; 3], -0.5)), Err(Reason::OutOfRange));
    assert_eq!(solver.cut_radius(sphere([0.0; 3], f32::NAN)), Err(Reason::NonFinite));
    assert_eq!(bits(&solver), before);
}
