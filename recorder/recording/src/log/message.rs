//! One message of a recording on any topic, the order of messages, and the memory of those that wait for their snapshot.

use sim_messages::ParticleState;

use super::rows::{
    ColliderRow, CollidersRow, EventRow, ForcesRow, OutcomeRow, ParametersRow, StatusRow, StepRow,
    SurfaceRow, TearsRow, TopologyRow,
};
use super::run::RunDescription;
use super::scanner::limits::SizeLimits;
use super::topic::Topic;

/// One message of a recording. `/tf` is not included, because it belongs to the header of a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// The constraints.
    Topology(TopologyRow),
    /// The triangles.
    Surface(SurfaceRow),
    /// The colliders after a step.
    Colliders(CollidersRow),
    /// The constraints that tore in a step.
    Tears(TearsRow),
    /// The parameters from a step on.
    Parameters(ParametersRow),
    /// The impulses of a step.
    Forces(ForcesRow),
    /// The part of the solver's state after a step that the particles lack.
    Keyframe {
        /// The step of the snapshot that this completes.
        step: u64,
        /// The solver's encoding.
        bytes: Vec<u8>,
    },
    /// The outcome of a command.
    Outcome(OutcomeRow),
    /// The status of the node.
    Status(StatusRow),
    /// A notable event in a step.
    Event(EventRow),
    /// The header of a snapshot.
    Step(StepRow),
    /// The payload of a snapshot.
    Particles {
        /// The state after this step.
        step: u64,
        /// Shape: particle count.
        particles: Vec<ParticleState>,
    },
}

/// Approximate heap size of the name of a cause.
const TEAR_CAUSE_SIZE_BYTES: usize = 32;

impl Message {
    /// Returns the topic of the message.
    pub fn topic(&self) -> Topic {
        match self {
            Self::Topology(_) => Topic::Topology,
            Self::Surface(_) => Topic::Surface,
            Self::Colliders(_) => Topic::Colliders,
            Self::Tears(_) => Topic::Tears,
            Self::Parameters(_) => Topic::Parameters,
            Self::Forces(_) => Topic::Forces,
            Self::Keyframe { .. } => Topic::Keyframe,
            Self::Outcome(_) => Topic::Outcomes,
            Self::Status(_) => Topic::Status,
            Self::Event(_) => Topic::Events,
            Self::Step(_) => Topic::Steps,
            Self::Particles { .. } => Topic::Particles,
        }
    }

    /// Returns the step that the message belongs to.
    pub fn step(&self) -> u64 {
        match self {
            Self::Topology(row) => row.step,
            Self::Surface(row) => row.step,
            Self::Colliders(row) => row.step,
            Self::Tears(row) => row.step,
            Self::Parameters(row) => row.step,
            Self::Forces(row) => row.step,
            Self::Outcome(row) => row.step,
            Self::Status(row) => row.step,
            Self::Event(row) => row.step,
            Self::Step(row) => row.step,
            Self::Keyframe { step, .. } | Self::Particles { step, .. } => *step,
        }
    }

    /// Returns the step whose torn constraints replace all earlier ones, if this is the outcome of a
    /// command that puts a state in place: the initial one, an earlier one, or a given one.
    pub fn replacement_step(&self) -> Option<u64> {
        let Self::Outcome(row) = self else { return None };
        (row.replaces_state() && row.is_applied()).then_some(row.step)
    }

    /// Returns the approximate memory use, in bytes.
    pub fn size_bytes(&self) -> usize {
        let heap_size_bytes = match self {
            Self::Topology(row) => row.size_bytes(),
            Self::Surface(row) => size_of_val(row.triangles.as_slice()),
            Self::Colliders(row) => row.colliders.len() * size_of::<ColliderRow>(),
            Self::Tears(row) => {
                size_of_val(row.constraints.as_slice()) + row.causes.len() * TEAR_CAUSE_SIZE_BYTES
            }
            Self::Forces(row) => row.size_bytes(),
            Self::Keyframe { bytes, .. } => bytes.len(),
            Self::Particles { particles, .. } => size_of_val(particles.as_slice()),
            Self::Outcome(row) => row.status.len() + row.reason.len(),
            Self::Status(row) => row.scene_name.len(),
            Self::Event(row) => row.kind.len() + row.text.len(),
            Self::Parameters(row) => size_of_val(row.values.bending_by_block.as_slice()),
            Self::Step(_) => 0,
        };
        size_of::<Self>() + heap_size_bytes
    }
}

/// The order of the messages of a file: those that describe states are in the order of steps, before the snapshots of their
/// steps.
#[derive(Debug, Default)]
pub(super) struct StepOrder {
    newest_step: u64,
    /// The newest message is a snapshot.
    is_after_snapshot: bool,
}

impl StepOrder {
    /// Continues after the snapshot of a step.
    pub(super) fn after(step: u64) -> Self {
        Self { newest_step: step, is_after_snapshot: true }
    }

    /// Adds the next message. `Err` has the step before it, if it is out of order; then it has no effect.
    pub(super) fn add(&mut self, topic: Topic, step: u64) -> Result<(), u64> {
        if !topic.is_of_state() {
            return Ok(());
        }
        let is_late = step < self.newest_step || step == self.newest_step && self.is_after_snapshot;
        if is_late {
            return Err(self.newest_step);
        }
        *self = Self { newest_step: step, is_after_snapshot: topic == Topic::Particles };
        Ok(())
    }
}

/// The memory of the messages since the last snapshot.
///
/// A reader keeps these messages, so it needs a limit. A recorder that cannot write its snapshots,
/// because its disk stalls, drops messages beyond the same limit. Every file that it writes can be read.
#[derive(Debug)]
pub struct Backlog {
    size_bytes: usize,
    size_bytes_max: usize,
}

impl Backlog {
    /// Begins before the first message of a recording. `scene_size_bytes` is the length of its scene
    /// as text.
    pub fn new(run: &RunDescription, scene_size_bytes: usize) -> Self {
        let size_bytes_max = SizeLimits::new(run, scene_size_bytes).backlog_size_bytes_max();
        Self { size_bytes: 0, size_bytes_max }
    }

    /// Returns the most memory that messages without a snapshot may take.
    pub fn size_bytes_max(&self) -> usize {
        self.size_bytes_max
    }

    /// Returns `true` if a recorder may write the message now. Keyframes leave half of the memory to
    /// other messages: the next keyframe replaces a lost one, but nothing replaces a lost outcome.
    pub fn has_room_for(&self, message: &Message) -> bool {
        let is_keyframe = message.topic() == Topic::Keyframe;
        let limit = if is_keyframe { self.size_bytes_max / 2 } else { self.size_bytes_max };
        self.size_bytes + message.size_bytes() <= limit
    }

    /// Adds a message. Returns `false`, and adds nothing, if the messages would take more memory than
    /// they may.
    #[must_use]
    pub fn add(&mut self, message: &Message) -> bool {
        let size_bytes = message.size_bytes();
        if self.size_bytes.saturating_add(size_bytes) > self.size_bytes_max {
            return false;
        }
        self.size_bytes += size_bytes;
        true
    }

    /// Removes the messages, which a snapshot follows.
    pub fn clear(&mut self) {
        self.size_bytes = 0;
    }
}
