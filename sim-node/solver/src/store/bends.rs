//! Where the bends of a scene are, and which of them have stopped.

use super::layout::Location;
use crate::constraints::sides::TornSides;
use crate::scene::model::Model;

/// The bends of a store.
#[derive(Debug, Clone, Default)]
pub(crate) struct StoredBends {
    /// By bend.
    pub(crate) locations: Vec<Location>,
    /// The sides of their paths. A bend acts while none of them is torn.
    pub(crate) sides: TornSides,
}

impl StoredBends {
    pub(crate) fn new(model: &Model) -> Self {
        Self { locations: vec![Location::default(); model.bends.len()], sides: model.bend_sides() }
    }
}
