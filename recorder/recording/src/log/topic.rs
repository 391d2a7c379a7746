//! The topics of a recording, and the message counts of each.

use std::ops::{Index, IndexMut};

/// A topic. The order is the one of the messages of a step in a file: commands act before the step, and the snapshot is its
/// result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Topic {
    /// foxglove.FrameTransform: the scene's origin and its turn to z up. One message per file.
    Tf,
    /// [`crate::TopologyRow`]: the constraints. One message per file.
    Topology,
    /// [`crate::SurfaceRow`]: the triangles. One message per file.
    Surface,
    /// [`crate::OutcomeRow`]: every answered command, in order of application.
    Outcomes,
    /// [`crate::CollidersRow`]: the colliders at the start and after each change.
    Colliders,
    /// [`crate::TearsRow`]: new tears. Only steps in which a constraint tore have a message.
    Tears,
    /// [`crate::ParametersRow`]: all parameters at the start and after each change.
    Parameters,
    /// [`crate::ForcesRow`]: the impulses of each step, where they were asked for.
    Forces,
    /// catenary.Keyframe: the part of the solver's state that the particles lack, in its encoding.
    Keyframe,
    /// [`crate::StatusRow`]: the status of the node.
    Status,
    /// [`crate::EventRow`]: notable events.
    Events,
    /// [`crate::StepRow`]: one message per recorded snapshot.
    Steps,
    /// foxglove.PointCloud: the snapshots, with their bytes unchanged.
    Particles,
}

impl Topic {
    /// All topics, in order.
    pub const ALL: [Self; 13] = [
        Self::Tf,
        Self::Topology,
        Self::Surface,
        Self::Outcomes,
        Self::Colliders,
        Self::Tears,
        Self::Parameters,
        Self::Forces,
        Self::Keyframe,
        Self::Status,
        Self::Events,
        Self::Steps,
        Self::Particles,
    ];

    /// Returns the name of the topic in a file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tf => "/tf",
            Self::Topology => "/topology",
            Self::Surface => "/surface",
            Self::Colliders => "/colliders",
            Self::Tears => "/tears",
            Self::Parameters => "/parameters",
            Self::Forces => "/forces",
            Self::Keyframe => "/keyframe",
            Self::Outcomes => "/outcomes",
            Self::Status => "/status",
            Self::Events => "/events",
            Self::Steps => "/steps",
            Self::Particles => "/particles",
        }
    }

    /// Returns the topic with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }

    /// Returns `true` for a topic whose messages describe the state of their step. They are in the order of steps, before
    /// the snapshot of their step.
    pub fn is_of_state(self) -> bool {
        matches!(
            self,
            Self::Outcomes
                | Self::Colliders
                | Self::Tears
                | Self::Parameters
                | Self::Forces
                | Self::Keyframe
                | Self::Steps
                | Self::Particles
        )
    }

    /// Returns the position of the topic in [`Topic::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }
}

/// Message counts of one topic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TopicCounts {
    /// Messages that reached the recorder.
    pub received: u64,
    /// Messages in the file.
    pub written: u64,
    /// Messages that reached the recorder but not the file, because its queue was full.
    pub lost: u64,
    /// Messages that reached the recorder and were left out on purpose.
    pub left_out: u64,
    /// Messages that never reached the recorder, as gaps in their numbering show.
    pub gaps: u64,
}

/// [`TopicCounts`] of every topic, indexed by [`Topic`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AllCounts([TopicCounts; Topic::ALL.len()]);

impl Index<Topic> for AllCounts {
    type Output = TopicCounts;

    fn index(&self, topic: Topic) -> &TopicCounts {
        &self.0[topic.index()]
    }
}

impl IndexMut<Topic> for AllCounts {
    fn index_mut(&mut self, topic: Topic) -> &mut TopicCounts {
        &mut self.0[topic.index()]
    }
}

impl AllCounts {
    /// Returns every topic with its counts, in order.
    pub fn iter(&self) -> impl Iterator<Item = (Topic, &TopicCounts)> {
        Topic::ALL.into_iter().zip(&self.0)
    }

    /// Sets `received` to `written` in every topic, for a writer that cannot lose messages.
    pub fn set_received_to_written(&mut self) {
        for counts in &mut self.0 {
            counts.received = counts.written;
        }
    }

    /// Adds the counts of another file.
    pub fn add(&mut self, other: &Self) {
        for (counts, other) in self.0.iter_mut().zip(&other.0) {
            counts.received += other.received;
            counts.written += other.written;
            counts.lost += other.lost;
            counts.left_out += other.left_out;
            counts.gaps += other.gaps;
        }
    }

    /// Copies `written` from other counts. A writer makes `/tf` itself, so that counts as received.
    pub fn set_written(&mut self, written: &Self) {
        for (counts, other) in self.0.iter_mut().zip(&written.0) {
            counts.written = other.written;
        }
        self[Topic::Tf].received = written[Topic::Tf].written;
    }

    /// Copies `left_out` from other counts.
    pub fn set_left_out(&mut self, left_out: &Self) {
        for (counts, other) in self.0.iter_mut().zip(&left_out.0) {
            counts.left_out = other.left_out;
        }
    }

    /// Copies `lost` from other counts.
    pub fn set_lost(&mut self, lost: &Self) {
        for (counts, other) in self.0.iter_mut().zip(&lost.0) {
            counts.lost = other.lost;
        }
    }
}
