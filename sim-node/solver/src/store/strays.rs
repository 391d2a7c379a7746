//! Follows all particles along their paths, and finds those that have left theirs.

use super::paths::{COMPARED_MIN, Compared, ComparedGraph, NO_SLOT, Paths, Progress, StrayMarks};
use super::rows::Rows;
use super::{Location, ParticleStore};
use crate::kernels::lanes::PackedParticle;

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
