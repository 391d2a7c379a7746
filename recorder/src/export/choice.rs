//! Which snapshots of a recording are drawn.

use std::time::Duration;

use anyhow::bail;
use recorder::RunDescription;

/// Most pictures of one call: a folder of more is hardly what was meant.
const FRAMES_MAX: usize = 10_000;

/// Which snapshots are drawn; times are simulated ones after the first snapshot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Choice {
    /// So many, evenly spread from the first to the last one.
    Spread(usize),
    /// One at the start and after each of these times.
    Every(Duration),
    /// Those at, or first after, these times.
    At(Vec<Duration>),
}

impl Choice {
    /// The chosen ones of all `steps` of a recording, which ascend; ascending, each once.
    pub(crate) fn pick(&self, steps: &[u64], run: &RunDescription) -> anyhow::Result<Vec<u64>> {
        let Some(last) = steps.len().checked_sub(1) else { return Ok(Vec::new()) };
        let times_ns: Vec<u64> = steps.iter().map(|step| since(steps[0], *step, run)).collect();
        let first_at = |time_ns: u64| times_ns.partition_point(|one| *one < time_ns);
        let mut places: Vec<usize> = match self {
            Self::Spread(1) => vec![last],
            Self::Spread(count) => {
                let gaps = count.saturating_sub(1).clamp(1, last.max(1));
                (0..=gaps).map(|gap| (last * gap + gaps / 2) / gaps).collect()
            }
            Self::Every(period) => {
                let period_ns = nanoseconds(*period).max(1);
                let next = |place: &usize| {
                    let time_ns = (times_ns[*place] / period_ns + 1).checked_mul(period_ns)?;
                    Some(first_at(time_ns)).filter(|place| *place <= last)
                };
                std::iter::successors(Some(0), next).collect()
            }
            Self::At(times) => times.iter().map(|time| first_at(nanoseconds(*time))).collect(),
        };
        if let (Self::At(times), true) = (self, places.iter().any(|place| *place > last)) {
            let latest =
                humantime::format_duration(times.iter().copied().max().unwrap_or_default());
            let end_s = times_ns[last] as f64 / 1e9;
            bail!("--at {latest} is behind its last snapshot, which is after {end_s:.3} s");
        }
        places.sort_unstable();
        places.dedup();
        if places.len() > FRAMES_MAX {
            bail!("{} pictures are asked for (allowed: up to {FRAMES_MAX})", places.len());
        }
        Ok(places.into_iter().map(|place| steps[place]).collect())
    }
}

/// Simulated time from one step to a later one, in nanoseconds, rounded down.
pub(crate) fn since(first: u64, step: u64, run: &RunDescription) -> u64 {
    let steps = u128::from(step.saturating_sub(first));
    u64::try_from(steps * 1_000_000_000 / u128::from(run.rate_hz)).unwrap_or(u64::MAX)
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::tests::run_of;

    fn pick(choice: &Choice, steps: &[u64]) -> Vec<u64> {
        choice.pick(steps, &run_of(100)).unwrap()
    }

    fn ms(times: &[u64]) -> Choice {
        Choice::At(times.iter().map(|time| Duration::from_millis(*time)).collect())
    }

    #[test]
    fn a_number_of_frames_is_spread_from_the_first_to_the_last() {
        let steps: Vec<u64> = (50..=150).collect();
        assert_eq!(pick(&Choice::Spread(5), &steps), [50, 75, 100, 125, 150]);
        assert_eq!(pick(&Choice::Spread(2), &steps), [50, 150]);
        assert_eq!(pick(&Choice::Spread(1), &steps), [150]);
        assert_eq!(pick(&Choice::Spread(8), &[3, 4, 9]), [3, 4, 9], "no more than there are");
        assert_eq!(pick(&Choice::Spread(8), &[3]), [3]);
        assert!(pick(&Choice::Spread(8), &[]).is_empty());
    }

    #[test]
    fn times_count_from_the_first_snapshot() {
        let steps: Vec<u64> = (50..=150).collect();
        assert_eq!(pick(&ms(&[500, 0, 1000, 500]), &steps), [50, 100, 150]);
        assert_eq!(pick(&ms(&[501]), &steps), [101], "the first one after it");
        let every = |ms| Choice::Every(Duration::from_millis(ms));
        assert_eq!(pick(&every(300), &steps), [50, 80, 110, 140]);
        assert_eq!(pick(&every(1), &steps), steps, "at most each once");
        assert_eq!(pick(&every(100), &[0, 3, 12, 35, 36]), [0, 12, 35], "where there are gaps");
        assert_eq!(pick(&every(5000), &steps), [50]);
    }

    #[test]
    fn what_is_not_there_or_too_much_is_refused() {
        let error = ms(&[10, 1500]).pick(&[0, 100], &run_of(100)).unwrap_err();
        let expected = "--at 1s 500ms is behind its last snapshot, which is after 1.000 s";
        assert_eq!(error.to_string(), expected);
        let steps: Vec<u64> = (0..20_000).collect();
        let error = Choice::Every(Duration::from_millis(10)).pick(&steps, &run_of(100));
        assert_eq!(
            error.unwrap_err().to_string(),
            "20000 pictures are asked for (allowed: up to 10000)"
        );
    }
}
