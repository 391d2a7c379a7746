//! The load of a file whose first chunk is lost: what the rest of the file tells of it.

use sim_solver::Keyframe;

use crate::log::message::Message;
use crate::log::rows::{StepRow, SurfaceRow, TopologyRow};

/// The part of a lost load that does not follow from the scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LostLoad {
    /// Step of the first snapshot.
    pub step: u64,
    /// Number of scene loads in this run, minus one.
    pub revision: u32,
    /// The constraints that were torn before the first snapshot, in the order of tearing.
    pub torn: Vec<u32>,
}

/// The rows of a load.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadRows {
    /// The constraints.
    pub topology: TopologyRow,
    /// The triangles.
    pub surface: SurfaceRow,
}

impl LoadRows {
    /// Returns the messages of the load.
    pub(super) fn messages(&self) -> [Message; 2] {
        [Message::Topology(self.topology.clone()), Message::Surface(self.surface.clone())]
    }
}

/// Watches the messages of a file for its load, and for the torn constraints at its first snapshot.
#[derive(Debug, Default)]
pub(super) struct LoadWatch {
    /// The first chunk is lost, and the output declares its channels again.
    pub(super) is_start_lost: bool,
    has_topology: bool,
    /// The newest keyframe before the first snapshot.
    keyframe: Option<(u64, Vec<u32>)>,
    /// The newest tears before the first snapshot: their step and their number.
    tears: Option<(u64, usize)>,
    first: Option<StepRow>,
    /// The torn constraints before the first snapshot, once they are known.
    torn: Option<Vec<u32>>,
    /// The torn constraints of later states do not continue those of the first one.
    is_broken: bool,
}

impl LoadWatch {
    /// Processes the next sound message.
    pub(super) fn process(&mut self, message: &Message) {
        if self.has_topology || self.torn.is_some() {
            return;
        }
        match message {
            Message::Topology(_) => self.has_topology = true,
            Message::Tears(row) if self.first.is_none() => {
                self.tears = Some((row.step, row.constraints.len()));
            }
            Message::Keyframe { step, bytes } => {
                // The check of the message has decoded it before.
                let Ok(keyframe) = Keyframe::decode(bytes) else { return };
                self.keyframe = Some((*step, keyframe.torn().to_vec()));
                self.find_torn();
            }
            Message::Step(row) if self.first.is_none() => {
                self.first = Some(*row);
                self.find_torn();
            }
            message if self.first.is_some() => {
                self.is_broken |= message.replacement_step().is_some();
            }
            _ => {}
        }
    }

    /// Marks a part of the file as missing: a state may have been put in place there.
    pub(super) fn mark_gap(&mut self) {
        self.is_broken |= self.first.is_some();
    }

    /// Takes the torn constraints from the first keyframe that is not older than the first snapshot. They
    /// are in the order of tearing, so those of the snapshot come first.
    fn find_torn(&mut self) {
        let Some(first) = &self.first else { return };
        let own_count = self.tears.filter(|(step, _)| *step == first.step).map_or(0, |one| one.1);
        let count = (first.torn_count as usize).saturating_sub(own_count);
        let is_later = |(step, _): &&(u64, Vec<u32>)| *step >= first.step;
        self.torn = match self.keyframe.as_ref().filter(is_later) {
            _ if count == 0 => Some(Vec::new()),
            Some((step, torn)) if *step == first.step || !self.is_broken => {
                torn.get(..count).map(<[u32]>::to_vec)
            }
            _ => None,
        };
    }

    /// Returns what is known of the load, if the file has none and everything is known.
    pub(super) fn lost(&self) -> Option<LostLoad> {
        let (step, revision) = self.first.map(|row| (row.step, row.topology_revision))?;
        let torn = self.torn.clone().filter(|_| self.is_start_lost && !self.has_topology)?;
        Some(LostLoad { step, revision, torn })
    }
}
