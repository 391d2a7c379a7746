//! Scenes of the lessons, run in the solver.

use std::fmt;

use anyhow::Context;
use sim_solver::{Scene, Solver};

/// How often a scene is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rates {
    /// Steps a second.
    pub(super) rate_hz: u32,
    /// Substeps of a step.
    pub(super) substeps: u32,
    /// Passes over the constraints in a substep.
    pub(super) iterations: u32,
}

impl Rates {
    /// One substep of one pass in each step.
    pub(super) fn plain(rate_hz: u32) -> Self {
        Self { rate_hz, substeps: 1, iterations: 1 }
    }

    /// Length of a substep, s.
    pub(super) fn h(self) -> f64 {
        1.0 / (f64::from(self.rate_hz) * f64::from(self.substeps))
    }
}

/// The head of a scene's settings; keys of `[solver]` can follow.
impl fmt::Display for Rates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rate_hz, substeps, iterations } = self;
        writeln!(
            formatter,
            "[solver]\nrate_hz = {rate_hz}\nsubsteps = {substeps}\niterations = {iterations}"
        )
    }
}

/// The solver of a scene without its first line, at step 0.
pub(super) fn solver(text: &str) -> anyhow::Result<Solver> {
    let scene = Scene::from_toml(&format!("version = 1\n{text}"), "lesson");
    Ok(Solver::new(&scene.context("making the scene of a lesson")?))
}

/// The solver of a scene without its first line, after some steps.
pub(super) fn stepped(text: &str, steps: u32) -> anyhow::Result<Solver> {
    let mut solver = solver(text)?;
    (0..steps).for_each(|_| solver.step());
    Ok(solver)
}

/// A coordinate of a particle: 0 is x.
pub(super) fn coordinate(solver: &Solver, particle: usize, axis: usize) -> f64 {
    f64::from(solver.particle(particle).position[axis])
}

/// Numbers against their closed forms, within an absolute tolerance.
#[cfg(test)]
#[track_caller]
pub(super) fn assert_all_near(what: &str, expected: &[f64], found: &[f64], tolerance: f64) {
    assert_eq!(expected.len(), found.len(), "{what}");
    for (row, (expected, found)) in expected.iter().zip(found).enumerate() {
        let error = (found - expected).abs();
        assert!(error <= tolerance, "{what}, row {row}: expected {expected}, found {found}");
    }
}
