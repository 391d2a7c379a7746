//! Draws wake-up lateness and solver time over the steps, condensed to the columns of a graph.

use glam::DVec2;
use hdrhistogram::Histogram;
use recording::StepRow;
use recording::pictures::{Color, Dash, Picture, Shape, Size, Stroke, Text};

use super::timing::{histogram, is_measured};

/// Most columns of a graph: one for each pixel of its width.
pub(super) const COLUMNS_MAX: usize = 840;

const SIZE: Size = Size { width: 960, height: 640 };
/// Left edge and width of the panels, in pixels.
const LEFT: f64 = 90.0;
const WIDTH: f64 = COLUMNS_MAX as f64;
/// Top edges and height of the panels, in pixels.
const TOPS: [f64; 2] = [80.0, 350.0];
const HEIGHT: f64 = 220.0;
/// Width of a letter, and height of a line, in cells.
const LETTER: f64 = 6.0;
const LINE: f64 = 8.0;

const TEXT: Color = Color([0x30, 0x30, 0x30]);
const GRID: Color = Color([0xd8, 0xd8, 0xd4]);
const RANGE: Color = Color([0xa9, 0xc4, 0xe4]);
const MEDIAN: Color = Color([0x1f, 0x4e, 0x8c]);
const PERIOD: Color = Color([0xb0, 0x30, 0x30]);

/// Shortest time that a panel resolves, as a power of ten in ns. Shorter ones lie on its lower edge.
const EXPONENT_MIN: u32 = 2;

/// The content of a graph.
#[derive(Debug)]
pub(super) struct Graph<'a> {
    /// File and scene.
    pub(super) title: String,
    /// First and last step.
    pub(super) steps: [u64; 2],
    /// Period of the scene's rate.
    pub(super) period_ns: f64,
    pub(super) wake_late: &'a Columns,
    pub(super) solve: &'a Columns,
}

impl Graph<'_> {
    pub(super) fn draw(&self) -> Picture {
        let mut shapes = vec![
            text(DVec2::new(LEFT, 14.0), 2, self.title.clone()),
            text(
                DVec2::new(LEFT, 40.0),
                1,
                "band: least to greatest time, line: median, of the steps in a column".to_owned(),
            ),
        ];
        let panels = [("wake-up lateness", self.wake_late), ("solver time", self.solve)];
        for (top, (name, columns)) in TOPS.into_iter().zip(panels) {
            let panel = Panel { top, exponents: exponents(columns) };
            shapes.extend(self.step_axis(&panel));
            shapes.extend(panel.time_axis());
            shapes.push(text(DVec2::new(LEFT, top - 14.0), 1, name.to_owned()));
            shapes.extend(panel.ranges(columns));
            shapes.extend(panel.medians(columns));
            shapes.extend(panel.period(self.period_ns));
        }
        let label = DVec2::new(LEFT + WIDTH / 2.0 - 2.0 * LETTER, TOPS[1] + HEIGHT + 26.0);
        shapes.push(text(label, 1, "step".to_owned()));
        shapes.retain(Shape::is_drawable);
        Picture { size: SIZE, shapes }
    }

    /// Draws a vertical line with its number for steps at even distances.
    fn step_axis(&self, panel: &Panel) -> Vec<Shape> {
        let [first, last] = self.steps;
        let span = u128::from(last.saturating_sub(first));
        // The column of a step begins at its share of the width.
        let scale = WIDTH / (span as f64 + 1.0);
        let mut shapes = Vec::new();
        for tick in 0..=span.min(4) {
            let passed = span * tick / span.clamp(1, 4);
            let x = LEFT + (passed as f64 + 0.5) * scale;
            let ends = [DVec2::new(x, panel.top), DVec2::new(x, panel.top + HEIGHT + 4.0)];
            shapes.push(Shape::Segment { ends, stroke: Stroke::solid(GRID, 1.0) });
            let line = (u128::from(first) + passed).to_string();
            let half = line.len() as f64 * LETTER / 2.0;
            shapes.push(text(DVec2::new(x - half, panel.top + HEIGHT + 10.0), 1, line));
        }
        shapes
    }
}

/// The area of one time, with a logarithmic scale.
#[derive(Debug)]
struct Panel {
    /// In pixels.
    top: f64,
    /// Powers of ten at the lower and at the upper edge, in ns.
    exponents: [u32; 2],
}

impl Panel {
    /// Returns the height of a time in the picture.
    fn y(&self, time_ns: f64) -> f64 {
        let [low, high] = self.exponents.map(f64::from);
        let share = (time_ns.max(1.0).log10().clamp(low, high) - low) / (high - low);
        self.top + HEIGHT * (1.0 - share)
    }

    fn line(&self, time_ns: f64, stroke: Stroke) -> Shape {
        let y = self.y(time_ns);
        Shape::Segment { ends: [DVec2::new(LEFT, y), DVec2::new(LEFT + WIDTH, y)], stroke }
    }

    /// Draws a horizontal line with its time for each power of ten.
    fn time_axis(&self) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for exponent in self.exponents[0]..=self.exponents[1] {
            let time_ns = 10.0_f64.powf(f64::from(exponent));
            shapes.push(self.line(time_ns, Stroke::solid(GRID, 1.0)));
            let label = power_of_ten(exponent);
            let width = label.chars().count() as f64 * LETTER;
            let corner = DVec2::new(LEFT - 6.0 - width, self.y(time_ns) - LINE / 2.0);
            shapes.push(text(corner, 1, label));
        }
        shapes
    }

    /// Draws the range of the times, as one polygon for adjacent columns.
    fn ranges(&self, columns: &Columns) -> Vec<Shape> {
        let runs = columns.chunk_by(|a, b| a.is_some() == b.is_some());
        let mut start = 0;
        let mut shapes = Vec::new();
        for run in runs {
            let filled: Vec<Column> = run.iter().copied().flatten().collect();
            if !filled.is_empty() {
                let upper = self.edge(&filled, |one| one.max_ns, start, columns.len());
                let lower = self.edge(&filled, |one| one.min_ns, start, columns.len());
                let corners = upper.into_iter().chain(lower.into_iter().rev()).collect();
                let outline = Some(Stroke::solid(RANGE, 1.0));
                shapes.push(Shape::Polygon { corners, fill: RANGE, outline });
            }
            start += run.len();
        }
        shapes
    }

    /// Returns the corners of an edge of adjacent columns, from the left to the right.
    fn edge(
        &self,
        filled: &[Column],
        time_ns: impl Fn(&Column) -> u64,
        start: usize,
        count: usize,
    ) -> Vec<DVec2> {
        let corners = (start..).zip(filled).flat_map(|(index, column)| {
            let y = self.y(time_ns(column) as f64);
            [index, index + 1].map(|place| DVec2::new(x(place as f64, count), y))
        });
        corners.collect()
    }

    /// Draws the median of each column, and connects those of adjacent columns.
    fn medians(&self, columns: &Columns) -> Vec<Shape> {
        let stroke = Stroke::solid(MEDIAN, 1.0);
        let point = |index: usize, column: &Column| {
            let center = index as f64 + 0.5;
            DVec2::new(x(center, columns.len()), self.y(column.median_ns as f64))
        };
        let filled = columns.iter().enumerate();
        let filled = filled.filter_map(|(index, column)| column.as_ref().map(|one| (index, one)));
        let segment = |(index, column): (usize, &Column)| {
            let next = columns.get(index + 1).and_then(Option::as_ref);
            let from = point(index, column);
            let to = next.map_or(from + DVec2::X, |next| point(index + 1, next));
            Shape::Segment { ends: [from, to], stroke }
        };
        filled.map(segment).collect()
    }

    /// Marks the period, if it is within the panel.
    fn period(&self, period_ns: f64) -> Vec<Shape> {
        let [low, high] = self.exponents.map(f64::from);
        if !(low..=high).contains(&period_ns.log10()) {
            return Vec::new();
        }
        let stroke = Stroke { color: PERIOD, width: 1.0, dash: Dash::Dashed };
        let label = format!("period {:.3} ms", period_ns / 1e6);
        let width = label.len() as f64 * LETTER;
        let corner = DVec2::new(LEFT + WIDTH - width, self.y(period_ns) - LINE - 3.0);
        let label = Text { corner, cell: 1, color: PERIOD, line: label };
        vec![self.line(period_ns, stroke), Shape::Text(label)]
    }
}

/// Returns the powers of ten that enclose the times.
fn exponents(columns: &Columns) -> [u32; 2] {
    let min_ns = columns.iter().flatten().map(|one| one.min_ns).min().unwrap_or(0);
    let max_ns = columns.iter().flatten().map(|one| one.max_ns).max().unwrap_or(0);
    let low = min_ns.max(1).ilog10().max(EXPONENT_MIN);
    [low, (max_ns.max(1).ilog10() + 1).max(low + 1)]
}

/// Returns the place of a column in the picture.
fn x(place: f64, count: usize) -> f64 {
    LEFT + WIDTH * place / count as f64
}

/// Returns a power of ten in ns as a time with its unit.
fn power_of_ten(exponent: u32) -> String {
    let (unit, exponent) = match exponent {
        0..=2 => ("ns", exponent),
        3..=5 => ("µs", exponent - 3),
        6..=8 => ("ms", exponent - 6),
        _ => ("s", exponent - 9),
    };
    format!("{} {unit}", 10_u64.pow(exponent))
}

fn text(corner: DVec2, cell: u32, line: String) -> Shape {
    Shape::Text(Text { corner, cell, color: TEXT, line })
}

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

    fn graph(wake_late: &Columns) -> Picture {
        let title = "run.mcap".to_owned();
        Graph { title, steps: [1, 4], period_ns: 1e5, wake_late, solve: &vec![None; 4] }.draw()
    }

    /// Powers of ten from 1 µs at the lower edge to 1 ms at the upper one.
    fn y(power: f64) -> f64 {
        TOPS[0] + HEIGHT * (6.0 - power) / 3.0
    }

    #[allow(clippy::unnecessary_wraps, reason = "columns are optional")]
    fn column(min_ns: u64, median_ns: u64, max_ns: u64) -> Option<Column> {
        Some(Column { min_ns, median_ns, max_ns })
    }

    #[test]
    fn a_band_spans_the_times_of_adjacent_columns_and_a_line_their_medians() {
        let columns = vec![
            column(1_000, 10_000, 100_000),
            column(10_000, 10_000, 10_000),
            None,
            column(1_000, 1_000, 1_000),
        ];
        let shapes = graph(&columns).shapes;
        let bands: Vec<_> = shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Polygon { corners, .. } => Some(corners.clone()),
                _ => None,
            })
            .collect();
        let at = |quarter: f64, power: f64| DVec2::new(LEFT + WIDTH * quarter / 4.0, y(power));
        let upper = [at(0.0, 5.0), at(1.0, 5.0), at(1.0, 4.0), at(2.0, 4.0)];
        let lower = [at(2.0, 4.0), at(1.0, 4.0), at(1.0, 3.0), at(0.0, 3.0)];
        assert_eq!(bands.len(), 2, "a column without steps divides the band");
        let close = |a: &DVec2, b: &DVec2| (*a - *b).length() < 1e-9;
        let expected = upper.iter().chain(&lower);
        assert!(bands[0].len() == 8 && bands[0].iter().zip(expected).all(|(a, b)| close(a, b)));

        let medians: Vec<_> = shapes
            .iter()
            .filter_map(|shape| match shape {
                Shape::Segment { ends, stroke } if stroke.color == MEDIAN => Some(*ends),
                _ => None,
            })
            .collect();
        assert_eq!(medians.len(), 3);
        assert!(close(&medians[0][0], &at(0.5, 4.0)) && close(&medians[0][1], &at(1.5, 4.0)));
        // The ends of a line are one pixel long, so that a single column shows.
        assert!(close(&medians[1][1], &(at(1.5, 4.0) + DVec2::X)));
        assert!(close(&medians[2][0], &at(3.5, 3.0)));
    }

    #[test]
    fn the_period_is_marked_at_its_height_if_the_panel_reaches_it() {
        let period = |columns: &Columns| {
            let shapes = graph(columns).shapes;
            shapes.into_iter().find_map(|shape| match shape {
                Shape::Segment { ends, stroke } if stroke.color == PERIOD => Some(ends[0].y),
                _ => None,
            })
        };
        let marked = period(&vec![column(1_000, 1_000, 200_000)]).unwrap();
        assert!((marked - y(5.0)).abs() < 1e-9);
        assert_eq!(period(&vec![column(1_000, 1_000, 2_000)]), None);
    }

    #[test]
    fn times_of_any_length_have_a_scale() {
        assert_eq!(exponents(&vec![None]), [2, 3]);
        assert_eq!(exponents(&vec![column(0, 0, 0)]), [2, 3]);
        assert_eq!(exponents(&vec![column(u64::MAX, u64::MAX, u64::MAX)]), [19, 20]);
        assert_eq!(["100 ns", "1 µs", "10 ms", "1 s"], [2, 3, 7, 9].map(power_of_ten).as_slice());
        assert_eq!(power_of_ten(20), "100000000000 s");
    }

    #[test]
    fn every_step_of_a_short_recording_has_its_number() {
        let numbers = |first, last| {
            let columns = vec![column(1, 1, 1)];
            let title = "run.mcap".to_owned();
            let steps = [first, last];
            let graph =
                Graph { title, steps, period_ns: 1.0, wake_late: &columns, solve: &columns };
            let texts = graph.draw().shapes.into_iter().filter_map(|shape| match shape {
                Shape::Text(text) => text.line.parse::<u64>().ok(),
                _ => None,
            });
            texts.collect::<Vec<_>>()
        };
        assert_eq!(numbers(5, 5), [5, 5]);
        assert_eq!(numbers(5, 7), [5, 6, 7, 5, 6, 7]);
        assert_eq!(numbers(0, u64::MAX)[4], u64::MAX);
    }
}

#[cfg(test)]
mod columns_tests {
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
