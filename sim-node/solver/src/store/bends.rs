//! Where the bends of a scene are, and which of them have stopped.

use super::layout::Location;
use crate::constraints::bends::paths::BendPaths;
use crate::scene::model::Model;

/// The bends of a store. Arrays are by bend.
#[derive(Debug, Clone, Default)]
pub(crate) struct StoredBends {
    pub(crate) locations: Vec<Location>,
    pub(crate) paths: BendPaths,
    /// Number of torn constraints in the path. A bend acts while it is 0.
    torn_counts: Vec<u32>,
}

impl StoredBends {
    pub(crate) fn new(model: &Model) -> Self {
        let count = model.bends.len();
        Self {
            locations: vec![Location::default(); count],
            paths: BendPaths::new(&model.constraints, &model.bends),
            torn_counts: vec![0; count],
        }
    }

    /// True if no constraint of the bend's path is torn.
    pub(crate) fn is_active(&self, bend: u32) -> bool {
        self.torn_counts[bend as usize] == 0
    }

    /// Counts a constraint of the bend's path that has torn, or that is no longer torn.
    pub(crate) fn count_torn(&mut self, bend: u32, is_torn: bool) {
        let count = &mut self.torn_counts[bend as usize];
        *count = if is_torn { *count + 1 } else { *count - 1 };
    }
}
