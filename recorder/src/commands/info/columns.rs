//! The times of the steps, condensed to the columns of a graph.

use hdrhistogram::Histogram;
use recording::StepRow;

use super::timing::{histogram, is_measured};

/// The times of the steps in one column of a graph, to three digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(clippy::struct_field_names, reason = "each name ends in its unit")]
pub(super) struct Column {
    pub(super) min_ns: u64,
    pub(super) median_ns: u64,
    pub(super) max_ns: u64,
}

/// The columns of one time. `None` for a column without measured steps.
pub(super) type Columns = Vec<Option<Column>>;

/// Condenses the times of ascending steps, in memory that does not depend on their number.
#[derive(Debug)]
pub(super) struct ColumnCollector {
    first_step: u64,
    /// Number of steps from the first to the last one, with those that are not recorded.
    step_count: u64,
    current: usize,
    wake_late: CondensedTimes,
    solve: CondensedTimes,
}

impl ColumnCollector {
    /// Divides the steps `first..=last` into `column_count` columns.
    pub(super) fn new([first, last]: [u64; 2], column_count: usize) -> anyhow::Result<Self> {
        Ok(Self {
            first_step: first,
            step_count: last.saturating_sub(first).saturating_add(1),
            current: 0,
            wake_late: CondensedTimes::new(column_count)?,
            solve: CondensedTimes::new(column_count)?,
        })
    }

    pub(super) fn add(&mut self, row: &StepRow) {
        if !is_measured(row) {
            return;
        }
        let index = self.index(row.step);
        if index != self.current {
            self.end_column();
            self.current = index;
        }
        self.wake_late.times.saturating_record(row.wake_late_ns);
        self.solve.times.saturating_record(row.solve_ns);
    }

    /// Returns the columns of the wake-up lateness and of the solver time.
    pub(super) fn finish(mut self) -> [Columns; 2] {
        self.end_column();
        [self.wake_late.columns, self.solve.columns]
    }

    fn end_column(&mut self) {
        self.wake_late.end_column(self.current);
        self.solve.end_column(self.current);
    }

    /// Returns the column of a step. A step outside the range belongs to the nearest column.
    fn index(&self, step: u64) -> usize {
        let count = self.wake_late.columns.len();
        let passed = u128::from(step.saturating_sub(self.first_step));
        let index = passed * count as u128 / u128::from(self.step_count);
        usize::try_from(index).unwrap_or(usize::MAX).min(count - 1)
    }
}

/// The finished columns of one time, and the times of the current one.
#[derive(Debug)]
struct CondensedTimes {
    columns: Columns,
    times: Histogram<u64>,
}

impl CondensedTimes {
    fn new(column_count: usize) -> anyhow::Result<Self> {
        Ok(Self { columns: vec![None; column_count], times: histogram()? })
    }

    fn end_column(&mut self, index: usize) {
        if !self.times.is_empty() {
            let (min_ns, max_ns) = (self.times.min(), self.times.max());
            let median_ns = self.times.value_at_quantile(0.5).clamp(min_ns, max_ns);
            self.columns[index] = Some(Column { min_ns, median_ns, max_ns });
            self.times.reset();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(step: u64, wake_late_ns: u64) -> StepRow {
        StepRow { step, wake_late_ns, solve_ns: 2 * wake_late_ns + 1, ..StepRow::default() }
    }

    #[test]
    fn a_column_has_the_least_the_median_and_the_greatest_time_of_its_steps() {
        let mut collector = ColumnCollector::new([100, 399], 3).unwrap();
        // 0 to 99 ns, then no step, then 200 to 299 ns.
        for step in (100..200).chain(300..400) {
            collector.add(&row(step, step - 100));
        }
        let [wake_late, solve] = collector.finish();
        let column = |min_ns, median_ns, max_ns| Some(Column { min_ns, median_ns, max_ns });
        assert_eq!(wake_late, [column(0, 49, 99), None, column(200, 249, 299)]);
        assert_eq!(solve, [column(1, 99, 199), None, column(401, 499, 599)]);
    }

    #[test]
    fn each_of_as_many_steps_as_columns_has_its_own() {
        let mut collector = ColumnCollector::new([7, 11], 5).unwrap();
        for step in 7..=11 {
            collector.add(&row(step, step));
        }
        let [wake_late, _] = collector.finish();
        let medians: Vec<_> = wake_late.iter().flatten().map(|one| one.median_ns).collect();
        assert_eq!(medians, [7, 8, 9, 10, 11]);
    }

    #[test]
    fn steps_outside_the_range_belong_to_the_nearest_column() {
        let mut collector = ColumnCollector::new([10, 19], 2).unwrap();
        for step in [9, 20, u64::MAX] {
            collector.add(&row(step, 5));
        }
        assert!(collector.finish()[0].iter().all(Option::is_some));
    }
}
