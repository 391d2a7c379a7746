//! The states of a simulation that later commands rewind to.

use std::collections::BTreeMap;

use crate::log::TimedCommand;
use sim_contract::{Action, Reason, RestoreContents};
use sim_solver::{Applied, Keyframe, Particle, Solver};

/// The states of the steps that the commands of a simulation name. A node that keeps every step would have
/// them.
#[derive(Debug)]
pub(super) struct KeptStates {
    /// By step: the number of commands that are still to rewind to it, and the state once it is computed.
    by_step: BTreeMap<u64, (usize, Option<State>)>,
}

/// A complete state.
#[derive(Debug, Clone)]
pub struct State {
    /// The particles.
    pub particles: Vec<Particle>,
    /// The rest of the state.
    pub keyframe: Keyframe,
}

impl State {
    /// Puts the state in place, or only its positions and velocities if the action says so.
    pub(super) fn put_in_place(
        &self,
        solver: &mut Solver,
        action: &Action,
    ) -> Result<Applied, Reason> {
        let result = match action {
            Action::Restore { contents: RestoreContents::Motion, .. } => {
                solver.put_motion_in_place(&self.particles)
            }
            _ => solver.put_in_place(&self.particles, &self.keyframe),
        };
        result.map(|()| Applied::InPlace).map_err(|_| Reason::InvalidState)
    }
}

impl KeptStates {
    /// Keeps the states for these commands, which are in the order of application.
    pub(super) fn for_commands(commands: &[TimedCommand]) -> Self {
        let mut by_step = BTreeMap::new();
        for command in commands {
            if let Action::Rewind { to_step: Some(to_step), .. } = command.action {
                by_step.entry(to_step).or_insert((0, None)).0 += 1;
            }
        }
        Self { by_step }
    }

    /// Keeps the state after a step, if a command rewinds to it.
    pub(super) fn add(&mut self, step: u64, solver: &Solver) {
        if let Some((_, state)) = self.by_step.get_mut(&step) {
            let particles = solver.particles().to_vec();
            *state = Some(State { particles, keyframe: solver.keyframe() });
        }
    }

    /// Returns the state of a step, if it was computed.
    pub(super) fn take(&mut self, step: u64) -> Option<State> {
        let (use_count, state) = self.by_step.get_mut(&step)?;
        let state = state.clone()?;
        *use_count -= 1;
        if *use_count == 0 {
            self.by_step.remove(&step);
        }
        Some(state)
    }
}
