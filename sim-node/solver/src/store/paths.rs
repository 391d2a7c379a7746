//! The straight paths that the particles take in a step, to tell whether one has left its own.

use crate::kernels::lanes::{LaneWork, PackedParticle, Wide, axes};

/// Position and displacement of every particle at one time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Paths {
    /// By patch.
    pub(super) sheets: Vec<Vec<f32>>,
    pub(super) graph: Vec<PackedParticle>,
}

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

/// Compares the particles of the graph with their paths.
pub(super) struct GraphWork<'a> {
    pub(super) now: &'a [PackedParticle],
    pub(super) saved: &'a [PackedParticle],
    pub(super) progress: Progress,
}

impl LaneWork for GraphWork<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<W: Wide>(self) -> bool {
        let (now, now_rest) = self.now.as_chunks();
        let (saved, saved_rest) = self.saved.as_chunks();
        for (now, saved) in now.iter().zip(saved) {
            if self.is_beside::<W>(now, saved) {
                return true;
            }
        }
        let mut last = [[PackedParticle::default(); 8]; 2];
        last[0][..now_rest.len()].copy_from_slice(now_rest);
        last[1][..saved_rest.len()].copy_from_slice(saved_rest);
        self.is_beside::<W>(&last[0], &last[1])
    }
}

impl GraphWork<'_> {
    #[inline(always)]
    fn is_beside<W: Wide>(&self, now: &[PackedParticle; 8], saved: &[PackedParticle; 8]) -> bool {
        let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(now);
        let now = [[x, y, z], [dx, dy, dz]];
        let [[x, y, z, _], [dx, dy, dz, _]] = W::columns(saved);
        W::any(self.progress.beside(now, [[x, y, z], [dx, dy, dz]]))
    }
}
