//! The projection of constraints between two rows, and within one.

use super::layout::STATE_FIELDS;
use crate::constraints::projection::{LaneIndex, Projection};
use crate::constraints::projection_block::{BLOCK_LENGTH, ProjectionBlock};
use crate::constraints::separation::Separation;
use crate::kernels::lanes::{Lanes8, Wide, axes, lane_groups, lane_groups_mut, map_axes};

/// Positions, inverse masses and displacements of the ends of constraints, in columns of a row.
pub(crate) struct Ends<'a> {
    pub(crate) x: [&'a [Lanes8]; 3],
    pub(crate) w: &'a [Lanes8],
    pub(crate) d: [&'a mut [Lanes8]; 3],
}

impl<'a> Ends<'a> {
    /// The `count` lane groups from column `from` on. `state` holds the first [`STATE_FIELDS`] fields
    /// of a row, each of `stride` numbers.
    #[inline(always)]
    pub(crate) fn new(state: &'a mut [f32], stride: usize, from: usize, count: usize) -> Self {
        let (fixed, d) = state[..STATE_FIELDS * stride].split_at_mut(4 * stride);
        let (dx, d) = d.split_at_mut(stride);
        let (dy, dz) = d.split_at_mut(stride);
        let field = |index: usize| lane_groups(&fixed[index * stride..][..stride], from, count);
        Self {
            x: [field(0), field(1), field(2)],
            w: field(3),
            d: map_axes([dx, dy, dz], |d| lane_groups_mut(d, from, count)),
        }
    }

    /// The `count` lane groups from each of two columns on, which must not overlap.
    #[inline(always)]
    pub(crate) fn pair(
        state: &'a mut [f32],
        stride: usize,
        columns: [usize; 2],
        count: usize,
    ) -> [Self; 2] {
        let (fixed, d) = state[..STATE_FIELDS * stride].split_at_mut(4 * stride);
        let (dx, d) = d.split_at_mut(stride);
        let (dy, dz) = d.split_at_mut(stride);
        let [ax, bx] = two_groups_mut(dx, columns, count);
        let [ay, by] = two_groups_mut(dy, columns, count);
        let [az, bz] = two_groups_mut(dz, columns, count);
        [
            Self::from_fields(fixed, stride, columns[0], [ax, ay, az]),
            Self::from_fields(fixed, stride, columns[1], [bx, by, bz]),
        ]
    }

    #[inline(always)]
    fn from_fields(fixed: &'a [f32], stride: usize, from: usize, d: [&'a mut [Lanes8]; 3]) -> Self {
        let count = d[0].len();
        // (As a closure it would compile to a call.)
        let x = lane_groups(&fixed[..stride], from, count);
        let y = lane_groups(&fixed[stride..2 * stride], from, count);
        let z = lane_groups(&fixed[2 * stride..3 * stride], from, count);
        Self { x: [x, y, z], w: lane_groups(&fixed[3 * stride..4 * stride], from, count), d }
    }

    /// The first `count` lane groups, in a form that shows the compiler their number.
    #[inline(always)]
    pub(crate) fn shortened(self, count: usize) -> Self {
        Self {
            x: map_axes(self.x, |x| &x[..count]),
            w: &self.w[..count],
            d: map_axes(self.d, |d| &mut d[..count]),
        }
    }
}

#[inline(always)]
fn two_groups_mut(field: &mut [f32], [a, b]: [usize; 2], count: usize) -> [&mut [Lanes8]; 2] {
    let (low, high) = field.split_at_mut(a.max(b));
    let (low, high) = (lane_groups_mut(low, a.min(b), count), lane_groups_mut(high, 0, count));
    if a < b { [low, high] } else { [high, low] }
}

/// Projects constraints between two rows, or between two parts of one.
#[inline(always)]
pub(crate) fn project_down<W: Wide>(
    upper: Ends<'_>,
    lower: Ends<'_>,
    projection: &mut impl Projection,
    block: &mut ProjectionBlock,
) {
    let count = upper.w.len();
    let (x_a, x_b) = (map_axes(upper.x, |x| &x[..count]), map_axes(lower.x, |x| &x[..count]));
    let (w_a, w_b) = (upper.w, &lower.w[..count]);
    let (d_a, d_b) =
        (map_axes(upper.d, |d| &mut d[..count]), map_axes(lower.d, |d| &mut d[..count]));
    for first in (0..count).step_by(BLOCK_LENGTH) {
        let length = BLOCK_LENGTH.min(count - first);
        for group in 0..length {
            let load = |field: &[Lanes8]| W::load(&field[first + group], 0);
            let start = axes(|axis| load(x_b[axis]) - load(x_a[axis]));
            let change = axes(|axis| load(d_b[axis]) - load(d_a[axis]));
            block.set_separation(group, &Separation::new(start, change));
        }
        for group in 0..length {
            let load = |field: &[Lanes8]| W::load(&field[first + group], 0);
            let index = LaneIndex { group: first + group, lane: 0 };
            block.solve(group, projection, index, load(w_a) + load(w_b));
        }
        for group in 0..length {
            let load = |field: &[Lanes8]| W::load(&field[first + group], 0);
            let correction = block.correction::<W>(group);
            let (change_a, change_b) =
                (correction.displacement(load(w_a)), correction.displacement(load(w_b)));
            for axis in 0..3 {
                let (d_a, d_b) = (&mut d_a[axis][first + group], &mut d_b[axis][first + group]);
                (W::load(d_a, 0) + change_a[axis]).store(d_a, 0);
                (W::load(d_b, 0) - change_b[axis]).store(d_b, 0);
            }
        }
    }
}

/// Columns between which the constraints of a family within a row alternate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ColumnUnit {
    /// Even with odd columns.
    Single,
    /// Even with odd pairs of columns.
    Pair,
}

/// Projects constraints within a row, sixteen columns at a time.
#[inline(always)]
pub(crate) fn project_across<W: Wide>(
    row: Ends<'_>,
    unit: ColumnUnit,
    projection: &mut impl Projection,
    block: &mut ProjectionBlock,
) {
    let count = row.w.len() / 2;
    let x = map_axes(row.x, |x| pairs(x, count));
    let w = pairs(row.w, count);
    let d = map_axes(row.d, |d| pairs_mut(d, count));
    for first in (0..count).step_by(BLOCK_LENGTH) {
        let length = BLOCK_LENGTH.min(count - first);
        for group in 0..length {
            let at = first + group;
            let start = axes(|axis| difference(unzip(&x[axis][at], unit)));
            let change = axes(|axis| difference(unzip(&d[axis][at], unit)));
            block.set_separation::<W>(group, &Separation::new(start, change));
        }
        for group in 0..length {
            let index = LaneIndex { group: first + group, lane: 0 };
            let [w_a, w_b]: [W; 2] = unzip(&w[index.group], unit);
            block.solve(group, projection, index, w_a + w_b);
        }
        for group in 0..length {
            let correction = block.correction::<W>(group);
            let [w_a, w_b]: [W; 2] = unzip(&w[first + group], unit);
            let (change_a, change_b) =
                (correction.displacement(w_a), correction.displacement(-w_b));
            for axis in 0..3 {
                let [low, high] = zip([change_a[axis], change_b[axis]], unit);
                let [to_low, to_high] = &mut d[axis][first + group];
                (W::load(to_low, 0) + low).store(to_low, 0);
                (W::load(to_high, 0) + high).store(to_high, 0);
            }
        }
    }
}

#[inline(always)]
pub(crate) fn unzip<W: Wide>([low, high]: &[Lanes8; 2], unit: ColumnUnit) -> [W; 2] {
    let (low, high) = (W::load(low, 0), W::load(high, 0));
    match unit {
        ColumnUnit::Single => W::unzip(low, high),
        ColumnUnit::Pair => W::unzip_pairs(low, high),
    }
}

#[inline(always)]
pub(crate) fn zip<W: Wide>([a, b]: [W; 2], unit: ColumnUnit) -> [W; 2] {
    match unit {
        ColumnUnit::Single => W::zip(a, b),
        ColumnUnit::Pair => W::zip_pairs(a, b),
    }
}

#[inline(always)]
fn difference<W: Wide>([a, b]: [W; 2]) -> W {
    b - a
}

#[inline(always)]
pub(crate) fn pairs(groups: &[Lanes8], count: usize) -> &[[Lanes8; 2]] {
    let (pairs, _) = groups.as_chunks();
    &pairs[..count]
}

#[inline(always)]
pub(crate) fn pairs_mut(groups: &mut [Lanes8], count: usize) -> &mut [[Lanes8; 2]] {
    let (pairs, _) = groups.as_chunks_mut();
    &mut pairs[..count]
}
