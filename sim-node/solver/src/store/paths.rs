//! The straight paths that the particles take in a step, to tell whether one has left its own.

use crate::kernels::lanes::{LaneWork, PackedParticle, Wide, axes};

/// Where the path of every particle begins, its displacement in a substep, and its tile.
#[derive(Debug, Clone, Default)]
pub(crate) struct Paths {
    /// By rows of the store.
    pub(super) in_rows: Vec<Vec<f32>>,
    pub(super) graph: Vec<PackedParticle>,
    /// The tile of every particle, in the same order.
    pub(super) tiles_in_rows: Vec<Vec<u32>>,
    pub(super) tiles_of_graph: Vec<u32>,
}

/// The tile of a particle without contacts. It is beyond all tiles, so its path is compared but not noted.
pub(super) const NO_TILE: u32 = u32::MAX;

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

/// Marks the tile of each lane whose bit is set.
#[inline(always)]
pub(super) fn mark_tiles(mut lanes: u32, tiles: &[u32; 8], has_stray: &mut [bool]) {
    while lanes != 0 {
        let tile = tiles[lanes.trailing_zeros() as usize];
        if let Some(has_stray) = has_stray.get_mut(tile as usize) {
            *has_stray = true;
        }
        lanes &= lanes - 1;
    }
}

/// Compares the particles of the graph with their paths.
pub(super) struct GraphWork<'a> {
    pub(super) now: &'a [PackedParticle],
    pub(super) saved: &'a [PackedParticle],
    pub(super) tiles: &'a [u32],
    pub(super) progress: Progress,
    pub(super) has_stray: &'a mut [bool],
}

impl LaneWork for GraphWork<'_> {
    type Output = ();

    #[inline(always)]
    fn run<W: Wide>(self) {
        let Self { now, saved, tiles, progress, has_stray } = self;
        let (now, now_rest) = now.as_chunks();
        let (saved, saved_rest) = saved.as_chunks();
        let (tiles, tiles_rest) = tiles.as_chunks();
        for ((now, saved), tiles) in now.iter().zip(saved).zip(tiles) {
            mark_tiles(beside::<W>(now, saved, progress), tiles, has_stray);
        }
        let mut last = [[PackedParticle::default(); 8]; 2];
        last[0][..now_rest.len()].copy_from_slice(now_rest);
        last[1][..saved_rest.len()].copy_from_slice(saved_rest);
        let mut last_tiles = [NO_TILE; 8];
        last_tiles[..tiles_rest.len()].copy_from_slice(tiles_rest);
        mark_tiles(beside::<W>(&last[0], &last[1], progress), &last_tiles, has_stray);
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
