//! The order of projection decides whether small steps keep their energy.

use sim_solver::Solver;

use super::{assert_at_most, particles, solver, step};

/// A rigid, undamped sheet of 48 x 48 that swings down from its pinned row, in an order.
fn sheet(order: &str) -> Solver {
    solver(&format!(
        "[solver]\nrate_hz = 60\nsubsteps = 8\norder = \"{order}\"\n[[generate]]\nshape = \"cloth\"\n\
         columns = 48\nrows = 48\nspacing = 0.04\ndown = [0, 0, 1]\n"
    ))
}

/// In J/kg, against the height at load.
fn energy(solver: &Solver) -> f64 {
    let of = |one: sim_solver::Particle| {
        let squared: f64 = one.velocity.iter().map(|axis| f64::from(*axis).powi(2)).sum();
        squared / 2.0 + 9.81 * f64::from(one.position[1])
    };
    particles(solver).map(of).sum::<f64>() / solver.particle_count() as f64
}

/// The most energy of two seconds.
fn most_energy(order: &str) -> f64 {
    let mut solver = sheet(order);
    let frames = (0..120).map(|_| {
        step(&mut solver, 1);
        energy(&solver)
    });
    frames.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn the_listed_order_gains_energy_without_bound_and_groups_gain_none() {
    // There are 9.8 J/kg to lose. A sorted order makes thousands of times as much of them.
    let listed = most_energy("listed");
    assert!(listed > 1000.0, "the listed order gained {listed} J/kg");
    assert_at_most("energy of the grouped order", 0.0, most_energy("grouped"));
}
