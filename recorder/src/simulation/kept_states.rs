//! The states of a simulation that later commands rewind to.

use std::collections::BTreeMap;

use recorder::TimedCommand;
use sim_contract::{Action, Reason};
use sim_solver::{Keyframe, Particle, Solver};

/// The states of the steps that the commands of a simulation name. A node that keeps every step would have
/// them.
#[derive(Debug)]
pub(super) struct KeptStates {
    /// By step: the number of commands that are still to rewind to it, and the state once it is computed.
    by_step: BTreeMap<u64, (usize, Option<State>)>,
}

#[derive(Debug)]
struct State {
    particles: Vec<Particle>,
    keyframe: Keyframe,
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

    /// Puts the state of a step in place.
    pub(super) fn rewind(&mut self, solver: &mut Solver, to_step: u64) -> Result<(), Reason> {
        let Some((use_count, Some(state))) = self.by_step.get_mut(&to_step) else {
            return Err(Reason::OutOfRange);
        };
        solver.put_in_place(&state.particles, &state.keyframe).map_err(|_| Reason::InvalidState)?;
        *use_count -= 1;
        if *use_count == 0 {
            self.by_step.remove(&to_step);
        }
        Ok(())
    }
}
