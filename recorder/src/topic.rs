//! The topics of a recording.

/// One topic, in the order in which a node publishes them within a step (and a file holds them).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Topic {
    /// foxglove.FrameTransform: where the scene's origin is. Once, at the head.
    Tf,
    /// [`crate::TopologyRow`]: the constraints. Once a file.
    Topology,
    /// [`crate::SurfaceRow`]: the triangles. Once a file.
    Surface,
    /// [`crate::CollidersRow`]: where colliders are, at first and when it changes.
    Colliders,
    /// [`crate::TearsRow`]: only for steps in which something tore.
    Tears,
    /// What particles lack of the solver's state, as the solver encodes it.
    Keyframe,
    /// [`crate::OutcomeRow`]: every command that was taken, in order of application.
    Outcomes,
    /// [`crate::StatusRow`]: how the node was doing.
    Status,
    /// [`crate::EventRow`]: remarkable steps.
    Events,
    /// [`crate::StepRow`]: one for each recorded snapshot.
    Steps,
    /// foxglove.PointCloud: the snapshots, their bytes unchanged.
    Particles,
}

impl Topic {
    /// Every topic, in order.
    pub const ALL: [Self; 11] = [
        Self::Tf,
        Self::Topology,
        Self::Surface,
        Self::Colliders,
        Self::Tears,
        Self::Keyframe,
        Self::Outcomes,
        Self::Status,
        Self::Events,
        Self::Steps,
        Self::Particles,
    ];

    /// Its name in the file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tf => "/tf",
            Self::Topology => "/topology",
            Self::Surface => "/surface",
            Self::Colliders => "/colliders",
            Self::Tears => "/tears",
            Self::Keyframe => "/keyframe",
            Self::Outcomes => "/outcomes",
            Self::Status => "/status",
            Self::Events => "/events",
            Self::Steps => "/steps",
            Self::Particles => "/particles",
        }
    }

    /// The topic of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|topic| topic.name() == name)
    }

    /// Its place in [`Topic::ALL`].
    pub fn index(self) -> usize {
        self as usize
    }
}

/// What happened to the messages of one topic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct TopicCounts {
    /// Messages that reached the recorder.
    pub received: u64,
    /// Messages that are in the file.
    pub written: u64,
    /// Messages that reached the recorder and are not in the file: its queue was full.
    pub lost: u64,
    /// Messages that never reached the recorder, as their numbering shows.
    pub gaps: u64,
}

/// [`TopicCounts`] of every topic.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct AllCounts([TopicCounts; Topic::ALL.len()]);

impl AllCounts {
    /// The counts of one topic.
    pub fn of(&self, topic: Topic) -> &TopicCounts {
        &self.0[topic.index()]
    }

    /// The counts of one topic, to change.
    pub fn of_mut(&mut self, topic: Topic) -> &mut TopicCounts {
        &mut self.0[topic.index()]
    }

    /// Every topic with its counts, in order.
    pub fn iter(&self) -> impl Iterator<Item = (Topic, &TopicCounts)> {
        Topic::ALL.into_iter().zip(&self.0)
    }

    /// Says of every message in the file that it was received, as where nothing can be lost.
    pub fn set_received_to_written(&mut self) {
        for counts in &mut self.0 {
            counts.received = counts.written;
        }
    }

    /// Takes over what was written; the rest stays.
    pub fn set_written(&mut self, written: &Self) {
        for (counts, other) in self.0.iter_mut().zip(&written.0) {
            counts.written = other.written;
        }
    }

    /// Takes over what was lost; the rest stays.
    pub fn set_lost(&mut self, lost: &Self) {
        for (counts, other) in self.0.iter_mut().zip(&lost.0) {
            counts.lost = other.lost;
        }
    }

    /// Messages that should be in the file and are not, of all topics.
    pub fn missing(&self) -> u64 {
        self.0.iter().map(|counts| counts.lost + counts.gaps).sum()
    }
}
