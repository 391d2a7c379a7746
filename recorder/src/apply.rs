//! From an action to what the solver does. A running node has its own: there, pause and step stop
//! and start it.

use sim_contract::{Action, Reason};
use sim_solver::{Grip, Rejection, Solver};

/// Applies an action at the boundary before a step. A rejected one changes nothing.
pub(crate) fn apply(solver: &mut Solver, client_id: u64, action: Action) -> Result<(), Reason> {
    match action {
        Action::Pin { particle } => solver.pin(particle),
        Action::Unpin { particle } => solver.unpin(particle),
        Action::Grab { particle, target, over_s } => {
            solver.grab(client_id, Grip { particle, target, over_s })
        }
        Action::Move { particle, target, over_s } => {
            solver.move_grabbed(client_id, Grip { particle, target, over_s })
        }
        Action::Release { particle } => solver.release(client_id, particle),
        Action::Reset => {
            solver.reset();
            Ok(())
        }
        _ if is_control(action) => Ok(()),
        // A kind of another version.
        _ => return Err(Reason::NoEffectHere),
    }
    .map_err(reason)
}

/// Whether the action only says when steps are made, and nothing about the state.
pub(crate) fn is_control(action: Action) -> bool {
    matches!(action, Action::Pause | Action::Resume | Action::Step { .. })
}

fn reason(rejection: Rejection) -> Reason {
    Reason::from_name(rejection.name()).unwrap_or(Reason::NoEffectHere)
}
