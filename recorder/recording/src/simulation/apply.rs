//! Applies actions to a solver without a node, in `simulate` and `verify`.

use sim_contract::{Action, Reason};
use sim_solver::{Applied, Control, Solver};

/// Applies an action at the boundary before a step. `pause`, `resume` and `step` have no effect
/// here. `load` is rejected, because a recording has one scene. The caller has the states of `rewind` and
/// `restore`; here they are rejected.
///
/// # Errors
/// The action is rejected and changes nothing.
pub fn apply(solver: &mut Solver, client_id: u64, action: &Action) -> Result<Applied, Reason> {
    match solver.apply(client_id, action)? {
        Applied::Control(Control::Load { .. } | Control::Rewind { .. } | Control::Restore) => {
            Err(Reason::NoEffectHere)
        }
        applied => Ok(applied),
    }
}
