//! The selected snapshots of a recording, which a format reads as often as it needs.

use std::collections::BTreeSet;
use std::io::Read;
use std::ops::ControlFlow;

use anyhow::bail;
use recording::{OutcomeRow, RunDescription, SceneState};
use sim_solver::Scene;
use sim_solver::scene::Up;

/// Visits the states of the selected snapshots in their order, until the visitor breaks.
pub(crate) type VisitStates<'a> = dyn Fn(&mut dyn FnMut(&SceneState) -> anyhow::Result<ControlFlow<()>>) -> anyhow::Result<()>
    + 'a;

/// Opens the bytes of a recording.
pub(crate) type OpenBytes<'a> = dyn Fn() -> std::io::Result<Box<dyn Read>> + 'a;

/// The selected snapshots. Only one state at a time is in memory.
pub(crate) struct Snapshots<'a> {
    pub(crate) run: &'a RunDescription,
    /// The scene, unless it cannot be read.
    pub(crate) scene: Option<&'a Scene>,
    /// Axis of the scene that points up.
    pub(crate) up: Up,
    /// The scene has two dimensions.
    pub(crate) is_2d: bool,
    /// First step of the recording.
    pub(crate) first_step: u64,
    /// Steps of the selected snapshots, ascending. Not empty.
    pub(crate) steps: &'a [u64],
    /// Steps at which a command put a state in place, so that no motion leads to it.
    pub(crate) replaced_at: &'a BTreeSet<u64>,
    /// Number of particles of each snapshot.
    pub(crate) particle_count: usize,
    /// Exports evenly spaced frames in place of the snapshots, this many per second of simulated time.
    pub(crate) frames_per_s: Option<u16>,
    pub(crate) visit: &'a VisitStates<'a>,
    /// Opens the file itself, up to the end of its readable part.
    pub(crate) open_bytes: &'a OpenBytes<'a>,
}

impl Snapshots<'_> {
    /// Returns the simulated time of the run, which begins at step 0.
    pub(crate) fn run_time_s(&self, step: u64) -> f64 {
        step as f64 / f64::from(self.run.rate_hz)
    }

    /// Returns the simulated time since the first snapshot of the recording.
    pub(crate) fn time_s(&self, step: u64) -> f64 {
        step.saturating_sub(self.first_step) as f64 / f64::from(self.run.rate_hz)
    }

    /// Returns `true` if a motion leads from the state of one step to the state of a later step.
    pub(crate) fn is_continuous(&self, [from, to]: [u64; 2]) -> bool {
        self.replaced_at.range(from + 1..=to).next().is_none()
    }

    /// Reads the selected snapshots from first to last.
    pub(crate) fn for_each(
        &self,
        mut add: impl FnMut(&SceneState) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut count = 0;
        (self.visit)(&mut |state| {
            self.check_particle_count(state)?;
            add(state)?;
            count += 1;
            Ok(ControlFlow::Continue(()))
        })?;
        if count != self.steps.len() {
            bail!("the file has changed: {} of {} snapshots are left", count, self.steps.len());
        }
        Ok(())
    }

    /// Returns the state of the first selected snapshot.
    pub(crate) fn first(&self) -> anyhow::Result<SceneState> {
        let mut first = SceneState::default();
        (self.visit)(&mut |state| {
            self.check_particle_count(state)?;
            first = state.clone();
            Ok(ControlFlow::Break(()))
        })?;
        Ok(first)
    }

    fn check_particle_count(&self, state: &SceneState) -> anyhow::Result<()> {
        let (step, count, expected) = (state.row.step, state.particles.len(), self.particle_count);
        if count != expected {
            bail!(
                "the snapshot of step {step} has {count} particles, but the first one {expected}"
            );
        }
        Ok(())
    }
}

/// Returns the outcomes of commands that a state adds. The first selected snapshot adds the outcomes of its step.
pub(crate) fn new_outcomes(state: &SceneState) -> &[OutcomeRow] {
    // They are in the order of their steps.
    let end = state.outcomes.partition_point(|row| row.step <= state.row.step);
    &state.outcomes[..end]
}
