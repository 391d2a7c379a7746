//! The messages of all services except `particles`.

use sim_types::ParameterValues;

use crate::collider::{ColliderState, CollidersHeader};
use crate::command::Outcome;
use crate::forces::{ForceRow, ForcesHeader};
use crate::parameters::ParametersHeader;
use crate::status::NodeStatus;
use crate::tears::{TearsHeader, TornConstraint};
use crate::topology::{BendState, ConstraintState, KeyframeHeader, LoadHeader, Triangle};

/// A message of any service except `particles`, in shared memory.
#[derive(Debug, Clone, Copy)]
pub enum Update<'a> {
    /// The scene of a load, as TOML.
    Scene(&'a LoadHeader, &'a [u8]),
    /// The constraints of a load.
    Topology(&'a LoadHeader, &'a [ConstraintState]),
    /// The bends of a load; may be empty.
    Bends(&'a LoadHeader, &'a [BendState]),
    /// The triangles of a load; may be empty.
    Surface(&'a LoadHeader, &'a [Triangle]),
    /// All colliders, in their poses at the end of a step.
    Colliders(&'a CollidersHeader, &'a [ColliderState]),
    /// All torn constraints.
    Tears(&'a TearsHeader, &'a [TornConstraint]),
    /// The values of all parameters.
    Parameters(&'a ParametersHeader, &'a ParameterValues),
    /// The impulses of a step. Only for a tap that reads them.
    Forces(&'a ForcesHeader, &'a [ForceRow]),
    /// The keyframe that completes a snapshot.
    Keyframe(&'a KeyframeHeader, &'a [u8]),
    /// The outcome of a command.
    Outcome(&'a Outcome),
    /// The status of the node.
    Status(&'a NodeStatus),
}
