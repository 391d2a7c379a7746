//! Writes the parameters of single constraints into their columns.

use super::fields::ConstraintFields;
use super::parameters::{ConstraintParameters, LimitLengths, PassSoftness};
use super::projection::TearMark;
use super::separation::RestLength;

/// The columns of one kind in memory: each begins `stride` numbers after the one before.
pub(crate) struct ColumnWriter<'a> {
    memory: &'a mut [f32],
    stride: usize,
    columns: ColumnOrder,
}

/// Number of each column that exists, counted from the rest length.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ColumnOrder {
    /// Scaled compliance; the share follows.
    softness: Option<usize>,
    floors: Option<usize>,
    /// Length; its square follows.
    max_lengths: Option<usize>,
    tear_lengths: Option<usize>,
    tear_multipliers: Option<usize>,
    multipliers: Option<usize>,
    marks: Option<usize>,
}

impl ColumnOrder {
    pub(crate) fn new(layout: ConstraintFields) -> Self {
        // The rest length and its square come first.
        let mut count = 2;
        let mut next = |is_there: bool, columns: usize| {
            let column = count;
            count += if is_there { columns } else { 0 };
            is_there.then_some(column)
        };
        Self {
            softness: next(layout.softness, 2),
            floors: next(layout.floors, 1),
            max_lengths: next(layout.max_lengths, 2),
            tear_lengths: next(layout.tear_lengths, 1),
            tear_multipliers: next(layout.tear_multipliers, 1),
            multipliers: next(layout.multipliers, 1),
            marks: next(layout.tears(), 1),
        }
    }
}

impl<'a> ColumnWriter<'a> {
    pub(crate) fn new(memory: &'a mut [f32], stride: usize, columns: ColumnOrder) -> Self {
        Self { memory, stride, columns }
    }

    /// Sets everything of the constraint whose rest length is at `index`, and clears its mark.
    pub(crate) fn set(&mut self, index: usize, parameters: &ConstraintParameters) {
        let ConstraintParameters { rest, floor, softness, limits } = parameters;
        let ColumnOrder { floors, multipliers, marks, .. } = self.columns;
        self.memory[index] = rest.length;
        self.memory[index + self.stride] = rest.square;
        self.set_number(floors, index, *floor);
        self.set_number(multipliers, index, 0.0);
        self.set_number(marks, index, 0.0);
        self.set_softness(index, *softness);
        self.set_limits(index, limits);
    }

    fn set_softness(&mut self, index: usize, softness: PassSoftness) {
        let scaled_compliances = self.columns.softness;
        let shares = scaled_compliances.map(|column| column + 1);
        self.set_number(scaled_compliances, index, softness.scaled_compliance);
        self.set_number(shares, index, softness.share);
    }

    /// Sets the limits of a constraint.
    pub(crate) fn set_limits(&mut self, index: usize, limits: &LimitLengths) {
        let ColumnOrder { max_lengths, tear_lengths, tear_multipliers, .. } = self.columns;
        let RestLength { length, square } = RestLength::new(limits.max_length);
        self.set_number(max_lengths, index, length);
        self.set_number(max_lengths.map(|column| column + 1), index, square);
        self.set_number(tear_lengths, index, limits.tear_length);
        self.set_number(tear_multipliers, index, limits.tear_multiplier);
    }

    /// Returns the mark of a constraint, and clears it.
    pub(crate) fn remove_mark(&mut self, index: usize) -> Option<TearMark> {
        let column = self.columns.marks?;
        TearMark::from_number(std::mem::take(&mut self.memory[index + column * self.stride]))
    }

    #[inline]
    fn set_number(&mut self, column: Option<usize>, index: usize, number: f32) {
        if let Some(column) = column {
            self.memory[index + column * self.stride] = number;
        }
    }
}

#[cfg(test)]
mod tests {
    //! Projections read the parameters that the writer wrote.
    use super::*;
    use crate::constraints::columns::{ConstraintColumns, FullPass};
    use crate::constraints::fields::Pass;
    use crate::constraints::projection::Values;

    const PARAMETERS: ConstraintParameters = ConstraintParameters {
        rest: RestLength { length: 1.0, square: 2.0 },
        floor: 3.0,
        softness: PassSoftness { scaled_compliance: 4.0, share: 5.0 },
        limits: LimitLengths { max_length: 6.0, tear_length: 7.0, tear_multiplier: 8.0 },
    };

    #[test]
    fn every_subset_of_the_fields_is_read_as_it_was_written() {
        for bits in 0..64_u32 {
            let has = |bit: u32| bits & (1 << bit) != 0;
            let layout = ConstraintFields {
                softness: has(0),
                floors: has(1),
                max_lengths: has(2),
                tear_lengths: has(3),
                tear_multipliers: has(4),
                multipliers: has(5),
            };
            let mut memory = vec![f32::NAN; 16 * layout.column_count()];
            ColumnWriter::new(&mut memory, 16, ColumnOrder::new(layout)).set(9, &PARAMETERS);
            let softness = PassSoftness::RIGID;
            let pass = Pass { index: 0, count: 1 };
            let full_pass = FullPass { used: layout, softness, pass };
            let full = ConstraintColumns::new(&mut memory, 16, layout).full(&(0..2), &full_pass);
            assert_eq!((full.lengths[1][1], full.squares[1][1]), (1.0, 2.0));
            let read = |column: Option<&[[f32; 8]]>| column.map(|column| column[1][1]);
            assert_eq!(read(full.floors), layout.floors.then_some(3.0));
            assert_eq!(read(full.tear_lengths), layout.tear_lengths.then_some(7.0));
            assert_eq!(read(full.tear_multipliers), layout.tear_multipliers.then_some(8.0));
            assert_eq!(read(full.multipliers.as_deref()), layout.multipliers.then_some(0.0));
            assert_eq!(read(full.marks.as_deref()), layout.tears().then_some(0.0));
            let expected = if layout.softness { (4.0, 5.0) } else { (0.0, 1.0) };
            let value = |values: Values<'_>| match values {
                Values::All(value) => value,
                Values::Each(values) => values[1][1],
            };
            assert_eq!((value(full.scaled_compliances), value(full.shares)), expected);
            if layout.max_lengths {
                let columns = ConstraintColumns::new(&mut memory, 16, layout);
                let limit = columns.stretch_limit(&(0..2));
                assert_eq!((limit.lengths[1][1], limit.squares[1][1]), (6.0, 36.0));
            }
        }
    }
}
