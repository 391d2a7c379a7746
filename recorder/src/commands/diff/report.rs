//! The report of a comparison.

use std::fmt;

use serde::Serialize;
use serde_json::Value;
use sim_contract::printable_line;

use super::growth::Distance;

/// The result, as printed.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Report {
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

impl fmt::Display for Report {
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
