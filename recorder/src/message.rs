//! One message of a recording, whichever topic it is on.

use sim_contract::ParticleState;

use crate::rows::{EventRow, OutcomeRow, StatusRow, StepRow, SurfaceRow, TearsRow, TopologyRow};
use crate::topic::Topic;

/// One message of a recording. `/tf` is not among them: it is written with the head of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// The constraints.
    Topology(TopologyRow),
    /// The triangles.
    Surface(SurfaceRow),
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

impl Message {
    /// The topic that it belongs to.
    pub fn topic(&self) -> Topic {
        match self {
            Self::Topology(_) => Topic::Topology,
            Self::Surface(_) => Topic::Surface,
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
            Self::Tears(row) => row.step,
            Self::Outcome(row) => row.step,
            Self::Status(row) => row.step,
            Self::Event(row) => row.step,
            Self::Step(row) => row.step,
            Self::Keyframe { step, .. } | Self::Particles { step, .. } => *step,
        }
    }

    /// Roughly the memory that it takes, in bytes.
    pub fn size_bytes(&self) -> usize {
        let behind = match self {
            Self::Topology(row) => row.a.len() * (4 * size_of::<u32>() + size_of::<f32>()),
            Self::Surface(row) => size_of_val(row.triangles.as_slice()),
            Self::Tears(row) => size_of_val(row.constraints.as_slice()),
            Self::Keyframe { bytes, .. } => bytes.len(),
            Self::Particles { particles, .. } => size_of_val(particles.as_slice()),
            Self::Outcome(_) | Self::Status(_) | Self::Event(_) | Self::Step(_) => 0,
        };
        size_of::<Self>() + behind
    }
}
