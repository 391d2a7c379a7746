//! The distance of two runs over time.

use std::fmt;

use recording::verification::distance;
use serde::Serialize;
use sim_contract::ParticleState;

/// The distance of two states.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Distance {
    pub(crate) step: u64,
    /// Simulated time since step 0, in seconds.
    pub(crate) time_s: f64,
    /// Greatest distance of a particle's two positions, in m. Null if one is not finite.
    pub(crate) greatest_m: f64,
    /// Mean over all particles.
    pub(crate) mean_m: f64,
}

impl fmt::Display for Distance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { step, time_s, greatest_m, mean_m } = self;
        write!(f, "{step:>10} {time_s:>10.3} {greatest_m:>14.6e} {mean_m:>14.6e}")
    }
}

impl Distance {
    pub(super) fn new(step: u64, rate_hz: u32, a: &[ParticleState], b: &[ParticleState]) -> Self {
        let distances = || a.iter().zip(b).map(|(a, b)| distance(a, b));
        let greatest_m = distances().fold(0.0, |greatest: f64, one| {
            // A distance that is not finite is the greatest.
            if one.is_nan() || greatest.is_nan() { f64::NAN } else { greatest.max(one) }
        });
        let mean_m = distances().sum::<f64>() / (a.len().max(1)) as f64;
        Self { step, time_s: step as f64 / f64::from(rate_hz), greatest_m, mean_m }
    }
}

/// Keeps the distances after 0, 1, 2, 4, 8, ... steps and the last one.
#[derive(Debug, Default)]
pub(super) struct Growth {
    rows: Vec<Distance>,
    /// Steps after the first row from which on the next one is kept.
    next: u64,
    last: Option<Distance>,
    pub(super) greatest: Option<Distance>,
}

impl Growth {
    /// Adds the distance of a step. The first one is that of the first different state.
    pub(super) fn add(&mut self, distance: Distance) {
        let first_step = self.rows.first().map_or(distance.step, |first| first.step);
        let passed = distance.step - first_step;
        if passed >= self.next {
            self.rows.push(distance);
            self.next = (passed.max(self.next) * 2).max(1);
        }
        self.last = Some(distance);
        let is_greater = self.greatest.is_none_or(|greatest| {
            distance.greatest_m > greatest.greatest_m || distance.greatest_m.is_nan()
        });
        if is_greater {
            self.greatest = Some(distance);
        }
    }

    pub(super) fn rows(&self) -> Vec<Distance> {
        let last =
            self.last.filter(|last| self.rows.last().is_some_and(|one| one.step < last.step));
        self.rows.iter().copied().chain(last).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f32, y: f32) -> ParticleState {
        ParticleState { position: [x, y, 0.0], ..ParticleState::default() }
    }

    #[test]
    fn the_distance_is_that_of_the_particle_that_is_farthest_off() {
        let distance =
            Distance::new(120, 240, &[at(0.0, 0.0), at(1.0, 1.0)], &[at(3.0, 4.0), at(1.0, 2.0)]);
        let expected = Distance { step: 120, time_s: 0.5, greatest_m: 5.0, mean_m: 3.0 };
        assert_eq!(distance, expected);
        let nan = Distance::new(0, 240, &[at(f32::NAN, 0.0), at(0.0, 0.0)], &[at(0.0, 0.0); 2]);
        assert!(nan.greatest_m.is_nan());
    }

    #[test]
    fn rows_are_twice_as_far_apart_each_time() {
        let mut growth = Growth::default();
        for step in 100..=150 {
            growth.add(Distance::new(step, 1, &[at(step as f32, 0.0)], &[at(100.0, 0.0)]));
        }
        let steps: Vec<_> = growth.rows().iter().map(|row| row.step).collect();
        assert_eq!(steps, [100, 101, 102, 104, 108, 116, 132, 150]);
        assert_eq!(growth.greatest.unwrap().step, 150);
    }
}
