//! Intermediate results of a projection, in blocks of lane groups.

use super::projection::{LaneIndex, Projection};
use super::separation::{Correction, Separation, SquaredLength, correction};
use crate::kernels::lanes::{Lanes8, Wide, axes};

/// Lane groups of a block.
pub(crate) const BLOCK_LENGTH: usize = 16;

/// Separations and scales of the constraints of a run that are projected together.
///
/// A projection is one long dependency chain, from the positions through a root and a division to
/// the displacements, and the processor's registers hold less than two of them. Three short loops
/// over a block overlap many chains, which halves the time.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct ProjectionBlock {
    vectors: [[Lanes8; BLOCK_LENGTH]; 3],
    base: [Lanes8; BLOCK_LENGTH],
    change: [Lanes8; BLOCK_LENGTH],
    scales: [Lanes8; BLOCK_LENGTH],
}

impl Default for ProjectionBlock {
    fn default() -> Self {
        let zeros = [[0.0; 8]; BLOCK_LENGTH];
        Self { vectors: [zeros; 3], base: zeros, change: zeros, scales: zeros }
    }
}

impl ProjectionBlock {
    #[inline(always)]
    pub(crate) fn set_separation<W: Wide>(&mut self, group: usize, separation: &Separation<W>) {
        for (axis, along) in separation.vector.into_iter().enumerate() {
            along.store(&mut self.vectors[axis][group], 0);
        }
        separation.squared.base.store(&mut self.base[group], 0);
        separation.squared.change.store(&mut self.change[group], 0);
    }

    /// Computes the scales of lane group `group` of the block, which is `index` of the run.
    #[inline(always)]
    pub(crate) fn solve<W: Wide>(
        &mut self,
        group: usize,
        projection: &mut impl Projection,
        index: LaneIndex,
        weight: W,
    ) {
        let (base, change) = (W::load(&self.base[group], 0), W::load(&self.change[group], 0));
        let squared = SquaredLength { base, change };
        projection.scale(index, &squared, weight).store(&mut self.scales[group], 0);
    }

    /// Corrections of lane group `group` of the block.
    #[inline(always)]
    pub(crate) fn correction<W: Wide>(&self, group: usize) -> Correction<W> {
        let vector = axes(|axis| W::load(&self.vectors[axis][group], 0));
        correction(vector, W::load(&self.scales[group], 0))
    }
}
