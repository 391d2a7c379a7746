//! Selects the snapshots to export.

use std::time::Duration;

use anyhow::bail;
use recording::RunDescription;

/// The snapshots to export. Times are simulated times.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Selection {
    pub(crate) range: SnapshotRange,
    pub(crate) choice: Choice,
}

/// A part of a recording. Both ends belong to it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct SnapshotRange {
    pub(crate) from: Option<Moment>,
    pub(crate) to: Option<Moment>,
}

/// A place in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moment {
    Step(u64),
    /// Time after the first snapshot of the recording.
    Time(Duration),
}

/// The snapshots of the range.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) enum Choice {
    /// Every snapshot.
    #[default]
    All,
    /// This many snapshots, evenly spaced from the first to the last one.
    Spread(usize),
    /// The first snapshot, and one after each period.
    Every(Duration),
    /// The first snapshot at or after each of these times after the first snapshot of the recording.
    At(Vec<Duration>),
}

impl Selection {
    /// Selects from `steps`, which ascend. The result ascends and has no duplicates. It is empty only if
    /// `steps` is.
    pub(crate) fn select(&self, steps: &[u64], rate_hz: u32) -> anyhow::Result<Vec<u64>> {
        let Some(first) = steps.first() else { return Ok(Vec::new()) };
        let times = Times { first: *first, rate_hz };
        self.choice.select(self.range.part(steps, times)?, times)
    }
}

/// Converts steps to times after the first snapshot of the recording.
#[derive(Debug, Clone, Copy)]
struct Times {
    first: u64,
    rate_hz: u32,
}

impl Times {
    fn ns(self, step: u64) -> u64 {
        RunDescription::duration_ns(step.saturating_sub(self.first), self.rate_hz)
    }

    fn seconds(self, step: u64) -> f64 {
        self.ns(step) as f64 / 1e9
    }
}

impl Moment {
    fn is_after(self, step: u64, times: Times) -> bool {
        match self {
            Self::Step(moment) => step < moment,
            Self::Time(time) => times.ns(step) < nanoseconds(time),
        }
    }

    fn is_before(self, step: u64, times: Times) -> bool {
        match self {
            Self::Step(moment) => step > moment,
            Self::Time(time) => times.ns(step) > nanoseconds(time),
        }
    }
}

impl SnapshotRange {
    /// Returns the steps of the range. `steps` is not empty.
    fn part(self, steps: &[u64], times: Times) -> anyhow::Result<&[u64]> {
        let start =
            self.from.map_or(0, |from| steps.partition_point(|step| from.is_after(*step, times)));
        let end = self
            .to
            .map_or(steps.len(), |to| steps.partition_point(|step| !to.is_before(*step, times)));
        if start < end {
            return Ok(&steps[start..end]);
        }
        let (first, last) = (steps[0], steps[steps.len() - 1]);
        let end_s = times.seconds(last);
        bail!(
            "--from and --to select no snapshot: its steps are {first} (0 s) to {last} ({end_s:.3} s)"
        )
    }
}

impl Choice {
    /// Returns the chosen steps. `steps` is not empty.
    fn select(&self, steps: &[u64], times: Times) -> anyhow::Result<Vec<u64>> {
        let last = steps.len() - 1;
        let mut places = match self {
            // A list of their positions would take as much memory again.
            Self::All => return Ok(steps.to_vec()),
            Self::Spread(1) => vec![last],
            Self::Spread(count) => {
                let gaps = count.saturating_sub(1).clamp(1, last.max(1));
                (0..=gaps).map(|gap| (last * gap + gaps / 2) / gaps).collect()
            }
            Self::Every(period) => places_of_periods(steps, *period, times),
            Self::At(moments) => {
                let first_at = |at_ns| steps.partition_point(|step| times.ns(*step) < at_ns);
                let places: Vec<_> = moments.iter().map(|at| first_at(nanoseconds(*at))).collect();
                if places.iter().any(|place| *place > last) {
                    let latest = moments.iter().copied().max().unwrap_or_default();
                    let latest = humantime::format_duration(latest);
                    let end_s = times.seconds(steps[last]);
                    bail!("--at {latest} is after its last snapshot, which is at {end_s:.3} s");
                }
                places
            }
        };
        places.sort_unstable();
        places.dedup();
        Ok(places.into_iter().map(|place| steps[place]).collect())
    }
}

/// Returns the position of the first step, and of the first one after each period.
fn places_of_periods(steps: &[u64], period: Duration, times: Times) -> Vec<usize> {
    let period_ns = nanoseconds(period).max(1);
    let time_ns = |step: u64| times.ns(step) - times.ns(steps[0]);
    let next = |place: &usize| {
        let at_ns = (time_ns(steps[*place]) / period_ns + 1).checked_mul(period_ns)?;
        let next = steps.partition_point(|step| time_ns(*step) < at_ns);
        (next < steps.len()).then_some(next)
    };
    std::iter::successors(Some(0), next).collect()
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod selection_tests {
    use super::*;

    const RATE_HZ: u32 = 100;

    fn select(choice: Choice, steps: &[u64]) -> Vec<u64> {
        Selection { choice, ..Selection::default() }.select(steps, RATE_HZ).unwrap()
    }

    fn ms(time: u64) -> Duration {
        Duration::from_millis(time)
    }

    fn at_ms(times: &[u64]) -> Choice {
        Choice::At(times.iter().copied().map(ms).collect())
    }

    #[test]
    fn a_number_of_frames_is_spread_from_the_first_to_the_last() {
        let steps: Vec<u64> = (50..=150).collect();
        assert_eq!(select(Choice::Spread(5), &steps), [50, 75, 100, 125, 150]);
        assert_eq!(select(Choice::Spread(2), &steps), [50, 150]);
        assert_eq!(select(Choice::Spread(1), &steps), [150]);
        assert_eq!(select(Choice::Spread(8), &[3, 4, 9]), [3, 4, 9], "no more than exist");
        assert_eq!(select(Choice::Spread(8), &[3]), [3]);
        assert!(select(Choice::Spread(8), &[]).is_empty());
    }

    #[test]
    fn times_count_from_the_first_snapshot() {
        let steps: Vec<u64> = (50..=150).collect();
        assert_eq!(select(at_ms(&[500, 0, 1000, 500]), &steps), [50, 100, 150]);
        assert_eq!(select(at_ms(&[501]), &steps), [101], "the first one after it");
        let every = |time| Choice::Every(ms(time));
        assert_eq!(select(every(300), &steps), [50, 80, 110, 140]);
        assert_eq!(select(every(1), &steps), steps, "each one at most once");
        assert_eq!(select(every(100), &[0, 3, 12, 35, 36]), [0, 12, 35], "with gaps");
        assert_eq!(select(every(5000), &steps), [50]);
    }

    #[test]
    fn a_range_has_both_ends_and_periods_count_from_its_start() {
        let steps: Vec<u64> = (50..=150).collect();
        let within = |from, to, choice| {
            let range = SnapshotRange { from, to };
            Selection { range, choice }.select(&steps, RATE_HZ).unwrap()
        };
        let (from, to) = (Some(Moment::Time(ms(105))), Some(Moment::Time(ms(140))));
        assert_eq!(within(from, to, Choice::All), [61, 62, 63, 64]);
        let (from, to) = (Some(Moment::Step(60)), Some(Moment::Step(62)));
        assert_eq!(within(from, to, Choice::All), [60, 61, 62]);
        assert_eq!(within(None, to, Choice::Spread(2)), [50, 62]);
        assert_eq!(within(Some(Moment::Step(61)), None, Choice::Every(ms(400))), [61, 101, 141]);
    }

    #[test]
    fn a_range_without_a_snapshot_is_refused_with_those_that_exist() {
        let selected = |from, to| {
            let range = SnapshotRange { from, to };
            let choice = Choice::All;
            Selection { range, choice }.select(&[50, 60], RATE_HZ).unwrap_err().to_string()
        };
        let expected = "--from and --to select no snapshot: its steps are 50 (0 s) to 60 (0.100 s)";
        assert_eq!(selected(Some(Moment::Time(ms(101))), None), expected);
        assert_eq!(selected(None, Some(Moment::Step(49))), expected);
        assert_eq!(selected(Some(Moment::Step(51)), Some(Moment::Step(59))), expected);
        assert_eq!(selected(Some(Moment::Step(60)), Some(Moment::Step(50))), expected);
    }

    #[test]
    fn a_time_after_the_end_is_refused() {
        let selection = Selection { choice: at_ms(&[10, 1500]), ..Selection::default() };
        let error = selection.select(&[0, 100], RATE_HZ).unwrap_err();
        let expected = "--at 1s 500ms is after its last snapshot, which is at 1.000 s";
        assert_eq!(error.to_string(), expected);
    }
}
