//! The straight paths that the particles take in a step, to tell whether one has left its own.

use crate::kernels::lanes::{PackedParticle, Wide, axes};

/// Where the path of every particle begins, its displacement in a substep, and its slot.
#[derive(Debug, Clone, Default)]
pub(crate) struct Paths {
    /// By rows of the store.
    pub(super) in_rows: Vec<Vec<f32>>,
    pub(super) graph: Vec<PackedParticle>,
    /// The slot of every particle, in the same order.
    pub(super) slots_in_rows: Vec<Vec<u32>>,
    pub(super) slots_of_graph: Vec<u32>,
}

/// The slot of a particle without contacts. It is beyond all slots, so its path is compared but not noted.
pub(super) const NO_SLOT: u32 = u32::MAX;

/// The elapsed part of the paths, and how far a particle may be beside its own.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress {
    /// Number of displacements.
    pub(crate) count: f32,
    /// Square of the distance from which a particle is a stray.
    pub(crate) limit: f32,
    /// Square of the distance that no particle may exceed.
    pub(crate) limit_max: f32,
}

impl Progress {
    /// Squares of the distances of eight particles from their paths.
    #[inline(always)]
    pub(super) fn squares<W: Wide>(
        self,
        [x, d]: [[W; 3]; 2],
        [saved_x, saved_d]: [[W; 3]; 2],
    ) -> W {
        let count = W::splat(self.count);
        let off = axes(|axis| (x[axis] - saved_x[axis]) + (d[axis] - count * saved_d[axis]));
        let [x, y, z] = axes(|axis| off[axis] * off[axis]);
        x + y + z
    }

    /// Sets the bits of the slots of strays: entry i of `strays` has those of the slots 16 i to 16 i + 15. Returns true if
    /// one of the particles is too far from its path.
    #[inline(always)]
    pub(super) fn mark_strays<W: Wide>(
        self,
        squares: W,
        slots: &[u32; 8],
        strays: &mut [u16],
    ) -> bool {
        let mut lanes = W::bits(W::splat(self.limit).is_below(squares));
        if lanes == 0 {
            return false;
        }
        let (too_far, mut is_one_too_far) = (W::splat(self.limit_max).is_below(squares), false);
        let too_far = W::bits(too_far);
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            let slot = slots[lane as usize];
            if let Some(strays) = strays.get_mut((slot / u16::BITS) as usize) {
                *strays |= 1 << (slot % u16::BITS);
                is_one_too_far |= too_far & (1 << lane) != 0;
            }
            lanes &= lanes - 1;
        }
        is_one_too_far
    }
}
