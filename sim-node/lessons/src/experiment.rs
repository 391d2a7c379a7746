//! Scenes of the lessons, run in the solver.

use std::fmt;

use sim_solver::{Scene, Solver};

/// Rate, substeps and iterations of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rates {
    /// Steps per second.
    pub(crate) rate_hz: u32,
    /// Substeps per step.
    pub(crate) substeps: u32,
    /// Passes over the constraints in each substep.
    pub(crate) iterations: u32,
}

impl Rates {
    /// One substep with one pass in each step.
    pub(crate) fn plain(rate_hz: u32) -> Self {
        Self { rate_hz, substeps: 1, iterations: 1 }
    }

    /// Length of a substep, s.
    pub(crate) fn h(self) -> f64 {
        1.0 / (f64::from(self.rate_hz) * f64::from(self.substeps))
    }
}

/// The start of a `[solver]` table; more of its keys can follow.
impl fmt::Display for Rates {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rate_hz, substeps, iterations } = self;
        writeln!(
            formatter,
            "[solver]\nrate_hz = {rate_hz}\nsubsteps = {substeps}\niterations = {iterations}"
        )
    }
}

/// Returns the solver of a scene at step 0. `text` lacks only the line with the version.
#[allow(clippy::panic, reason = "the scenes are texts of this crate: a wrong one is a bug here")]
pub(crate) fn solver(text: &str) -> Solver {
    let scene = Scene::from_toml(&format!("version = 1\n{text}"), "lesson");
    Solver::new(&scene.unwrap_or_else(|error| panic!("{error}, in the scene:\n{text}")))
}

/// Returns the solver of a scene after `steps` steps. `text` lacks only the line with the version.
pub(crate) fn stepped(text: &str, steps: u32) -> Solver {
    let mut solver = solver(text);
    (0..steps).for_each(|_| solver.step());
    solver
}

/// Returns a coordinate of a particle. Axis 0 is x.
pub(crate) fn coordinate(solver: &Solver, particle: usize, axis: usize) -> f64 {
    f64::from(solver.particle(particle).position[axis])
}

/// Asserts that numbers agree with their closed forms within an absolute tolerance.
#[cfg(test)]
#[track_caller]
pub(crate) fn assert_all_near(name: &str, expected: &[f64], actual: &[f64], tolerance: f64) {
    assert_eq!(expected.len(), actual.len(), "{name}");
    for (row, (expected, actual)) in expected.iter().zip(actual).enumerate() {
        let error = (actual - expected).abs();
        assert!(error <= tolerance, "{name}, row {row}: expected {expected}, got {actual}");
    }
}
