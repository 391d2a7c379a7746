//! Follows all particles along their paths, and finds those that have left theirs.

use super::paths::{GraphWork, NO_TILE, Paths, Progress};
use super::{Location, ParticleStore};
use crate::kernels::lanes::PackedParticle;

impl ParticleStore {
    /// Replaces the paths with those that the particles are about to take.
    pub(crate) fn save_paths(&self, paths: &mut Paths) {
        paths.sheets.resize_with(self.patches.len(), Vec::new);
        for (patch, saved) in self.patches.iter().zip(&mut paths.sheets) {
            patch.rows.save_paths(saved);
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
        match location.sheet() {
            None => {
                let [[x, y, z], [dx, dy, dz]] = path;
                paths.graph[index] = PackedParticle([x, y, z, 0.0, dx, dy, dz, 0.0]);
            }
            Some(sheet) => {
                self.patches[sheet].rows.set_saved_path(&mut paths.sheets[sheet], index, path);
            }
        }
    }

    /// Makes room for the paths of all particles, none of which has a tile.
    pub(crate) fn prepare_paths(&self, paths: &mut Paths) {
        self.save_paths(paths);
        paths.tiles_of_sheets = self.patches.iter().map(|patch| patch.rows.no_tiles()).collect();
        paths.tiles_of_graph = vec![NO_TILE; paths.graph.len()];
    }

    /// Sets the tile of one particle.
    pub(crate) fn set_tile(&self, paths: &mut Paths, location: Location, tile: u32) {
        let index = location.index();
        match location.sheet() {
            None => paths.tiles_of_graph[index] = tile,
            Some(sheet) => {
                self.patches[sheet].rows.set_tile(&mut paths.tiles_of_sheets[sheet], index, tile);
            }
        }
    }

    /// Marks the tiles of particles that are not where their paths lead. NaN is beside no path.
    pub(crate) fn mark_strays(&self, paths: &Paths, progress: Progress, has_stray: &mut [bool]) {
        let kernels = self.kernels();
        let (now, saved) = (self.graph.packed_particles(), paths.graph.as_slice());
        let tiles = paths.tiles_of_graph.as_slice();
        kernels.run(GraphWork { now, saved, tiles, progress, has_stray: &mut *has_stray });
        let sheets = paths.sheets.iter().zip(&paths.tiles_of_sheets);
        for (patch, (saved, tiles)) in self.patches.iter().zip(sheets) {
            kernels.run(patch.rows.stray_work(saved, tiles, progress, &mut *has_stray));
        }
    }
}
