//! Where the bends of a scene are stored, and which of them have no effect because of tears.

use sim_scene::constraints::sides::TornSides;
use sim_scene::model::Model;

use super::layout::Location;

/// The bends of a store.
#[derive(Debug, Clone, Default)]
pub(crate) struct StoredBends {
    /// By bend.
    pub(crate) locations: Vec<Location>,
    /// The sides of the paths of bends. A bend with a torn side has no effect.
    pub(crate) sides: TornSides,
}

impl StoredBends {
    pub(crate) fn new(model: &Model) -> Self {
        Self { locations: vec![Location::default(); model.bends.len()], sides: model.bend_sides() }
    }
}
