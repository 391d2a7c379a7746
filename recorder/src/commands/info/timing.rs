//! The measured times of the steps: percentiles and histograms, in bounded memory.

use std::fmt;

use hdrhistogram::Histogram;
use recording::StepRow;
use serde::Serialize;

/// Significant digits of a percentile.
const DIGITS: u8 = 3;

/// Collects the times of the steps of a recording.
#[derive(Debug)]
pub(super) struct TimingCollector {
    rate_hz: u32,
    /// First and last measured step.
    steps: Option<[u64; 2]>,
    measured_count: u64,
    late_count: u64,
    wake_late: TimeCollector,
    solve: TimeCollector,
}

/// The measured times of the steps, as printed.
#[derive(Debug, PartialEq, Serialize)]
pub(super) struct Timing {
    /// First and last step with measured times.
    #[serde(skip)]
    pub(super) steps: [u64; 2],
    /// Recorded steps with measured times.
    pub(super) measured_steps: u64,
    /// Those whose wake-up was more than a period of the scene's rate late.
    pub(super) late_steps: u64,
    pub(super) period_us: f64,
    /// Delay of a step after its deadline.
    pub(super) wake_late: TimeSummary,
    /// Computing time of the solver.
    pub(super) solve: TimeSummary,
}

/// The distribution of one of the times of a step.
#[derive(Debug, PartialEq, Serialize)]
pub(super) struct TimeSummary {
    /// At least half of the times are up to this one, to three digits.
    pub(super) p50_us: f64,
    pub(super) p99_us: f64,
    /// Exact.
    pub(super) max_us: f64,
    pub(super) bins: Vec<Bin>,
}

/// Returns `true` for the row of a step whose times were measured. A simulation measures none, and the
/// state before the first step took no time.
pub(super) fn is_measured(row: &StepRow) -> bool {
    row.solve_ns > 0
}

/// Returns a histogram of times of any length, in about 0.5 MB of memory.
pub(super) fn histogram() -> anyhow::Result<Histogram<u64>> {
    Ok(Histogram::new_with_bounds(1, u64::MAX, DIGITS)?)
}

/// Returns the period of a rate, in ns.
pub(super) fn period_ns(rate_hz: u32) -> f64 {
    1e9 / f64::from(rate_hz)
}

impl TimingCollector {
    pub(super) fn new(rate_hz: u32) -> anyhow::Result<Self> {
        let (wake_late, solve) = (TimeCollector::new()?, TimeCollector::new()?);
        Ok(Self { rate_hz, steps: None, measured_count: 0, late_count: 0, wake_late, solve })
    }

    pub(super) fn add(&mut self, row: &StepRow) {
        if !is_measured(row) {
            return;
        }
        let [first, last] = self.steps.unwrap_or([row.step; 2]);
        self.steps = Some([first.min(row.step), last.max(row.step)]);
        self.measured_count += 1;
        self.late_count += u64::from(row.wake_late_ns as f64 > period_ns(self.rate_hz));
        self.wake_late.add(row.wake_late_ns);
        self.solve.add(row.solve_ns);
    }

    /// Returns the times. `None` if there are none.
    pub(super) fn timing(&self) -> Option<Timing> {
        self.steps.map(|steps| Timing {
            steps,
            measured_steps: self.measured_count,
            late_steps: self.late_count,
            period_us: period_ns(self.rate_hz) / 1e3,
            wake_late: self.wake_late.summary(),
            solve: self.solve.summary(),
        })
    }
}

/// Collects one of the times of each step.
#[derive(Debug)]
struct TimeCollector {
    histogram: Histogram<u64>,
    bins: Bins,
    max_ns: u64,
}

impl TimeCollector {
    fn new() -> anyhow::Result<Self> {
        Ok(Self { histogram: histogram()?, bins: Bins::default(), max_ns: 0 })
    }

    fn add(&mut self, time_ns: u64) {
        self.histogram.saturating_record(time_ns);
        self.bins.add(time_ns);
        self.max_ns = self.max_ns.max(time_ns);
    }

    fn summary(&self) -> TimeSummary {
        let micros = |time_ns: u64| time_ns as f64 / 1e3;
        // A value of the histogram stands for a range, whose end can be above the greatest time.
        let quantile = |share| micros(self.histogram.value_at_quantile(share).min(self.max_ns));
        TimeSummary {
            p50_us: quantile(0.5),
            p99_us: quantile(0.99),
            max_us: micros(self.max_ns),
            bins: self.bins.shown(),
        }
    }
}

impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "late        {} of {} measured steps woke up more than a period ({:.1} µs) late",
            self.late_steps, self.measured_steps, self.period_us
        )?;
        write!(f, "\nwake-up lateness: {}\n\nsolver time: {}", self.wake_late, self.solve)
    }
}

impl fmt::Display for TimeSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { p50_us, p99_us, max_us, bins } = self;
        let bars = Bars(bins);
        write!(f, "p50 {p50_us:.1} µs, p99 {p99_us:.1} µs, max {max_us:.1} µs{bars}")
    }
}

/// Limits between two bins, in µs. The last bin has no upper limit.
const LIMITS_US: [u64; 22] = [
    1, 2, 5, 10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000,
    200_000, 500_000, 1_000_000, 2_000_000, 5_000_000, 10_000_000,
];
/// Most bins that are shown. They span four decades; the lowest one includes all shorter times.
const SHOWN_MAX: usize = 12;
/// Length of the longest bar, in characters.
const BAR_LENGTH: u64 = 40;

const NS_PER_US: u64 = 1000;

/// Number of times in each bin.
#[derive(Debug, Clone, Default)]
pub(super) struct Bins([u64; LIMITS_US.len() + 1]);

/// A bin with its limits: `from_us` <= time < `to_us`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct Bin {
    pub(super) from_us: u64,
    /// `None` for the last bin.
    pub(super) to_us: Option<u64>,
    pub(super) count: u64,
}

impl Bins {
    pub(super) fn add(&mut self, time_ns: u64) {
        let index = LIMITS_US.partition_point(|limit_us| limit_us * NS_PER_US <= time_ns);
        self.0[index] += 1;
    }

    /// Returns the bins from the first to the last one with a time.
    pub(super) fn shown(&self) -> Vec<Bin> {
        let is_filled = |count: &u64| *count > 0;
        let (Some(first), Some(last)) =
            (self.0.iter().position(is_filled), self.0.iter().rposition(is_filled))
        else {
            return Vec::new();
        };
        let start = first.max((last + 1).saturating_sub(SHOWN_MAX));
        let mut shown: Vec<_> = (start..=last).map(|index| self.bin(index)).collect();
        if start > first {
            shown[0] = Bin { from_us: 0, count: self.0[..=start].iter().sum(), ..shown[0] };
        }
        shown
    }

    fn bin(&self, index: usize) -> Bin {
        let from_us = index.checked_sub(1).map_or(0, |below| LIMITS_US[below]);
        Bin { from_us, to_us: LIMITS_US.get(index).copied(), count: self.0[index] }
    }
}

/// Bins as lines of text, each after a line break, with bars in proportion to the counts.
pub(super) struct Bars<'a>(pub(super) &'a [Bin]);

impl fmt::Display for Bars<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let greatest = self.0.iter().map(|bin| bin.count).max().unwrap_or(0).max(1);
        for bin in self.0 {
            let limits = match bin.to_us {
                Some(to_us) => format!("{} to {to_us} µs", bin.from_us),
                None => format!("from {} µs", bin.from_us),
            };
            let line = format!("{limits:>24} {:>10}  {}", bin.count, bar(bin.count, greatest));
            write!(f, "\n{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// Returns a bar for a count. Only that of an empty bin is empty.
fn bar(count: u64, greatest: u64) -> String {
    let length = u128::from(count) * u128::from(BAR_LENGTH) / u128::from(greatest);
    let length = usize::try_from(length).unwrap_or(0).max(usize::from(count > 0));
    "#".repeat(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timing(times_ns: impl Iterator<Item = [u64; 2]>, rate_hz: u32) -> Option<Timing> {
        let mut collector = TimingCollector::new(rate_hz).unwrap();
        for [wake_late_ns, solve_ns] in times_ns {
            collector.add(&StepRow { wake_late_ns, solve_ns, ..StepRow::default() });
        }
        collector.timing()
    }

    fn assert_close(value: f64, expected: f64) {
        assert!((value - expected).abs() <= expected * 1e-3, "{value} is not {expected}");
    }

    #[test]
    fn percentiles_of_evenly_spread_times_are_their_ranks() {
        // 1 to 1000 µs late, in an order of its own, and twice that for the solver.
        let times = (0..1000).map(|index| (index * 7 % 1000 + 1) * 1000).map(|ns| [ns, 2 * ns]);
        let timing = timing(times, 240).unwrap();
        for (summary, factor) in [(&timing.wake_late, 1.0), (&timing.solve, 2.0)] {
            assert_close(summary.p50_us, 500.0 * factor);
            assert_close(summary.p99_us, 990.0 * factor);
            assert_eq!(summary.max_us, 1000.0 * factor);
        }
        let counts: Vec<_> = timing.wake_late.bins.iter().map(|bin| bin.count).collect();
        assert_eq!(counts, [1, 3, 5, 10, 30, 50, 100, 300, 500, 1]);
        assert_eq!((timing.measured_steps, timing.late_steps), (1000, 0));
    }

    #[test]
    fn a_step_is_late_if_it_wakes_up_more_than_a_period_late() {
        let times = [999_999, 1_000_000, 1_000_001, u64::MAX].map(|ns| [ns, 1]);
        let timing = timing(times.into_iter(), 1000).unwrap();
        assert_eq!((timing.measured_steps, timing.late_steps), (4, 2));
        assert_eq!(timing.period_us, 1000.0);
    }

    #[test]
    fn steps_without_measured_times_are_left_out() {
        assert_eq!(timing([[0, 0]].into_iter(), 240), None);
        let timing = timing([[0, 0], [0, 5000], [0, 0]].into_iter(), 240).unwrap();
        assert_eq!((timing.measured_steps, timing.solve.p50_us), (1, 5.0));
    }
}

#[cfg(test)]
mod bins_tests {
    use super::*;

    fn bins(times_ns: &[u64]) -> Vec<Bin> {
        let mut bins = Bins::default();
        for time_ns in times_ns {
            bins.add(*time_ns);
        }
        bins.shown()
    }

    #[test]
    fn a_limit_belongs_to_the_bin_above_it() {
        let bin = |from_us, to_us, count| Bin { from_us, to_us, count };
        assert_eq!(bins(&[]), []);
        assert_eq!(bins(&[0, 999]), [bin(0, Some(1), 2)]);
        assert_eq!(
            bins(&[1_999, 2_000, 4_999, 10_000]),
            [bin(1, Some(2), 1), bin(2, Some(5), 2), bin(5, Some(10), 0), bin(10, Some(20), 1)]
        );
        assert_eq!(bins(&[u64::MAX]), [bin(10_000_000, None, 1)]);
    }

    #[test]
    fn the_lowest_of_twelve_bins_includes_all_shorter_times() {
        let shown = bins(&[0, 5_000, 30_000, 150_000_000]);
        assert_eq!(shown.len(), SHOWN_MAX);
        assert_eq!(shown[0], Bin { from_us: 0, to_us: Some(50), count: 3 });
        assert_eq!(shown[11], Bin { from_us: 100_000, to_us: Some(200_000), count: 1 });
        assert_eq!(shown.iter().map(|bin| bin.count).sum::<u64>(), 4);
    }

    #[test]
    fn the_longest_bar_has_forty_characters_and_a_single_time_at_least_one() {
        assert_eq!((bar(500, 500).len(), bar(250, 500).len()), (40, 20));
        assert_eq!((bar(1, 500).len(), bar(0, 500).len()), (1, 0));
        assert_eq!(bar(u64::MAX, u64::MAX).len(), 40);
    }
}
