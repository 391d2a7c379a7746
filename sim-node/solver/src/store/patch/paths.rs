//! The paths of the particles of a sheet.

use super::Patch;
use crate::kernels::lanes::{LaneWork, Wide, axes, lane_groups};
use crate::store::paths::Progress;

/// Saved fields of a row: position and displacement.
const SAVED_FIELDS: usize = 6;
/// First field of the displacement in a row.
const DISPLACEMENT_AT: usize = 4;

impl Patch {
    /// Replaces the saved paths with those that the particles are about to take.
    pub(crate) fn save_paths(&self, saved: &mut Vec<f32>) {
        let (stride, row_length) = (self.layout.stride, self.layout.row_length);
        let numbers: &[f32] = bytemuck::cast_slice(&self.lines);
        saved.clear();
        for row in numbers.chunks_exact(row_length) {
            saved.extend_from_slice(&row[..3 * stride]);
            saved.extend_from_slice(&row[DISPLACEMENT_AT * stride..][..3 * stride]);
        }
    }

    /// Compares the particles with saved paths. Returns true if one is beside its own.
    pub(crate) fn beside_work<'a>(
        &'a self,
        saved: &'a [f32],
        progress: Progress,
    ) -> impl LaneWork<Output = bool> + 'a {
        BesideWork { patch: self, saved, progress }
    }
}

struct BesideWork<'a> {
    patch: &'a Patch,
    saved: &'a [f32],
    progress: Progress,
}

impl LaneWork for BesideWork<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<W: Wide>(self) -> bool {
        let layout = &self.patch.layout;
        let (stride, count) = (layout.stride, layout.columns.div_ceil(8));
        let numbers: &[f32] = bytemuck::cast_slice(&self.patch.lines);
        let rows = numbers.chunks_exact(layout.row_length);
        for (row, saved) in rows.zip(self.saved.chunks_exact(SAVED_FIELDS * stride)) {
            let x = axes(|axis| lane_groups(row, axis * stride, count));
            let d = axes(|axis| lane_groups(row, (DISPLACEMENT_AT + axis) * stride, count));
            let saved_x = axes(|axis| lane_groups(saved, axis * stride, count));
            let saved_d = axes(|axis| lane_groups(saved, (3 + axis) * stride, count));
            for group in 0..count {
                let now = [
                    axes(|axis| W::load(&x[axis][group], 0)),
                    axes(|axis| W::load(&d[axis][group], 0)),
                ];
                let saved = [
                    axes(|axis| W::load(&saved_x[axis][group], 0)),
                    axes(|axis| W::load(&saved_d[axis][group], 0)),
                ];
                if W::any(self.progress.beside(now, saved)) {
                    return true;
                }
            }
        }
        false
    }
}
