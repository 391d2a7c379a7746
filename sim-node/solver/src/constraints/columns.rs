//! Constraint parameters in columns of numbers, which the kernels read eight at a time.

use std::ops::Range;

use super::fields::{ConstraintFields, Pass};
use super::parameters::PassSoftness;
use super::projection::{FullProjection, RigidProjection, Values};
use crate::kernels::lanes::{Lanes8, lane_groups, lane_groups_mut};

/// Columns of some constraints, all of the same length.
pub(crate) struct ConstraintColumns<'a> {
    lengths: &'a mut [f32],
    squares: &'a mut [f32],
    softness: Option<[&'a mut [f32]; 2]>,
    floors: Option<&'a mut [f32]>,
    max_lengths: Option<[&'a mut [f32]; 2]>,
    tear_lengths: Option<&'a mut [f32]>,
    tear_multipliers: Option<&'a mut [f32]>,
    multipliers: Option<&'a mut [f32]>,
    marks: Option<&'a mut [f32]>,
}

impl<'a> ConstraintColumns<'a> {
    /// Splits memory into the columns of `layout`, each of `length` numbers, in the order of
    /// [`super::column_writer::ColumnWriter`].
    #[inline(always)]
    pub(crate) fn new(memory: &'a mut [f32], length: usize, layout: ConstraintFields) -> Self {
        let mut rest = memory;
        let mut next = || {
            let (column, others) = std::mem::take(&mut rest).split_at_mut(length);
            rest = others;
            column
        };
        Self {
            lengths: next(),
            squares: next(),
            softness: layout.softness.then(|| [next(), next()]),
            floors: layout.floors.then(&mut next),
            max_lengths: layout.max_lengths.then(|| [next(), next()]),
            tear_lengths: layout.tear_lengths.then(&mut next),
            tear_multipliers: layout.tear_multipliers.then(&mut next),
            multipliers: layout.multipliers.then(&mut next),
            marks: layout.tears().then(&mut next),
        }
    }

    /// The projection of a range of lane groups by their lengths alone.
    #[inline(always)]
    pub(crate) fn rigid(self, groups: &Range<usize>, share: f32) -> RigidProjection<'a> {
        let Self { lengths, squares, .. } = self;
        RigidProjection { lengths: cut(lengths, groups), squares: cut(squares, groups), share }
    }

    /// The projection of a range of lane groups by the fields in use. Constraints without a
    /// softness of their own have that of `full`.
    #[inline(always)]
    pub(crate) fn full(self, groups: &Range<usize>, full: &FullPass) -> FullProjection<'a> {
        let FullPass { used, softness, pass } = *full;
        let (scaled_compliances, shares) = match self.softness {
            Some([scaled_compliances, shares]) if used.softness => {
                (Values::Each(cut(scaled_compliances, groups)), Values::Each(cut(shares, groups)))
            }
            _ => (Values::All(softness.scaled_compliance), Values::All(softness.share)),
        };
        let tears_by_length = used.tear_lengths && pass.is_first();
        let tears_by_force = used.tear_multipliers && pass.is_last();
        FullProjection {
            lengths: cut(self.lengths, groups),
            squares: cut(self.squares, groups),
            shares,
            scaled_compliances,
            multipliers: cut_if_mut(used.multipliers, self.multipliers, groups),
            is_first: pass.is_first(),
            floors: cut_if(used.floors, self.floors, groups),
            tear_lengths: cut_if(tears_by_length, self.tear_lengths, groups),
            tear_multipliers: cut_if(tears_by_force, self.tear_multipliers, groups),
            marks: cut_if_mut(used.tears(), self.marks, groups),
            is_marked: false,
        }
    }

    /// The projection of a range of lane groups back to their largest lengths, pulling only.
    #[inline(always)]
    pub(crate) fn stretch_limit(self, groups: &Range<usize>) -> FullProjection<'a> {
        let Some([lengths, squares]) = self.max_lengths else {
            unreachable!("a stage limits the stretch of constraints without a largest length")
        };
        let lengths = cut(lengths, groups);
        FullProjection {
            lengths,
            squares: cut(squares, groups),
            shares: Values::All(1.0),
            scaled_compliances: Values::All(0.0),
            multipliers: None,
            is_first: true,
            floors: Some(lengths),
            tear_lengths: None,
            tear_multipliers: None,
            marks: None,
            is_marked: false,
        }
    }
}

/// Inputs of a full projection beside the columns.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FullPass {
    /// Fields that the current parameters use: some or all of those in memory.
    pub(crate) used: ConstraintFields,
    pub(crate) softness: PassSoftness,
    pub(crate) pass: Pass,
}

#[inline(always)]
fn cut<'a>(column: &'a [f32], groups: &Range<usize>) -> &'a [Lanes8] {
    lane_groups(column, 8 * groups.start, groups.len())
}

#[inline(always)]
fn cut_if<'a>(
    is_used: bool,
    column: Option<&'a mut [f32]>,
    groups: &Range<usize>,
) -> Option<&'a [Lanes8]> {
    column.filter(|_| is_used).map(|column| cut(column, groups))
}

#[inline(always)]
fn cut_if_mut<'a>(
    is_used: bool,
    column: Option<&'a mut [f32]>,
    groups: &Range<usize>,
) -> Option<&'a mut [Lanes8]> {
    let column = column.filter(|_| is_used)?;
    Some(lane_groups_mut(column, 8 * groups.start, groups.len()))
}
