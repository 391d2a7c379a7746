//! Samples of a time, and their percentiles.

use anyhow::Context;
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

use crate::node::TIME_NS_MAX;

/// Recorded times in nanoseconds.
#[derive(Debug, Clone)]
pub(super) struct Samples(Histogram<u64>);

/// Samples as text: each recorded time with its count.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct SampleList(Vec<(u64, u64)>);

/// Percentiles of recorded times; all are 0 if there is no sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub(super) struct Percentiles {
    pub(super) count: u64,
    pub(super) p50_ns: u64,
    pub(super) p99_ns: u64,
    pub(super) p999_ns: u64,
    pub(super) max_ns: u64,
}

impl Samples {
    pub(super) fn new() -> anyhow::Result<Self> {
        let histogram = Histogram::new_with_bounds(1, TIME_NS_MAX, 3);
        Ok(Self(histogram.context("creating the histograms")?))
    }

    pub(super) fn record(&mut self, time_ns: u64) {
        self.0.saturating_record(time_ns);
    }

    pub(super) fn add(&mut self, histogram: &Histogram<u64>) {
        for sample in histogram.iter_recorded() {
            self.add_count(sample.value_iterated_to(), sample.count_at_value());
        }
    }

    pub(super) fn add_list(&mut self, list: &SampleList) {
        for (time_ns, count) in &list.0 {
            self.add_count(*time_ns, *count);
        }
    }

    fn add_count(&mut self, time_ns: u64, count: u64) {
        self.0.saturating_record_n(time_ns, count);
    }

    pub(super) fn list(&self) -> SampleList {
        let samples = self.0.iter_recorded();
        SampleList(samples.map(|one| (one.value_iterated_to(), one.count_at_value())).collect())
    }

    pub(super) fn percentiles(&self) -> Percentiles {
        let quantile = |quantile| self.0.value_at_quantile(quantile);
        Percentiles {
            count: self.0.len(),
            p50_ns: quantile(0.5),
            p99_ns: quantile(0.99),
            p999_ns: quantile(0.999),
            max_ns: self.0.max(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_survive_the_way_as_a_list_and_the_sum_of_lists() {
        let mut samples = Samples::new().unwrap();
        for time_ns in 1..=1000 {
            samples.record(time_ns);
        }
        let json = serde_json::to_string(&samples.list()).unwrap();
        let mut sum = Samples::new().unwrap();
        sum.add_list(&serde_json::from_str(&json).unwrap());
        sum.add(&samples.0);
        let expected =
            Percentiles { count: 2000, p50_ns: 500, p99_ns: 990, p999_ns: 999, max_ns: 1000 };
        assert_eq!(sum.percentiles(), expected);
        assert_eq!(Samples::new().unwrap().percentiles().max_ns, 0);
    }
}
