//! Motion of free particles and of systems: gravity, damping, momentum, energy, pendulums.

use proptest::prelude::*;
use sim_solver::{Particle, Solver};

use super::{
    assert_at_most, assert_close, assert_near, distance, position, rates, solver, step, stepped,
    velocity,
};

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
        let what = format!("fall at {rate} x {substeps}");
        assert_close(&what, expected, position(&solver, 0)[1], 1e-4);
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
        let what = format!("fall from 1 km at {m} substeps a second");
        assert_close(&what, expected, 1000.0 - position(&solver, 0)[1], 1e-3);
    }
}

#[test]
fn free_fall_to_the_ground_is_exact_from_any_height_in_any_number_of_substeps() {
    // -g h^2 m (m + 1) / 2 after m substeps. A state of positions alone loses gravity where h^2 g is
    // below their resolution: at 10 m with 256 substeps, a particle would hang in the air. With a
    // velocity, the rounding of positions averages out, except for (resolution / h)^2 / (8 g), which
    // is 11 mm at 1 km with 256 substeps.
    for (height, frames) in [(0.3, 15), (10.0, 86), (100.0, 271), (1000.0, 857)] {
        for substeps in [1, 4, 16, 64, 256] {
            let head = rates(60, substeps);
            let text = format!("{head}[[particle]]\nposition = [0, {height}, 0]\n");
            let way = position(&solver(&text), 0)[1] - position(&stepped(&text, frames), 0)[1];
            let (h, m) = (1.0 / f64::from(60 * substeps), f64::from(frames * substeps));
            let what = format!("fall from {height} m in {frames} frames of {substeps} substeps");
            assert_close(&what, 9.81 * h * h * m * (m + 1.0) / 2.0, way, 1e-3);
        }
    }
}

#[test]
fn a_particle_without_forces_moves_in_a_straight_line() {
    let text = "gravity = [0, 0, 0]\n[solver]\nrate_hz = 60\nsubsteps = 1\n\
         [[particle]]\nposition = [0, 0, 0]\nvelocity = [3, -1, 0.5]\n";
    let solver = stepped(text, 600);
    for (axis, speed) in [3.0, -1.0, 0.5].into_iter().enumerate() {
        assert_close("distance", 10.0 * speed, position(&solver, 0)[axis], 1e-5);
        assert_close("speed", speed, velocity(&solver, 0)[axis], 1e-5);
    }
}

#[test]
fn steps_of_one_second_match_the_table_of_semi_implicit_euler() {
    // 0, 10, 30, 60, ... 550 m and 10 n m/s. All are whole numbers and thus exact in f32.
    let mut solver = solver(
        "gravity = [10, 0, 0]\n[solver]\nrate_hz = 1\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\n",
    );
    for n in 1..=10_u8 {
        step(&mut solver, 1);
        let n = f64::from(n);
        assert_near("position", 5.0 * n * (n + 1.0), position(&solver, 0)[0], 0.0);
        assert_near("speed", 10.0 * n, velocity(&solver, 0)[0], 0.0);
    }
}

#[test]
fn steps_of_a_hundredth_of_a_second_are_accurate_after_a_thousand_seconds() {
    // a h^2 m (m + 1) / 2: 500.5 m at 10 s, 5,000,050 m at 1,000 s, where f32 resolves half a
    // metre.
    let mut solver = solver(
        "gravity = [10, 0, 0]\n[solver]\nrate_hz = 100\nsubsteps = 1\nmax_speed = 1e5\n\
         [[particle]]\nposition = [0, 0, 0]\n",
    );
    step(&mut solver, 1000);
    assert_close("position at 10 s", 500.5, position(&solver, 0)[0], 1e-5);
    assert_close("speed at 10 s", 100.0, velocity(&solver, 0)[0], 1e-5);
    step(&mut solver, 99_000);
    assert_close("position at 1,000 s", 5_000_050.0, position(&solver, 0)[0], 5e-4);
    assert_close("speed at 1,000 s", 10_000.0, velocity(&solver, 0)[0], 5e-4);
}

#[test]
fn damping_removes_a_fixed_fraction_of_the_speed_in_each_substep() {
    // v = v0 (1 - c h)^m. The half-life at high rates is ln 2 / c.
    for (rate, substeps, damping) in [(60, 1, 0.3), (60, 20, 0.3), (240, 4, 5.0)] {
        let text = format!(
            "gravity = [0, 0, 0]\n[solver]\nrate_hz = {rate}\nsubsteps = {substeps}\ndamping = {damping}\n\
             [[particle]]\nposition = [0, 0, 0]\nvelocity = [8, 0, 0]\n"
        );
        let solver = stepped(&text, 2 * rate);
        let substeps_per_s = f64::from(rate * substeps);
        let expected = 8.0 * (1.0 - damping / substeps_per_s).powf(2.0 * substeps_per_s);
        assert_close("speed after 2 s", expected, velocity(&solver, 0)[0], 1e-4);
    }
}

#[test]
fn a_push_with_zero_velocity_stops_particles_in_its_reach() {
    let mut solver =
        solver("gravity = [0, 0, 0]\n[[particle]]\nposition = [0, 0, 0]\nvelocity = [3, 2, 1]\n");
    step(&mut solver, 5);
    let sphere = sim_solver::Sphere { center: solver.particle(0).position, radius: 0.1 };
    let before = solver.particle(0).position;
    solver.push(sim_solver::Push { sphere, delta: [0.0; 3], limit: None }).unwrap();
    step(&mut solver, 5);
    assert_eq!((solver.particle(0).position, solver.particle(0).velocity), (before, [0.0; 3]));
}

#[test]
fn the_terminal_speed_is_gravity_over_damping_at_every_rate() {
    for rate in [60, 480] {
        let text = format!(
            "[solver]\nrate_hz = {rate}\nsubsteps = 1\ndamping = 2.0\n[[particle]]\nposition = [0, 0, 0]\n"
        );
        let mut solver = stepped(&text, rate * 10);
        assert_close("terminal speed", -9.81 / 2.0, velocity(&solver, 0)[1], 1e-4);
        let before = position(&solver, 0)[1];
        step(&mut solver, rate);
        assert_close(
            "terminal distance in 1 s",
            -9.81 / 2.0,
            position(&solver, 0)[1] - before,
            1e-4,
        );
    }
}

#[test]
fn speed_is_limited_to_max_speed() {
    let text =
        "[solver]\nrate_hz = 60\nsubsteps = 1\nmax_speed = 3\n[[particle]]\nposition = [0, 0, 0]\n";
    assert_near("speed", -3.0, velocity(&stepped(text, 600), 0)[1], 1e-5);
}

#[test]
fn gravity_has_the_magnitude_and_direction_of_the_scene() {
    for gravity in [[0.0, 981.0, 0.0], [0.0, 0.0, -1.62], [3.0, -4.0, 5.0]] {
        let text = format!(
            "gravity = {gravity:?}\n[solver]\nrate_hz = 100\nsubsteps = 1\n[[particle]]\nposition = [0, 0, 0]\n"
        );
        let solver = stepped(&text, 100);
        for (axis, expected) in gravity.into_iter().enumerate() {
            assert_close("speed after 1 s", expected, velocity(&solver, 0)[axis], 1e-4);
        }
    }
}

#[test]
fn a_box_of_the_pixel_demonstration_falls_340_pixels_in_3_69_seconds() {
    // 0.5 / 10,000 px/ms^2 = 50 px/s^2, from y 60 to y 400.
    let text = "dimensions = 2\nup = \"-y\"\nunit = \"px\"\ngravity = [0, 50, 0]\n[solver]\nrate_hz = 1000\n\
         substeps = 1\n[[particle]]\nposition = [220, 60, 0]\n";
    let mut solver = solver(text);
    let mut steps = 0_u32;
    while position(&solver, 0)[1] < 400.0 && steps < 10_000 {
        step(&mut solver, 1);
        steps += 1;
    }
    assert_near("seconds", (2.0 * 340.0 / 50.0_f64).sqrt(), f64::from(steps) / 1000.0, 2e-3);
}

/// Returns a pendulum of 1 m, released at an angle from the vertical, without damping.
fn pendulum(angle: f64, rate: u32, substeps: u32) -> Solver {
    solver(&format!(
        "[solver]\nrate_hz = {rate}\nsubsteps = {substeps}\n[[particle]]\nposition = [0, 0, 0]\npinned = true\n\
         [[particle]]\nposition = [{}, {}, 0]\n[[constraint]]\nparticles = [0, 1]\nrest_length = 1\n",
        angle.sin(),
        -angle.cos()
    ))
}

/// Returns the period of a pendulum by the elliptic integral: 2 pi sqrt(L/g) / agm(1, cos(angle / 2)).
fn period(angle: f64) -> f64 {
    let (mut a, mut b) = (1.0, (angle / 2.0).cos());
    for _ in 0..20 {
        (a, b) = (f64::midpoint(a, b), f64::sqrt(a * b));
    }
    std::f64::consts::TAU / 9.81_f64.sqrt() / a
}

/// Returns the seconds from the first to the second crossing of the vertical in the same direction.
fn measured_period(solver: &mut Solver, rate: u32) -> f64 {
    let mut crossings = Vec::new();
    let mut before = position(solver, 1)[0];
    for count in 1..20 * rate {
        step(solver, 1);
        let x = position(solver, 1)[0];
        if before > 0.0 && x <= 0.0 {
            crossings.push((f64::from(count) - 1.0 + before / (before - x)) / f64::from(rate));
            if crossings.len() == 2 {
                return crossings[1] - crossings[0];
            }
        }
        before = x;
    }
    panic!("the pendulum does not swing: {crossings:?}");
}

#[test]
fn the_period_of_a_pendulum_agrees_with_the_elliptic_integral() {
    assert_near("agm, angle 0.1", 2.007_321, period(0.1), 1e-6);
    assert_near("agm, angle 1", 2.139_138, period(1.0), 1e-6);
    for (angle, substeps, share) in
        [(0.1, 20, 1e-3), (0.5, 20, 3e-3), (1.0, 20, 5e-3), (1.0, 10, 1e-2)]
    {
        let found = measured_period(&mut pendulum(angle, 60, substeps), 60);
        assert_close(
            &format!("period from {angle} at 60 x {substeps}"),
            period(angle),
            found,
            share,
        );
    }
}

#[test]
fn an_undamped_pendulum_never_gains_energy() {
    for substeps in [1, 10, 20] {
        let mut solver = pendulum(1.0, 60, substeps);
        let energy = |solver: &Solver| {
            let speed_squared: f64 = velocity(solver, 1).iter().map(|axis| axis * axis).sum();
            speed_squared / 2.0 + 9.81 * position(solver, 1)[1]
        };
        let start = energy(&solver);
        for _ in 0..60 * 60 {
            step(&mut solver, 1);
            let found = energy(&solver);
            assert!(found <= start + 1e-3 * 9.81, "60 x {substeps}: {found}, started with {start}");
        }
        assert_at_most("energy after a minute", start + 1e-3 * 9.81, energy(&solver));
        assert_near("length", 1.0, distance(&solver, 0, 1), 1e-3);
    }
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
    // A sheet released from the horizontal. In listed order it blows up.
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
        // 1e-3 m g L for each of the 1600 particles, with L = 2 m.
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
        // Speeds reach 1e3 m/s in a substep of 1/960 s. A millionth of m v is rounding.
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
