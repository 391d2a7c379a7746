//! The straight paths that the particles take in a step, to tell whether one has left its own.

use std::iter;

use super::rows::ComparedRows;
use super::workers::Workers;
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

/// Fewest particles that a worker compares with their paths.
pub(super) const COMPARED_MIN: usize = 1024;

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

/// Particles of the graph with their paths.
#[derive(Clone, Copy)]
pub(super) struct ComparedGraph<'a> {
    pub(super) now: &'a [PackedParticle],
    pub(super) saved: &'a [PackedParticle],
    pub(super) slots: &'a [u32],
}

impl<'a> ComparedGraph<'a> {
    /// Divides the particles into parts of this length.
    pub(super) fn chunks(self, length: usize) -> impl ExactSizeIterator<Item = Self> + use<'a> {
        let length = length.next_multiple_of(8);
        let paths = self.saved.chunks(length).zip(self.slots.chunks(length));
        self.now.chunks(length).zip(paths).map(|(now, (saved, slots))| Self { now, saved, slots })
    }

    /// Marks the particles that are beside their paths. Returns true if one is too far.
    #[inline(always)]
    fn mark_strays<W: Wide>(self, progress: Progress, strays: &mut [u16]) -> bool {
        let (now, now_rest) = self.now.as_chunks();
        let (saved, saved_rest) = self.saved.as_chunks();
        let (slots, slots_rest) = self.slots.as_chunks();
        let mut is_one_too_far = false;
        for ((now, saved), slots) in now.iter().zip(saved).zip(slots) {
            let squares = squares::<W>(now, saved, progress);
            is_one_too_far |= progress.mark_strays(squares, slots, strays);
        }
        let mut last = [[PackedParticle::default(); 8]; 2];
        last[0][..now_rest.len()].copy_from_slice(now_rest);
        last[1][..saved_rest.len()].copy_from_slice(saved_rest);
        let mut last_slots = [NO_SLOT; 8];
        last_slots[..slots_rest.len()].copy_from_slice(slots_rest);
        let squares = squares::<W>(&last[0], &last[1], progress);
        is_one_too_far | progress.mark_strays(squares, &last_slots, strays)
    }
}

/// The marks of strays: entry i has the bits of the slots 16 i to 16 i + 15.
pub(crate) struct StrayMarks<'a> {
    pub(crate) all: &'a mut [u16],
    /// By worker, without the first: its own marks. No bit is set before and after.
    pub(crate) of_others: &'a mut [Vec<u16>],
}

impl StrayMarks<'_> {
    /// Compares parts of the particles with their paths, each by one worker. Returns true if one is too far from its own.
    pub(super) fn mark<'p>(
        &mut self,
        workers: &mut Workers,
        progress: Progress,
        parts: impl ExactSizeIterator<Item = Compared<'p>>,
    ) -> bool {
        assert!(parts.len() <= 1 + self.of_others.len(), "a worker has no marks");
        let kernels = workers.kernels;
        let of_others = self.of_others.iter_mut().map(Vec::as_mut_slice);
        let marks = iter::once(&mut *self.all).chain(of_others);
        let parts = parts.zip(marks).map(|(compared, strays)| (compared, strays, false));
        let mut is_one_too_far = false;
        workers.for_each(
            parts,
            |(compared, strays, is_too_far), _| {
                *is_too_far = kernels.run(StrayWork { compared: *compared, progress, strays });
            },
            |(_, _, is_too_far)| is_one_too_far |= is_too_far,
        );
        is_one_too_far
    }

    /// Moves the marks of the others to the first ones.
    pub(super) fn merge(self) {
        for marks in self.of_others {
            for (all, mark) in self.all.iter_mut().zip(marks) {
                *all |= std::mem::take(mark);
            }
        }
    }
}

/// Compares particles with their paths. The output is true if one is too far from its own.
struct StrayWork<'a> {
    compared: Compared<'a>,
    progress: Progress,
    strays: &'a mut [u16],
}

/// Particles with their paths.
#[derive(Clone, Copy)]
pub(super) enum Compared<'a> {
    Graph(ComparedGraph<'a>),
    Rows(ComparedRows<'a>),
}

impl LaneWork for StrayWork<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<W: Wide>(self) -> bool {
        let Self { compared, progress, strays } = self;
        match compared {
            Compared::Graph(graph) => graph.mark_strays::<W>(progress, strays),
            Compared::Rows(rows) => rows.mark_strays::<W>(progress, strays),
        }
    }
}

/// Squares of the distances of particles from their paths.
#[inline(always)]
fn squares<W: Wide>(
    now: &[PackedParticle; 8],
    saved: &[PackedParticle; 8],
    progress: Progress,
) -> W {
    let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(now);
    let now = [[x, y, z], [dx, dy, dz]];
    let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(saved);
    progress.squares(now, [[x, y, z], [dx, dy, dz]])
}
