//! The report of a comparison, with the distance of the two runs over time.

use std::fmt;

use recording::verification::distance;
use serde::Serialize;
use serde_json::Value;
use sim_contract::{ParticleState, printable_line};

/// The result, as printed.
#[derive(Debug, Default, Serialize)]
pub(crate) struct DiffReport {
    /// The part that came apart first: "scene", "commands", "state", or null.
    pub(super) first: Option<&'static str>,
    /// First and last step that both files have.
    pub(super) first_step: Option<u64>,
    pub(super) last_step: Option<u64>,
    /// First and last step of each file.
    pub(super) steps_of_a: Option<(u64, u64)>,
    pub(super) steps_of_b: Option<(u64, u64)>,
    /// Number of steps that both files have.
    pub(super) common_steps: u64,
    /// Number of those with different states.
    pub(super) different_steps: u64,
    pub(super) scene: Option<SceneDifference>,
    /// The first command that the files do not share.
    pub(super) commands: Option<CommandDifference>,
    /// The first different state.
    pub(super) state: Option<StateDifference>,
    /// The greatest distance.
    pub(super) greatest: Option<Distance>,
    /// The distance in the first different step, after 1, 2, 4, 8, ... further steps, and in the last one.
    pub(super) growth: Vec<Distance>,
}

/// The first line in which two scenes differ.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub(crate) struct SceneDifference {
    /// From 1, in the output of `recorder scene`.
    pub(crate) line: usize,
    pub(crate) a: String,
    pub(crate) b: String,
}

/// The first command that two recordings do not share.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct CommandDifference {
    pub(crate) step: u64,
    /// The command with its status, as in `/outcomes`. Null for none.
    pub(crate) a: Option<Value>,
    pub(crate) b: Option<Value>,
}

/// The first difference of two states.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub(crate) struct StateDifference {
    pub(crate) step: u64,
    /// `None` if the particles are equal, and only the torn constraints differ.
    pub(crate) particle: Option<usize>,
    pub(crate) field: &'static str,
    /// The values with their bits.
    pub(crate) a: String,
    pub(crate) b: String,
}

impl fmt::Display for StateDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { step, particle, field, a, b } = self;
        write!(f, "differ from step {step} on: ")?;
        particle.iter().try_for_each(|index| write!(f, "particle {index}, "))?;
        write!(f, "{field}: A {a}, B {b}")
    }
}

impl fmt::Display for DiffReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.scene {
            None => writeln!(f, "scene       same")?,
            Some(SceneDifference { line, a, b }) => {
                writeln!(f, "scene       differs in line {line}")?;
                writeln!(f, "  A: {}\n  B: {}", printable_line(a), printable_line(b))?;
            }
        }
        match &self.commands {
            None => writeln!(f, "commands    same")?,
            Some(CommandDifference { step, a, b }) => {
                writeln!(f, "commands    differ from step {step} on")?;
                let text = |command: &Option<Value>| {
                    command.as_ref().map_or("none".to_owned(), ToString::to_string)
                };
                writeln!(
                    f,
                    "  A: {}\n  B: {}",
                    printable_line(&text(a)),
                    printable_line(&text(b))
                )?;
            }
        }
        match &self.state {
            None => writeln!(f, "states      same")?,
            Some(difference) => writeln!(f, "states      {difference}")?,
        }
        let (common, different) = (self.common_steps, self.different_steps);
        let (first, last) = (self.first_step.unwrap_or(0), self.last_step.unwrap_or(0));
        write!(
            f,
            "steps       {first}..={last} in both: {common} compared, {different} different"
        )?;
        if let (Some(a), Some(b)) = (self.steps_of_a, self.steps_of_b)
            && a != b
        {
            write!(f, " (A has {}..={}, B {}..={})", a.0, a.1, b.0, b.1)?;
        }
        if self.growth.is_empty() {
            return Ok(());
        }
        write!(f, "\n\n{:>10} {:>10} {:>14} {:>14}", "step", "time s", "greatest m", "mean m")?;
        self.growth.iter().try_for_each(|distance| write!(f, "\n{distance}"))?;
        self.greatest.iter().try_for_each(|one| {
            write!(f, "\ngreatest distance: {} m in step {}", one.greatest_m, one.step)
        })
    }
}

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
mod growth_tests {
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
