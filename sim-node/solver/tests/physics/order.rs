//! The effect of the order of projection on the energy with small steps.

use sim_solver::Solver;

use super::{assert_at_most, particles, solver, step};

/// Returns a rigid, undamped sheet of 48 x 48 that swings down from its pinned row.
fn sheet(order: &str) -> Solver {
    solver(&format!(
        "[solver]\nrate_hz = 60\nsubsteps = 8\norder = \"{order}\"\n[[generate]]\nshape = \"cloth\"\n\
         columns = 48\nrows = 48\nspacing = 0.04\ndown = [0, 0, 1]\n"
    ))
}

/// Returns the energy relative to the start, in J/kg.
fn energy(solver: &Solver) -> f64 {
    let of = |one: sim_solver::Particle| {
        let squared: f64 = one.velocity.iter().map(|axis| f64::from(*axis).powi(2)).sum();
        squared / 2.0 + 9.81 * f64::from(one.position[1])
    };
    particles(solver).map(of).sum::<f64>() / solver.particle_count() as f64
}

/// Returns the largest energy in two seconds.
fn max_energy(order: &str) -> f64 {
    let mut solver = sheet(order);
    let frames = (0..120).map(|_| {
        step(&mut solver, 1);
        energy(&solver)
    });
    frames.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn the_listed_order_gains_energy_without_bound_and_groups_gain_none() {
    // The sheet has 9.8 J/kg to lose. In listed order it gains thousands of times as much.
    let listed = max_energy("listed");
    assert!(listed > 1000.0, "the listed order gained {listed} J/kg");
    assert_at_most("energy of the grouped order", 0.0, max_energy("grouped"));
}
