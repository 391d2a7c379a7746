//! Spans of rows that one worker takes through a pass.

use std::ops::Range;

/// Rows of a sheet that are processed together.
///
/// Rows next to those of another worker cannot all be finished: each family narrows a span by its
/// reach on both sides, so the finished rows form a trapezoid. The rest, between two spans, is a
/// seam, which widens as the spans narrow.
#[derive(Debug, Clone)]
pub(crate) struct Span {
    rows: Range<usize>,
    kind: SpanKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SpanKind {
    /// It touches the first or the last row of the sheet, or neither.
    Rows {
        is_first: bool,
        is_last: bool,
    },
    Seam,
}

impl Span {
    /// Some rows of a sheet of `row_count`.
    pub(crate) fn new(rows: Range<usize>, row_count: usize) -> Self {
        let kind = SpanKind::Rows { is_first: rows.start == 0, is_last: rows.end == row_count };
        Self { rows, kind }
    }

    /// The seam between two spans that meet at a row.
    pub(crate) fn seam(row: usize) -> Self {
        Self { rows: row..row, kind: SpanKind::Seam }
    }

    /// Returns the rows on which the next stage runs, and marks them as done.
    pub(crate) fn advance(&mut self, reach: usize) -> Range<usize> {
        let Range { start, end } = self.rows;
        match self.kind {
            SpanKind::Rows { is_first, is_last } => {
                let last = end.saturating_sub(reach);
                let next = if is_first { start } else { start + reach };
                self.rows = next..if is_last { end } else { last };
                start..last
            }
            SpanKind::Seam => {
                self.rows = start - reach..end + reach;
                start - reach..end
            }
        }
    }
}
