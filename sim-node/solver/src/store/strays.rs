//! Follows all particles along their paths, and finds those that have left theirs.

use std::iter;

use super::paths::{NO_SLOT, Paths, Progress};
use super::rows::Rows;
use super::rows::paths::ComparedRows;
use super::workers::Workers;
use super::{Location, ParticleStore};
use crate::kernels::lanes::{LaneWork, PackedParticle, Wide};

/// Fewest particles that a worker compares with their paths.
const COMPARED_MIN: usize = 1024;

impl ParticleStore {
    /// Replaces the paths with those that the particles are about to take.
    pub(crate) fn save_paths(&self, paths: &mut Paths) {
        paths.in_rows.resize_with(self.patches.len() + self.crowds.len(), Vec::new);
        for (rows, saved) in self.all_rows().zip(&mut paths.in_rows) {
            rows.save_paths(saved);
        }
        paths.graph.clear();
        paths.graph.extend_from_slice(self.graph.packed_particles());
    }

    /// Replaces the path of one particle: position and displacement.
    pub(crate) fn set_saved_path(
        &self,
        paths: &mut Paths,
        location: Location,
        path: [[f32; 3]; 2],
    ) {
        let index = location.index();
        if let (Some(rows), Some(number)) = (self.rows(location), location.rows()) {
            rows.set_saved_path(&mut paths.in_rows[number], index, path);
        } else {
            let [[x, y, z], [dx, dy, dz]] = path;
            paths.graph[index] = PackedParticle([x, y, z, 0.0, dx, dy, dz, 0.0]);
        }
    }

    /// Makes room for the paths of all particles, none of which has a slot.
    pub(crate) fn prepare_paths(&self, paths: &mut Paths) {
        self.save_paths(paths);
        paths.slots_in_rows = self.all_rows().map(Rows::no_slots).collect();
        paths.slots_of_graph = vec![NO_SLOT; paths.graph.len()];
    }

    /// Sets the slot of one particle.
    pub(crate) fn set_slot(&self, paths: &mut Paths, location: Location, slot: u32) {
        let index = location.index();
        if let (Some(rows), Some(number)) = (self.rows(location), location.rows()) {
            rows.set_slot(&mut paths.slots_in_rows[number], index, slot);
        } else {
            paths.slots_of_graph[index] = slot;
        }
    }

    /// Marks the particles that are not where their paths lead. NaN is beside no path. Returns true if one of them is too
    /// far from its path.
    pub(crate) fn mark_strays(
        &mut self,
        paths: &Paths,
        progress: Progress,
        mut strays: StrayMarks<'_>,
    ) -> bool {
        let Self { workers, graph, patches, crowds, .. } = self;
        let (now, saved) = (graph.packed_particles(), paths.graph.as_slice());
        let graph = ComparedGraph { now, saved, slots: &paths.slots_of_graph };
        let length = workers.part_length(now.len(), COMPARED_MIN);
        let mut is_one_too_far =
            strays.mark(workers, progress, graph.chunks(length).map(Compared::Graph));
        let saved = paths.in_rows.iter().zip(&paths.slots_in_rows);
        let rows = patches.iter().map(|patch| &patch.rows);
        for (rows, (saved, slots)) in rows.chain(crowds.iter().map(|crowd| &crowd.rows)).zip(saved)
        {
            let rows_min = COMPARED_MIN.div_ceil(rows.layout.columns);
            let row_count = workers.part_length(rows.layout.rows, rows_min);
            let parts = rows.compared(saved, slots, row_count).map(Compared::Rows);
            is_one_too_far |= strays.mark(workers, progress, parts);
        }
        strays.merge();
        is_one_too_far
    }
}

/// Particles of the graph with their paths.
#[derive(Clone, Copy)]
struct ComparedGraph<'a> {
    now: &'a [PackedParticle],
    saved: &'a [PackedParticle],
    slots: &'a [u32],
}

impl<'a> ComparedGraph<'a> {
    /// Divides the particles into parts of this length.
    fn chunks(self, length: usize) -> impl ExactSizeIterator<Item = Self> + use<'a> {
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
    /// By worker, without the first: its own marks. All bits are clear between calls.
    pub(crate) of_others: &'a mut [Vec<u16>],
}

impl StrayMarks<'_> {
    /// Compares parts of the particles with their paths, each by one worker. Returns true if one is too far from its own.
    fn mark<'p>(
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
    fn merge(self) {
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
enum Compared<'a> {
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
