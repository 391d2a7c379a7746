//! The step against closed forms: what gravity, a stick, a spring and a damper must do is known
//! without running anything.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use proptest::prelude::*;
use sim_solver::{Particle, Scene, Solver};

fn solver(text: &str) -> Solver {
    Solver::new(&Scene::from_toml(&format!("version = 1\n{text}"), "test").unwrap())
}

fn stepped(text: &str, steps: u32) -> Solver {
    let mut solver = solver(text);
    for _ in 0..steps {
        solver.step();
    }
    solver
}

fn distance(solver: &Solver, a: usize, b: usize) -> f64 {
    let (a, b) = (solver.particle(a).position, solver.particle(b).position);
    (0..3).map(|axis| (f64::from(b[axis]) - f64::from(a[axis])).powi(2)).sum::<f64>().sqrt()
}

fn momentum(solver: &Solver) -> [f64; 3] {
    let sum = |axis: usize| {
        let part = |one: Particle| f64::from(one.velocity[axis]) / f64::from(one.inverse_mass);
        (0..solver.particle_count()).map(|index| part(solver.particle(index))).sum()
    };
    [sum(0), sum(1), sum(2)]
}

#[test]
fn free_fall_from_rest_is_the_sum_of_its_substeps() {
    // y = -g h^2 m (m + 1) / 2 after m substeps.
    for (rate, substeps) in [(60, 1), (60, 4), (60, 20), (240, 1)] {
        let text = format!(
            "[solver]\nrate_hz = {rate}\nsubsteps = {substeps}\n[[particle]]\nposition = [0, 0, 0]\n"
        );
        let solver = stepped(&text, rate);
        let m = f64::from(rate * substeps);
        let expected = -9.81 * m * (m + 1.0) / 2.0 / (m * m);
        let y = f64::from(solver.particle(0).position[1]);
        assert!((y / expected - 1.0).abs() < 1e-4, "{rate} x {substeps}: {y}, not {expected}");
    }
}

#[test]
fn free_fall_is_exact_a_kilometre_from_the_origin_in_tiny_substeps() {
    for (rate, substeps) in [(60, 20), (240, 20), (1000, 20)] {
        let text = format!(
            "[solver]\nrate_hz = {rate}\nsubsteps = {substeps}\n[[particle]]\nposition = [0, 1000, 0]\n"
        );
        let solver = stepped(&text, rate);
        let m = f64::from(rate * substeps);
        let expected = 9.81 * m * (m + 1.0) / 2.0 / (m * m);
        let fallen = 1000.0 - f64::from(solver.particle(0).position[1]);
        assert!((fallen / expected - 1.0).abs() < 1e-3, "{m}: {fallen}, not {expected}");
    }
}

#[test]
fn damping_ends_at_gravity_over_damping_at_every_rate() {
    for rate in [60, 480] {
        let text = format!(
            "[solver]\nrate_hz = {rate}\nsubsteps = 1\ndamping = 2.0\n[[particle]]\nposition = [0, 0, 0]\n"
        );
        let solver = stepped(&text, rate * 10);
        let speed = -f64::from(solver.particle(0).velocity[1]);
        assert!((speed / (9.81 / 2.0) - 1.0).abs() < 1e-4, "{rate}: {speed}");
    }
}

#[test]
fn speed_is_limited_to_max_speed() {
    let text =
        "[solver]\nrate_hz = 60\nsubsteps = 1\nmax_speed = 3\n[[particle]]\nposition = [0, 0, 0]\n";
    let speed = -f64::from(stepped(text, 600).particle(0).velocity[1]);
    assert!((speed - 3.0).abs() < 1e-5, "{speed}");
}

/// Two particles at distance 2 on a stick of length 1, without gravity.
fn stick(mass_a: f64, mass_b: f64, extra: &str) -> String {
    format!(
        "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 1\n{extra}\n\
         [[particle]]\nposition = [0, 0, 0]\nmass = {mass_a}\n\
         [[particle]]\nposition = [2, 0, 0]\nmass = {mass_b}\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\n"
    )
}

#[test]
fn a_stick_moves_its_ends_in_proportion_to_their_inverse_masses() {
    for (mass_a, mass_b) in [(1.0, 1.0), (1.0, 3.0), (1.0, 1e6), (1e6, 1.0)] {
        let solver = stepped(&stick(mass_a, mass_b, ""), 1);
        let moved_a = f64::from(solver.particle(0).position[0]);
        let expected = mass_b / (mass_a + mass_b);
        assert!((moved_a - expected).abs() < 1e-6, "{mass_a}:{mass_b} moved {moved_a}");
        assert!((distance(&solver, 0, 1) - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_pinned_end_stays_bit_for_bit_and_the_other_one_makes_the_whole_way() {
    let text = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = [0.1, 0.2, 0.3]\npinned = true\n\
         [[particle]]\nposition = [2.1, 0.2, 0.3]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n";
    let solver = stepped(text, 1);
    assert_eq!(solver.particle(0).position, [0.1, 0.2, 0.3]);
    assert_eq!(solver.particle(0).velocity, [0.0; 3]);
    assert!((f64::from(solver.particle(1).position[0]) - 1.1).abs() < 1e-6);
}

#[test]
fn two_pinned_ends_and_coincident_ends_change_nothing() {
    let pinned = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [2, 0, 0]\npinned = true\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n";
    assert_eq!(stepped(pinned, 5).state_hash(), solver(pinned).state_hash());
    let coincident = "gravity = [0, 0, 0]\n[[particle]]\nposition = [1, 1, 1]\n\
         [[particle]]\nposition = [1, 1, 1]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n";
    assert_eq!(stepped(coincident, 5).state_hash(), solver(coincident).state_hash());
}

#[test]
fn a_stick_of_rest_length_zero_brings_its_ends_together() {
    let text = "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\n\
         [[particle]]\nposition = [2, 0, 0]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 0\n";
    let solver = stepped(text, 3);
    assert!(distance(&solver, 0, 1) < 1e-6);
    assert!(solver.particle(0).position.iter().all(|axis| axis.is_finite()));
}

#[test]
fn pbd_leaves_one_minus_stiffness_of_the_error_for_any_number_of_passes() {
    for stiffness in [0.1, 0.3, 0.6, 0.9, 1.0] {
        for iterations in [1, 2, 8, 64] {
            let extra = format!("method = \"pbd\"\niterations = {iterations}");
            let text = stick(1.0, 3.0, &extra) + &format!("stiffness = {stiffness}\n");
            let residual = distance(&stepped(&text, 1), 0, 1) - 1.0;
            assert!(
                (residual - (1.0 - stiffness)).abs() < 1e-5,
                "stiffness {stiffness}, {iterations} passes: {residual}"
            );
        }
    }
}

#[test]
fn a_compliant_stick_settles_at_weight_times_compliance_at_every_rate() {
    for rate in [30, 60, 240] {
        for (substeps, iterations) in [(1, 1), (4, 1), (20, 1), (1, 10), (4, 3)] {
            let text = format!(
                "[solver]\nrate_hz = {rate}\nsubsteps = {substeps}\niterations = {iterations}\ndamping = 4\n\
                 [[particle]]\nposition = [0, 0, 0]\npinned = true\n\
                 [[particle]]\nposition = [0, -1, 0]\nmass = 2\n\
                 [[constraint]]\nparticles = [0, 1]\nrest_length = 1\ncompliance = 1e-3\n"
            );
            let elongation = distance(&stepped(&text, rate * 20), 0, 1) - 1.0;
            let expected = 2.0 * 9.81 * 1e-3;
            assert!(
                (elongation / expected - 1.0).abs() < 1e-3,
                "{rate} x {substeps} x {iterations}: {elongation}, not {expected}"
            );
        }
    }
}

#[test]
fn an_undamped_spring_swings_as_implicit_euler_says() {
    // (1 + w^2 h^2) x' = 2 x - x_previous: one free particle on a pinned compliant stick.
    let text = "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 1\n\
         [[particle]]\nposition = [0, 0, 0]\npinned = true\n[[particle]]\nposition = [1.5, 0, 0]\n\
         [[constraint]]\nparticles = [0, 1]\nrest_length = 1\ncompliance = 0.001\n";
    let mut solver = solver(text);
    let (mut previous, mut x) = (0.5_f64, 0.5_f64);
    let w2h2 = 1.0 / 0.001 / (60.0 * 60.0);
    for step in 0..120 {
        solver.step();
        (previous, x) = (x, (2.0 * x - previous) / (1.0 + w2h2));
        let actual = f64::from(solver.particle(1).position[0]) - 1.0;
        assert!((actual - x).abs() < 1e-4, "step {step}: {actual}, not {x}");
    }
}

#[test]
fn a_tether_pulls_but_never_pushes() {
    let with_kind = |position: f64| {
        format!(
            "gravity = [0, 0, 0]\n[solver]\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
             [[particle]]\nposition = [{position}, 0, 0]\n\
             [[constraint]]\nparticles = [0, 1]\nrest_length = 1\nkind = \"tether\"\n"
        )
    };
    assert!((distance(&stepped(&with_kind(0.4), 3), 0, 1) - 0.4).abs() < 1e-6);
    assert!((distance(&stepped(&with_kind(1.6), 1), 0, 1) - 1.0).abs() < 1e-6);
}

#[test]
fn two_dimensions_keep_z_at_plus_zero_bit_for_bit() {
    let text = "dimensions = 2\n[[generate]]\nshape = \"cloth\"\ncolumns = 6\nrows = 5\nspacing = 0.1\npinned = \"corners\"\n";
    let solver = stepped(text, 500);
    for index in 0..solver.particle_count() {
        let particle = solver.particle(index);
        assert_eq!(particle.position[2].to_bits(), 0);
        assert_eq!(particle.velocity[2].to_bits(), 0);
    }
}

#[test]
fn a_stiff_cloth_in_grouped_order_gains_no_energy() {
    // A sheet let go from the horizontal; the same in listed order blows up.
    let text = "[solver]\nrate_hz = 60\nsubsteps = 8\n[[generate]]\nshape = \"cloth\"\ncolumns = 40\nrows = 40\n\
         spacing = 0.05\ndown = [0, 0, 1]\n";
    let mut solver = solver(text);
    let energy = |solver: &Solver| -> f64 {
        let of = |one: Particle| {
            let kinetic = one.velocity.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / 2.0;
            kinetic + 9.81 * f64::from(one.position[1])
        };
        (0..solver.particle_count()).map(|index| of(solver.particle(index))).sum()
    };
    let start = energy(&solver);
    for _ in 0..600 {
        solver.step();
        // 1e-3 m g L of each of the 1600 particles, L = 2 m.
        assert!(energy(&solver) <= start + 1600.0 * 1e-3 * 9.81 * 2.0);
    }
}

proptest! {
    #[test]
    fn momentum_is_kept_whatever_the_masses_and_the_stretch(
        masses in prop::collection::vec(0.1..10.0_f64, 4),
        places in prop::collection::vec(-2.0..2.0_f64, 12),
        rest in 0.0..3.0_f64,
    ) {
        let mut text = "gravity = [0, 0, 0]\n".to_owned();
        for (mass, place) in masses.iter().zip(places.chunks(3)) {
            text += &format!("[[particle]]\nposition = {place:?}\nmass = {mass}\n");
        }
        for (a, b) in [(0, 1), (1, 2), (2, 3), (3, 0), (0, 2)] {
            text += &format!("[[constraint]]\nparticles = [{a}, {b}]\nrest_length = {rest}\n");
        }
        let solver = stepped(&text, 3);
        // Speeds reach 1e3 m/s in a substep of 1/960 s; 1e-6 of m v is rounding.
        for axis in momentum(&solver) {
            prop_assert!(axis.abs() < 0.05, "momentum {axis}");
        }
    }
}

#[test]
fn a_hanging_rope_comes_to_rest_at_every_number_of_substeps() {
    for substeps in [1, 4, 20] {
        let text = format!(
            "[solver]\nrate_hz = 240\nsubsteps = {substeps}\ndamping = 4\n[[generate]]\nshape = \"rope\"\n\
             count = 21\nfrom = [0, 0, 0]\nto = [0, -1, 0]\nmass = 0.05\n"
        );
        let solver = stepped(&text, 240 * 10);
        let squares = (0..21).flat_map(|index| solver.particle(index).velocity);
        let sum: f64 = squares.map(|axis| f64::from(axis).powi(2)).sum();
        let rms = (sum / 21.0).sqrt();
        assert!(rms < 1e-3, "240 Hz x {substeps}: {rms} m/s");
    }
}
