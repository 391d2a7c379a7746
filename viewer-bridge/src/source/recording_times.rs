//! Times of the steps of a recording.

use recording::RunDescription;
use sim_host::clock::SECOND_NS;

/// Times of the steps of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordingTimes {
    /// Time of step 0, in ns since 1970. The recording may begin later.
    pub epoch_ns: u64,
    /// Steps per second.
    pub rate_hz: u32,
    /// First recorded step.
    pub first_step: u64,
    /// Last recorded step.
    pub last_step: u64,
}

impl RecordingTimes {
    /// Time of a step, in ns since 1970.
    pub(crate) fn time_ns(&self, step: u64) -> u64 {
        self.epoch_ns.saturating_add(RunDescription::duration_ns(step, self.rate_hz))
    }

    /// Time of the first step, in ns since 1970.
    pub(crate) fn first_ns(&self) -> u64 {
        self.time_ns(self.first_step)
    }

    /// Time of the last step, in ns since 1970.
    pub(crate) fn last_ns(&self) -> u64 {
        self.time_ns(self.last_step)
    }

    /// Returns the last step at or before a time, within the recording.
    pub(crate) fn step_at(&self, time_ns: u64) -> u64 {
        // The time of a step is rounded down to whole ns, so the search begins 1 ns later.
        let elapsed_ns = u128::from(time_ns.saturating_sub(self.epoch_ns)) + 1;
        let step = (elapsed_ns * u128::from(self.rate_hz) - 1) / u128::from(SECOND_NS);
        let step = u64::try_from(step).unwrap_or(u64::MAX);
        step.clamp(self.first_step, self.last_step.max(self.first_step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMES: RecordingTimes =
        RecordingTimes { epoch_ns: 5 * SECOND_NS, rate_hz: 240, first_step: 60, last_step: 600 };

    #[test]
    fn a_step_is_found_from_its_time_until_the_next_step() {
        for rate_hz in [1, 7, 60, 240, 1000, 99_999] {
            let times = RecordingTimes { rate_hz, first_step: 0, last_step: 100_000, ..TIMES };
            for step in (0..1000).chain([99_999]) {
                assert_eq!(times.step_at(times.time_ns(step)), step, "{rate_hz} Hz");
                assert_eq!(times.step_at(times.time_ns(step + 1) - 1), step, "{rate_hz} Hz");
            }
        }
    }

    #[test]
    fn a_time_outside_the_recording_is_its_first_or_last_step() {
        assert_eq!((TIMES.first_ns(), TIMES.last_ns()), (5_250_000_000, 7_500_000_000));
        assert_eq!([0, u64::MAX].map(|time_ns| TIMES.step_at(time_ns)), [60, 600]);
    }
}
