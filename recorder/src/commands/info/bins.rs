//! A histogram of times with the limits 1, 2, 5, 10, 20, 50, ... µs.

use std::fmt;

use serde::Serialize;

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
