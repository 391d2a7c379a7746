//! The paths of the particles of rows.

use super::{RowLayout, Rows};
use crate::kernels::lanes::{Wide, axes, lane_groups};
use crate::store::paths::{NO_SLOT, Progress};

/// Saved fields of a row: position and displacement.
const SAVED_FIELDS: usize = 6;
/// First field of the displacement in a row.
const DISPLACEMENT_AT: usize = 4;

impl Rows {
    /// Replaces the saved paths with those that the particles are about to take.
    pub(crate) fn save_paths(&self, saved: &mut Vec<f32>) {
        let (stride, length) = (self.layout.stride, self.layout.length);
        let numbers: &[f32] = self.numbers();
        saved.clear();
        for row in numbers.chunks_exact(length) {
            saved.extend_from_slice(&row[..3 * stride]);
            saved.extend_from_slice(&row[DISPLACEMENT_AT * stride..][..3 * stride]);
        }
    }

    /// Replaces the saved path of a particle: position and displacement.
    pub(crate) fn set_saved_path(&self, saved: &mut [f32], index: usize, path: [[f32; 3]; 2]) {
        let (stride, length) = (self.layout.stride, self.layout.length);
        let first = index / length * SAVED_FIELDS * stride + index % length;
        for (field, number) in path.into_iter().flatten().enumerate() {
            saved[first + field * stride] = number;
        }
    }

    /// Places for the slots of all particles.
    pub(crate) fn no_slots(&self) -> Vec<u32> {
        vec![NO_SLOT; self.layout.rows * self.layout.stride]
    }

    /// Sets the slot of a particle.
    pub(crate) fn set_slot(&self, slots: &mut [u32], index: usize, slot: u32) {
        let (stride, length) = (self.layout.stride, self.layout.length);
        slots[index / length * stride + index % length] = slot;
    }

    /// Divides the particles, with saved paths, into parts of this number of rows.
    pub(crate) fn compared<'a>(
        &'a self,
        saved: &'a [f32],
        slots: &'a [u32],
        row_count: usize,
    ) -> impl ExactSizeIterator<Item = ComparedRows<'a>> {
        let RowLayout { length, stride, .. } = self.layout;
        let numbers = self.numbers().chunks(row_count * length);
        let paths =
            saved.chunks(row_count * SAVED_FIELDS * stride).zip(slots.chunks(row_count * stride));
        let layout = &self.layout;
        numbers.zip(paths).map(move |(numbers, (saved, slots))| ComparedRows {
            layout,
            numbers,
            saved,
            slots,
        })
    }
}

/// Rows with the paths of their particles.
#[derive(Clone, Copy)]
pub(crate) struct ComparedRows<'a> {
    layout: &'a RowLayout,
    numbers: &'a [f32],
    saved: &'a [f32],
    slots: &'a [u32],
}

impl ComparedRows<'_> {
    /// Marks the particles that are beside their paths. Returns true if one is too far.
    #[inline(always)]
    pub(crate) fn mark_strays<W: Wide>(self, progress: Progress, strays: &mut [u16]) -> bool {
        let mut is_one_too_far = false;
        let RowLayout { length, stride, columns, .. } = *self.layout;
        let count = columns.div_ceil(8);
        let rows = self.numbers.chunks_exact(length);
        let saved = self.saved.chunks_exact(SAVED_FIELDS * stride);
        for ((row, saved), slots) in rows.zip(saved).zip(self.slots.chunks_exact(stride)) {
            let x = axes(|axis| lane_groups(row, axis * stride, count));
            let d = axes(|axis| lane_groups(row, (DISPLACEMENT_AT + axis) * stride, count));
            let saved_x = axes(|axis| lane_groups(saved, axis * stride, count));
            let saved_d = axes(|axis| lane_groups(saved, (3 + axis) * stride, count));
            let (slots, _) = slots.as_chunks();
            for group in 0..count {
                let now = [
                    axes(|axis| W::load(&x[axis][group], 0)),
                    axes(|axis| W::load(&d[axis][group], 0)),
                ];
                let saved = [
                    axes(|axis| W::load(&saved_x[axis][group], 0)),
                    axes(|axis| W::load(&saved_d[axis][group], 0)),
                ];
                let squares = progress.squares(now, saved);
                is_one_too_far |= progress.mark_strays(squares, &slots[group], strays);
            }
        }
        is_one_too_far
    }
}
