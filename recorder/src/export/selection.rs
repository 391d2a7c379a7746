//! Selects the snapshots to draw.

use std::time::Duration;

use anyhow::bail;
use recorder::RunDescription;

/// Most pictures of one call. A higher number is probably a mistake.
const FRAMES_MAX: usize = 10_000;

/// The snapshots to draw. Times are simulated times after the first snapshot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Selection {
    /// This many snapshots, evenly spaced from the first to the last one.
    Spread(usize),
    /// The first snapshot, and one after each period.
    Every(Duration),
    /// The first snapshot at or after each of these times.
    At(Vec<Duration>),
}

impl Selection {
    /// Selects from `steps`, which ascend. The result ascends and has no duplicates.
    pub(crate) fn select(&self, steps: &[u64], rate_hz: u32) -> anyhow::Result<Vec<u64>> {
        let Some(last) = steps.len().checked_sub(1) else { return Ok(Vec::new()) };
        let time_ns =
            |step: &u64| RunDescription::duration_ns(step.saturating_sub(steps[0]), rate_hz);
        let first_at = |at_ns: u64| steps.partition_point(|step| time_ns(step) < at_ns);
        let mut places: Vec<usize> = match self {
            Self::Spread(1) => vec![last],
            Self::Spread(count) => {
                let gaps = count.saturating_sub(1).clamp(1, last.max(1));
                (0..=gaps).map(|gap| (last * gap + gaps / 2) / gaps).collect()
            }
            Self::Every(period) => {
                let period_ns = nanoseconds(*period).max(1);
                let next = |place: &usize| {
                    let time_ns =
                        (time_ns(&steps[*place]) / period_ns + 1).checked_mul(period_ns)?;
                    Some(first_at(time_ns)).filter(|place| *place <= last)
                };
                std::iter::successors(Some(0), next).collect()
            }
            Self::At(times) => times.iter().map(|time| first_at(nanoseconds(*time))).collect(),
        };
        if let (Self::At(times), true) = (self, places.iter().any(|place| *place > last)) {
            let latest =
                humantime::format_duration(times.iter().copied().max().unwrap_or_default());
            let end_s = time_ns(&steps[last]) as f64 / 1e9;
            bail!("--at {latest} is after its last snapshot, which is at {end_s:.3} s");
        }
        places.sort_unstable();
        places.dedup();
        if places.len() > FRAMES_MAX {
            bail!("the options select {} pictures (allowed: up to {FRAMES_MAX})", places.len());
        }
        Ok(places.into_iter().map(|place| steps[place]).collect())
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE_HZ: u32 = 100;

    fn select(selection: &Selection, steps: &[u64]) -> Vec<u64> {
        selection.select(steps, RATE_HZ).unwrap()
    }

    fn at_ms(times: &[u64]) -> Selection {
        Selection::At(times.iter().map(|time| Duration::from_millis(*time)).collect())
    }

    #[test]
    fn a_number_of_frames_is_spread_from_the_first_to_the_last() {
        let steps: Vec<u64> = (50..=150).collect();
        assert_eq!(select(&Selection::Spread(5), &steps), [50, 75, 100, 125, 150]);
        assert_eq!(select(&Selection::Spread(2), &steps), [50, 150]);
        assert_eq!(select(&Selection::Spread(1), &steps), [150]);
        assert_eq!(select(&Selection::Spread(8), &[3, 4, 9]), [3, 4, 9], "no more than exist");
        assert_eq!(select(&Selection::Spread(8), &[3]), [3]);
        assert!(select(&Selection::Spread(8), &[]).is_empty());
    }

    #[test]
    fn times_count_from_the_first_snapshot() {
        let steps: Vec<u64> = (50..=150).collect();
        assert_eq!(select(&at_ms(&[500, 0, 1000, 500]), &steps), [50, 100, 150]);
        assert_eq!(select(&at_ms(&[501]), &steps), [101], "the first one after it");
        let every = |ms| Selection::Every(Duration::from_millis(ms));
        assert_eq!(select(&every(300), &steps), [50, 80, 110, 140]);
        assert_eq!(select(&every(1), &steps), steps, "each one at most once");
        assert_eq!(select(&every(100), &[0, 3, 12, 35, 36]), [0, 12, 35], "with gaps");
        assert_eq!(select(&every(5000), &steps), [50]);
    }

    #[test]
    fn a_time_after_the_end_and_too_many_pictures_are_refused() {
        let error = at_ms(&[10, 1500]).select(&[0, 100], RATE_HZ).unwrap_err();
        let expected = "--at 1s 500ms is after its last snapshot, which is at 1.000 s";
        assert_eq!(error.to_string(), expected);
        let steps: Vec<u64> = (0..20_000).collect();
        let error = Selection::Every(Duration::from_millis(10)).select(&steps, RATE_HZ);
        let expected = "the options select 20000 pictures (allowed: up to 10000)";
        assert_eq!(error.unwrap_err().to_string(), expected);
    }
}
