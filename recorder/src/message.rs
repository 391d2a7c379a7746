//! One message of a recording, whichever topic it is on.

use sim_contract::{Action, ParticleState};

use crate::collider_rows::{ColliderRow, CollidersRow};
use crate::rows::{EventRow, OutcomeRow, StatusRow, StepRow, SurfaceRow, TearsRow, TopologyRow};
use crate::topic::Topic;

/// One message of a recording. `/tf` is not among them: it is written with the head of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// The constraints.
    Topology(TopologyRow),
    /// The triangles.
    Surface(SurfaceRow),
    /// The colliders after a step.
    Colliders(CollidersRow),
    /// What tore in a step.
    Tears(TearsRow),
    /// What particles lack of the solver's state after a step.
    Keyframe {
        /// The step whose snapshot this completes.
        step: u64,
        /// As the solver encodes it.
        bytes: Vec<u8>,
    },
    /// What became of a command.
    Outcome(OutcomeRow),
    /// How the node was doing.
    Status(StatusRow),
    /// Something remarkable in a step.
    Event(EventRow),
    /// The header of a snapshot.
    Step(StepRow),
    /// The payload of a snapshot.
    Particles {
        /// The step that this is the state after.
        step: u64,
        /// Shape: particle count.
        particles: Vec<ParticleState>,
    },
}

/// Roughly what the name of a cause takes.
const TEAR_CAUSE_SIZE_BYTES: usize = 32;

impl Message {
    /// The topic that it belongs to.
    pub fn topic(&self) -> Topic {
        match self {
            Self::Topology(_) => Topic::Topology,
            Self::Surface(_) => Topic::Surface,
            Self::Colliders(_) => Topic::Colliders,
            Self::Tears(_) => Topic::Tears,
            Self::Keyframe { .. } => Topic::Keyframe,
            Self::Outcome(_) => Topic::Outcomes,
            Self::Status(_) => Topic::Status,
            Self::Event(_) => Topic::Events,
            Self::Step(_) => Topic::Steps,
            Self::Particles { .. } => Topic::Particles,
        }
    }

    /// The step that it belongs to.
    pub fn step(&self) -> u64 {
        match self {
            Self::Topology(row) => row.step,
            Self::Surface(row) => row.step,
            Self::Colliders(row) => row.step,
            Self::Tears(row) => row.step,
            Self::Outcome(row) => row.step,
            Self::Status(row) => row.step,
            Self::Event(row) => row.step,
            Self::Step(row) => row.step,
            Self::Keyframe { step, .. } | Self::Particles { step, .. } => *step,
        }
    }

    /// The step that begins anew from the initial state, if this is the outcome of a reset.
    pub fn reset_step(&self) -> Option<u64> {
        let Self::Outcome(row) = self else { return None };
        (row.action == Action::Reset && row.is_applied()).then_some(row.step)
    }

    /// Roughly the memory that it takes, in bytes.
    pub fn size_bytes(&self) -> usize {
        let behind = match self {
            Self::Topology(row) => row.a.len() * (4 * size_of::<u32>() + size_of::<f32>()),
            Self::Surface(row) => size_of_val(row.triangles.as_slice()),
            Self::Colliders(row) => row.colliders.len() * size_of::<ColliderRow>(),
            Self::Tears(row) => row.constraints.len() * (size_of::<u32>() + TEAR_CAUSE_SIZE_BYTES),
            Self::Keyframe { bytes, .. } => bytes.len(),
            Self::Particles { particles, .. } => size_of_val(particles.as_slice()),
            Self::Outcome(_) | Self::Status(_) | Self::Event(_) | Self::Step(_) => 0,
        };
        size_of::<Self>() + behind
    }
}
