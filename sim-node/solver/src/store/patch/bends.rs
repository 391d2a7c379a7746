//! The projection of the bends of a sheet.

use sim_scene::constraints::bends::families::BendFamily;
use sim_scene::constraints::bends::{SECOND_DIFFERENCE, TWIST};

use super::bend_layout::BendGroup;
use super::sheet_layout::SheetLayout;
use crate::constraints::bends::block::{BEND_BLOCK_LENGTH, BendBlock};
use crate::constraints::bends::projection::{
    Arm, BendPass, BendProjection, bend_value, bend_weight,
};
use crate::constraints::projection::LaneIndex;
use crate::kernels::lanes::{Lanes8, Wide, axes, lane_groups, lane_groups_mut, map_axes};
use crate::store::rows::ends::{ColumnUnit, Ends, pairs, pairs_mut, unzip, zip};
use crate::store::rows::{RowLayout, STATE_FIELDS};

/// Projects the bends of a group that begin in the first of some rows.
#[inline(always)]
pub(crate) fn project_bends<W: Wide>(
    rows: &mut [f32],
    (layout, sheet): (&RowLayout, &SheetLayout),
    group: BendGroup,
    pass: BendPass,
    block: &mut BendBlock,
) {
    let (RowLayout { stride, length, columns, .. }, bends) = (*layout, &sheet.bends);
    let (row, below) = rows.split_at_mut(length);
    let (state, rest) = row.split_at_mut(STATE_FIELDS * stride);
    let at = bends.at - STATE_FIELDS * stride + group.family_index * bends.family_length;
    let lanes = group.lane_groups(columns, stride);
    let (from, count) = (group.first_column(), lanes.len());
    let (scaled_compliances, multipliers) = rest[at..at + bends.family_length].split_at_mut(stride);
    let mut projection = BendProjection {
        scaled_compliances: lane_groups(scaled_compliances, 8 * lanes.start, count),
        multipliers: multiplier_columns(multipliers, stride, pass)
            .map(|columns| map_axes(columns, |one| lane_groups_mut(one, 8 * lanes.start, count))),
        is_first: pass.is_first,
        share: pass.share,
    };
    match group.family {
        BendFamily::Down => {
            let (second, third) = below.split_at_mut(length);
            let ends = |row| Ends::new(row, stride, 0, count);
            bend_down::<W>([ends(state), ends(second), ends(third)], &mut projection);
        }
        BendFamily::Across => {
            bend_across::<W>(Ends::new(state, stride, from, 3 * count), &mut projection, block);
        }
        BendFamily::Twist => {
            let ends = |row| Ends::new(row, stride, from, 2 * count);
            bend_cells::<W>([ends(state), ends(below)], &mut projection, block);
        }
    }
}

/// The columns of the multipliers, if they are used.
#[inline(always)]
fn multiplier_columns(
    memory: &mut [f32],
    stride: usize,
    pass: BendPass,
) -> Option<[&mut [f32]; 3]> {
    if !pass.has_multipliers {
        return None;
    }
    let (x, rest) = memory.split_at_mut(stride);
    let (y, z) = rest.split_at_mut(stride);
    Some([x, y, z])
}

/// Projects bends of three rows. Without columns to separate, the chain of a group is so short that blocks of
/// them would only cost time.
#[inline(always)]
fn bend_down<W: Wide>([a, b, c]: [Ends<'_>; 3], projection: &mut BendProjection<'_>) {
    let count = projection.scaled_compliances.len();
    let [a, b, c] = [a, b, c].map(|ends| ends.shortened(count));
    let [c_a, c_b, c_c, _] = SECOND_DIFFERENCE.map(W::splat);
    for group in 0..count {
        let load = |field: &[Lanes8]| W::load(&field[group], 0);
        let arm = |coefficient: W, end: &Ends<'_>| Arm {
            coefficient,
            start: axes(|axis| load(end.x[axis]) - load(b.x[axis])),
            change: axes(|axis| load(end.d[axis]) - load(b.d[axis])),
        };
        let value = bend_value(&[arm(c_a, &a), arm(c_c, &c)]);
        let w = [load(a.w), load(b.w), load(c.w)];
        let weight = bend_weight(&[c_a, c_b, c_c], &w);
        let change = projection.change(LaneIndex { group, lane: 0 }, value, weight);
        let shares = [c_a * w[0], c_b * w[1], c_c * w[2]];
        for (axis, along) in change.into_iter().enumerate() {
            let ends = [&mut a.d[axis][group], &mut b.d[axis][group], &mut c.d[axis][group]];
            for (d, share) in ends.into_iter().zip(shares) {
                (W::load(d, 0) + share * along).store(d, 0);
            }
        }
    }
}

/// Projects bends within a row, 24 columns at a time.
#[inline(always)]
fn bend_across<W: Wide>(row: Ends<'_>, projection: &mut BendProjection<'_>, block: &mut BendBlock) {
    let count = projection.scaled_compliances.len();
    let x = map_axes(row.x, |x| triples(x, count));
    let w = triples(row.w, count);
    let d = map_axes(row.d, |d| triples_mut(d, count));
    let [c_a, c_b, c_c, _] = SECOND_DIFFERENCE.map(W::splat);
    let coefficients = W::zip_thirds([c_a, c_b, c_c]);
    for first in (0..count).step_by(BEND_BLOCK_LENGTH) {
        let length = BEND_BLOCK_LENGTH.min(count - first);
        for group in 0..length {
            let at = first + group;
            let (mut starts, mut changes) = ([[W::splat(0.0); 3]; 2], [[W::splat(0.0); 3]; 2]);
            for axis in 0..3 {
                let [x_a, x_b, x_c]: [W; 3] = unzip_thirds(&x[axis][at]);
                let [d_a, d_b, d_c]: [W; 3] = unzip_thirds(&d[axis][at]);
                (starts[0][axis], starts[1][axis]) = (x_a - x_b, x_c - x_b);
                (changes[0][axis], changes[1][axis]) = (d_a - d_b, d_c - d_b);
            }
            let value = bend_value(&[
                Arm { coefficient: c_a, start: starts[0], change: changes[0] },
                Arm { coefficient: c_c, start: starts[1], change: changes[1] },
            ]);
            let weight = bend_weight(&[c_a, c_b, c_c], &unzip_thirds(&w[at]));
            block.set(group, value, weight);
        }
        block.solve::<W>(projection, first, length);
        for group in 0..length {
            let at = first + group;
            let change = block.vector::<W>(group);
            let shares = axes(|part| coefficients[part] * W::load(&w[at][part], 0));
            for (axis, along) in change.into_iter().enumerate() {
                // Each column of a bend gets its change.
                let along = W::zip_thirds([along; 3]);
                for part in 0..3 {
                    let d = &mut d[axis][at][part];
                    (W::load(d, 0) + shares[part] * along[part]).store(d, 0);
                }
            }
        }
    }
}

/// Projects twists between two rows, 16 columns at a time.
#[inline(always)]
fn bend_cells<W: Wide>(
    [upper, lower]: [Ends<'_>; 2],
    projection: &mut BendProjection<'_>,
    block: &mut BendBlock,
) {
    let count = projection.scaled_compliances.len();
    let (x_upper, x_lower) =
        (map_axes(upper.x, |x| pairs(x, count)), map_axes(lower.x, |x| pairs(x, count)));
    let (w_upper, w_lower) = (pairs(upper.w, count), pairs(lower.w, count));
    let (d_upper, d_lower) =
        (map_axes(upper.d, |d| pairs_mut(d, count)), map_axes(lower.d, |d| pairs_mut(d, count)));
    let separated = |pair: &[Lanes8; 2]| -> [W; 2] { unzip(pair, ColumnUnit::Single) };
    let coefficients = TWIST.map(W::splat);
    let [c_a, c_b, c_c, c_d] = coefficients;
    let above: [W; 2] = zip([c_a, c_b], ColumnUnit::Single);
    let below: [W; 2] = zip([c_c, c_d], ColumnUnit::Single);
    for first in (0..count).step_by(BEND_BLOCK_LENGTH) {
        let length = BEND_BLOCK_LENGTH.min(count - first);
        for group in 0..length {
            let at = first + group;
            let (mut starts, mut changes) = ([[W::splat(0.0); 3]; 3], [[W::splat(0.0); 3]; 3]);
            for axis in 0..3 {
                let ([a, b], [c, d]) =
                    (separated(&x_upper[axis][at]), separated(&x_lower[axis][at]));
                (starts[0][axis], starts[1][axis], starts[2][axis]) = (a - b, c - b, d - b);
                let ([a, b], [c, d]) =
                    (separated(&d_upper[axis][at]), separated(&d_lower[axis][at]));
                (changes[0][axis], changes[1][axis], changes[2][axis]) = (a - b, c - b, d - b);
            }
            let arm = |index: usize, end: usize| Arm {
                coefficient: coefficients[end],
                start: starts[index],
                change: changes[index],
            };
            let value = bend_value(&[arm(0, 0), arm(1, 2), arm(2, 3)]);
            let ([w_a, w_b], [w_c, w_d]) = (separated(&w_upper[at]), separated(&w_lower[at]));
            block.set(group, value, bend_weight(&coefficients, &[w_a, w_b, w_c, w_d]));
        }
        block.solve::<W>(projection, first, length);
        for group in 0..length {
            let at = first + group;
            let change = block.vector::<W>(group);
            for (axis, along) in change.into_iter().enumerate() {
                // Each column of a cell gets its change.
                let along: [W; 2] = zip([along; 2], ColumnUnit::Single);
                for part in 0..2 {
                    let (upper, lower) =
                        (&mut d_upper[axis][at][part], &mut d_lower[axis][at][part]);
                    let (w_upper, w_lower) = (&w_upper[at][part], &w_lower[at][part]);
                    let share = above[part] * W::load(w_upper, 0);
                    (W::load(upper, 0) + share * along[part]).store(upper, 0);
                    let share = below[part] * W::load(w_lower, 0);
                    (W::load(lower, 0) + share * along[part]).store(lower, 0);
                }
            }
        }
    }
}

#[inline(always)]
fn unzip_thirds<W: Wide>([a, b, c]: &[Lanes8; 3]) -> [W; 3] {
    W::unzip_thirds([W::load(a, 0), W::load(b, 0), W::load(c, 0)])
}

#[inline(always)]
fn triples(groups: &[Lanes8], count: usize) -> &[[Lanes8; 3]] {
    let (triples, _) = groups.as_chunks();
    &triples[..count]
}

#[inline(always)]
fn triples_mut(groups: &mut [Lanes8], count: usize) -> &mut [[Lanes8; 3]] {
    let (triples, _) = groups.as_chunks_mut();
    &mut triples[..count]
}
