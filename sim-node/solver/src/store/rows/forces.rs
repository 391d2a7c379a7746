//! Forces of the particles of rows on colliders and fixed particles.

use super::particles::TetherPulls;
use crate::store::pulls::Pulls;

/// The forces of rows. Empty while nobody asks for them.
#[derive(Debug, Clone, Default)]
pub(crate) struct RowForces {
    pub(crate) is_measured: bool,
    pub(crate) pulls: Pulls,
    /// By row, tether and eight columns: the displacements that tethers have taken in this step.
    pub(crate) tether_pulls: Vec<TetherPulls>,
    /// Number of tether pulls of a row.
    pub(crate) tether_length: usize,
    /// By row, tether and eight columns: index of the root among the fixed particles.
    pub(super) tether_receivers: Vec<[Option<u32>; 8]>,
}
