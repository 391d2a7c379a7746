//! Division of the rows of a sheet among workers.

use std::ops::Range;

use super::span::Span;
use crate::store::rows::RowLayout;

/// Number of particles in a sheet from which on several threads are faster than one.
const SHARED_MIN: usize = 4000;

/// Bands of rows, one for each worker, for a pass whose stages reach down some rows in all.
///
/// A worker sweeps its band, which finishes a trapezoid of it (see [`Span`]). Then it sweeps the seam to the next band,
/// which needs only the first rows of that one, its head. The worker there finishes them early, so nobody waits for a whole
/// band.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bands {
    row_count: usize,
    pub(crate) count: usize,
    reach: usize,
}

impl Bands {
    /// One band if the sheet is small. Otherwise each is so high that its seam is a small part of it.
    pub(crate) fn new(layout: &RowLayout, workers: usize, reach: usize) -> Self {
        let is_small = layout.rows * layout.columns < SHARED_MIN;
        let count_max = if is_small { 1 } else { layout.rows / (4 * reach + 1) };
        Self { row_count: layout.rows, count: workers.min(count_max).max(1), reach }
    }

    pub(crate) fn rows(&self, band: usize) -> Range<usize> {
        self.first(band)..self.first(band + 1)
    }

    /// First row of a band. A seam is as much work as `reach` rows. The last band has none below it, so all
    /// others begin half as much higher.
    fn first(&self, band: usize) -> usize {
        match band {
            0 => 0,
            band if band == self.count => self.row_count,
            band => band * self.row_count / self.count - self.reach / 2,
        }
    }

    pub(crate) fn span(&self, band: usize) -> Span {
        Span::new(self.rows(band), self.row_count)
    }

    /// The rows of a band that the seam above needs, and the front at which all stages have left them.
    pub(crate) fn head(&self, band: usize) -> (Range<usize>, usize) {
        let first = self.first(band);
        (first..first + self.reach, first + 2 * self.reach)
    }

    /// The rows of the seam below a band.
    pub(crate) fn seam(&self, band: usize) -> Option<(Range<usize>, Span)> {
        let next = self.first(band + 1);
        let has_seam = self.reach > 0 && band + 1 < self.count;
        has_seam.then(|| (next - self.reach..next + self.reach, Span::seam(next)))
    }
}

#[cfg(test)]
mod tests {
    //! Every stage runs once on every row, after the stages before it on the rows that it needs.
    use super::*;

    const STAGES: usize = 6;

    /// Reaches of the stages of a pass, with an even sum, an odd one, and none.
    const PASSES: [[usize; STAGES]; 3] = [[0, 1, 1, 2, 0, 2], [0, 1, 1, 0, 2, 1], [0; STAGES]];

    /// The stages that have run, by row.
    struct Sheet {
        reaches: [usize; STAGES],
        done: Vec<[bool; STAGES]>,
    }

    impl Sheet {
        /// Runs the stages of a span while the wave is at these fronts, and checks that it stays within `rows`.
        fn sweep(&mut self, rows: Range<usize>, mut span: Span, fronts: Range<usize>) {
            let mut lag = 0;
            let stages = self.reaches.map(|reach| {
                lag += reach;
                (span.advance(reach), lag)
            });
            for front in fronts.start..fronts.end.min(self.done.len() + lag) {
                let at_front = stages.iter().map(|(rows, lag)| (rows, front.wrapping_sub(*lag)));
                let at_front = at_front.enumerate().filter(|(_, (rows, row))| rows.contains(row));
                for (stage, (_, row)) in at_front {
                    assert!(rows.contains(&row) && row + self.reaches[stage] < rows.end);
                    self.run(stage, row);
                }
            }
        }

        fn run(&mut self, stage: usize, row: usize) {
            for (needed, reach) in self.reaches.into_iter().enumerate().take(stage) {
                // Those that move a row of this constraint. The last rows begin none.
                let last = (row + self.reaches[stage] + 1).min(self.done.len() - reach);
                let is_ready = (row.saturating_sub(reach)..last).all(|row| self.done[row][needed]);
                assert!(is_ready, "stage {stage} before stage {needed} on row {row}");
            }
            assert!(!self.done[row][stage], "stage {stage} runs twice on row {row}");
            self.done[row][stage] = true;
        }
    }

    /// The parts of a sheet that threads use at the same time do not overlap.
    fn assert_disjoint(bands: &Bands) {
        for band in 1..bands.count {
            let (above, below) = (bands.rows(band - 1), bands.rows(band));
            assert_eq!(above.end, below.start);
            // The seam begins when the band above is finished and the head below is left.
            if let Some((seam, _)) = bands.seam(band - 1) {
                assert!(seam.start >= bands.head(band - 1).0.end, "it has rows of the seam before");
                assert_eq!(seam.end, bands.head(band).0.end, "it has rows behind the head");
            }
        }
    }

    fn sweep_all(bands: &Bands, reaches: [usize; STAGES]) {
        let row_count = bands.row_count;
        let mut sheet = Sheet { reaches, done: vec![[false; STAGES]; row_count] };
        // No band waits for another one before its head is finished.
        for band in 0..bands.count {
            sheet.sweep(bands.rows(band), bands.span(band), 0..bands.head(band).1);
        }
        for band in 0..bands.count {
            let (head, front) = bands.head(band);
            let rest = head.end..bands.rows(band).end;
            sheet.sweep(rest, bands.span(band), front..usize::MAX);
            if let Some((rows, span)) = bands.seam(band) {
                sheet.sweep(rows, span, 0..usize::MAX);
            }
        }
        for (row, done) in sheet.done.iter().enumerate() {
            let expected = reaches.map(|reach| row + reach < row_count);
            assert_eq!(*done, expected, "row {row} of {row_count}, {} bands", bands.count);
        }
    }

    #[test]
    fn every_stage_runs_once_on_every_row_after_those_before_it() {
        for reaches in PASSES {
            let reach = reaches.iter().sum();
            for (row_count, workers) in [75, 76, 99, 100, 101, 317]
                .into_iter()
                .flat_map(|rows| (1..=9).map(move |workers| (rows, workers)))
            {
                let bands = Bands::new(&RowLayout::new(0, [row_count, 100], 112), workers, reach);
                assert_eq!(bands.count, workers.min(row_count / (4 * reach + 1)));
                assert_disjoint(&bands);
                sweep_all(&bands, reaches);
            }
        }
    }

    #[test]
    fn small_sheets_are_not_divided() {
        let count = |rows, columns, reach| {
            Bands::new(&RowLayout::new(0, [rows, columns], columns), 4, reach).count
        };
        assert_eq!(count(63, 63, 6), 1);
        assert_eq!(count(64, 64, 6), 2);
        assert_eq!(count(4, 10_000, 1), 1, "no row is far enough from both ends");
    }
}
