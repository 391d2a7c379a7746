//! Draws wake-up lateness and solver time over the steps.

use glam::DVec2;

use super::columns::{Column, Columns};
use crate::export::shape::{Color, Dash, Picture, Shape, Size, Stroke, Text};

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
