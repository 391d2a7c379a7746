//! Intermediate results of a projection of bends, in blocks of lane groups.

use super::projection::BendProjection;
use crate::constraints::projection::LaneIndex;
use crate::kernels::lanes::{Lanes8, Wide, axes};

/// Lane groups of a block.
pub(crate) const BEND_BLOCK_LENGTH: usize = 16;

/// Bends of a run that are projected together: in three short loops, for the reason that
/// [`crate::constraints::projection_block::ProjectionBlock`] gives.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(crate) struct BendBlock {
    /// C, and then `delta_Lambda`.
    vectors: [[Lanes8; BEND_BLOCK_LENGTH]; 3],
    weights: [Lanes8; BEND_BLOCK_LENGTH],
}

impl Default for BendBlock {
    fn default() -> Self {
        let zeros = [[0.0; 8]; BEND_BLOCK_LENGTH];
        Self { vectors: [zeros; 3], weights: zeros }
    }
}

impl BendBlock {
    /// Sets C and the sum of w c^2 of lane group `group` of the block.
    #[inline(always)]
    pub(crate) fn set<W: Wide>(&mut self, group: usize, value: [W; 3], weight: W) {
        for (axis, along) in value.into_iter().enumerate() {
            along.store(&mut self.vectors[axis][group], 0);
        }
        weight.store(&mut self.weights[group], 0);
    }

    /// Computes the changes of the first `count` lane groups of the block, of which the first one is `first`
    /// of the run.
    #[inline(always)]
    pub(crate) fn solve<W: Wide>(
        &mut self,
        projection: &mut BendProjection<'_>,
        first: usize,
        count: usize,
    ) {
        for group in 0..count {
            let weight = W::load(&self.weights[group], 0);
            let index = LaneIndex { group: first + group, lane: 0 };
            let change = projection.change(index, self.vector::<W>(group), weight);
            self.set(group, change, weight);
        }
    }

    /// `delta_Lambda` of lane group `group` of the block.
    #[inline(always)]
    pub(crate) fn vector<W: Wide>(&self, group: usize) -> [W; 3] {
        axes(|axis| W::load(&self.vectors[axis][group], 0))
    }
}
