//! The straight paths that the particles take in a step, to tell whether one has left its own.

use crate::kernels::lanes::{LaneWork, PackedParticle, Wide, axes};

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
    /// Square of the distance.
    pub(crate) limit: f32,
}

impl Progress {
    /// Returns the lanes of the particles that are beside their paths.
    #[inline(always)]
    pub(super) fn beside<W: Wide>(
        self,
        [x, d]: [[W; 3]; 2],
        [saved_x, saved_d]: [[W; 3]; 2],
    ) -> W::Mask {
        let count = W::splat(self.count);
        let off = axes(|axis| (x[axis] - saved_x[axis]) + (d[axis] - count * saved_d[axis]));
        let [x, y, z] = axes(|axis| off[axis] * off[axis]);
        W::splat(self.limit).is_below(x + y + z)
    }
}

/// Sets the bits of the slots of the lanes whose bits are set. `strays` has one for each of sixteen slots.
#[inline(always)]
pub(super) fn mark_strays(mut lanes: u32, slots: &[u32; 8], strays: &mut [u16]) {
    while lanes != 0 {
        let slot = slots[lanes.trailing_zeros() as usize];
        if let Some(strays) = strays.get_mut((slot / u16::BITS) as usize) {
            *strays |= 1 << (slot % u16::BITS);
        }
        lanes &= lanes - 1;
    }
}

/// Compares the particles of the graph with their paths.
pub(super) struct GraphWork<'a> {
    pub(super) now: &'a [PackedParticle],
    pub(super) saved: &'a [PackedParticle],
    pub(super) slots: &'a [u32],
    pub(super) progress: Progress,
    pub(super) strays: &'a mut [u16],
}

impl LaneWork for GraphWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { now, saved, slots, progress, strays } = self;
        let (now, now_rest) = now.as_chunks();
        let (saved, saved_rest) = saved.as_chunks();
        let (slots, slots_rest) = slots.as_chunks();
        for ((now, saved), slots) in now.iter().zip(saved).zip(slots) {
            mark_strays(beside::<W>(now, saved, progress), slots, strays);
        }
        let mut last = [[PackedParticle::default(); 8]; 2];
        last[0][..now_rest.len()].copy_from_slice(now_rest);
        last[1][..saved_rest.len()].copy_from_slice(saved_rest);
        let mut last_slots = [NO_SLOT; 8];
        last_slots[..slots_rest.len()].copy_from_slice(slots_rest);
        mark_strays(beside::<W>(&last[0], &last[1], progress), &last_slots, strays);
    }
}

/// Returns a bit for each particle that is beside its path.
#[inline(always)]
fn beside<W: Wide>(
    now: &[PackedParticle; 8],
    saved: &[PackedParticle; 8],
    progress: Progress,
) -> u32 {
    let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(now);
    let now = [[x, y, z], [dx, dy, dz]];
    let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(saved);
    W::bits(progress.beside(now, [[x, y, z], [dx, dy, dz]]))
}
