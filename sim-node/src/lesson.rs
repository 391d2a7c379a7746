//! `lesson`: lists the lessons, or prints one.

use anyhow::Context;
use clap::Args as ClapArgs;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use sim_lessons::{Lesson, Table, UnknownLesson};

use crate::output;

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Every number is computed when you ask for it, except in the columns marked \
    `document`, which a tutorial prints. `law` is a closed form, `loop` a few lines of plain \
    arithmetic, `solver` a scene in the solver.\n\n\
    Examples:\n  \
    sim-node lesson               list the lessons\n  \
    sim-node lesson euler         why one table ends at 450, one at 550, and one at 500\n  \
    sim-node lesson f32 --csv     the rows, for a spreadsheet\n  \
    sim-node lesson f32 --json    the rows, for a plot"
)]
pub(crate) struct LessonArgs {
    /// Lesson to print [default: list all]
    #[arg(value_parser = lesson_parser())]
    pub(crate) lesson: Option<Lesson>,
    /// Print an array of tables with columns, rows and notes as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Print the tables as CSV with all digits, each below a comment with its title
    #[arg(long, conflicts_with = "json", requires = "lesson")]
    pub(crate) csv: bool,
}

/// Parses the name of a lesson. The help lists the names with their summaries.
fn lesson_parser() -> impl TypedValueParser<Value = Lesson> {
    let value = |lesson: Lesson| PossibleValue::new(lesson.name()).help(lesson.summary());
    let values = PossibleValuesParser::new(Lesson::ALL.map(value));
    values.try_map(|name| -> Result<Lesson, UnknownLesson> { name.parse() })
}

/// Prints a lesson, or lists all of them.
pub(crate) fn lesson(args: &LessonArgs) -> anyhow::Result<()> {
    let text = match (args.lesson, args.json) {
        (None, false) => list().map(|line| line.to_string()).collect(),
        (None, true) => json(&list().collect::<Vec<_>>())?,
        (Some(lesson), false) if args.csv => join(&lesson.tables(), "\n", Table::to_csv),
        (Some(lesson), false) => join(&lesson.tables(), "\n\n", Table::to_string),
        (Some(lesson), true) => json(&lesson.tables())?,
    };
    output::text(&text)
}

fn join(tables: &[Table], separator: &str, text: impl Fn(&Table) -> String) -> String {
    tables.iter().map(text).collect::<Vec<_>>().join(separator)
}

/// One line of the list of lessons.
#[derive(Serialize)]
struct ListLine {
    name: &'static str,
    text: &'static str,
    tutorials: &'static [&'static str],
}

impl std::fmt::Display for ListLine {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(formatter, "{:<11} {}", self.name, self.text)?;
        self.tutorials
            .iter()
            .try_for_each(|tutorial| writeln!(formatter, "{:<11} of {tutorial}", ""))
    }
}

fn list() -> impl Iterator<Item = ListLine> {
    let line = |lesson: Lesson| {
        let (name, text, tutorials) = (lesson.name(), lesson.summary(), lesson.tutorials());
        ListLine { name, text, tutorials }
    };
    Lesson::ALL.into_iter().map(line)
}

fn json(value: &impl Serialize) -> anyhow::Result<String> {
    let text = serde_json::to_string_pretty(value).context("writing the lesson")?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use clap::error::ErrorKind;

    use super::*;
    use crate::args::Args;

    #[test]
    fn an_unknown_lesson_is_refused_with_the_allowed_ones() {
        let error = Args::try_parse_from(["sim-node", "lesson", "nix"]).unwrap_err();
        assert_eq!((error.kind(), error.exit_code()), (ErrorKind::InvalidValue, 2));
        let text = error.to_string();
        for part in ["'nix'", "euler, iterations, stiffness, f32, dissipation"] {
            assert!(text.contains(part), "{part} is not in: {text}");
        }
    }

    #[test]
    fn the_help_summarizes_each_lesson() {
        let help = Args::try_parse_from(["sim-node", "lesson", "--help"]).unwrap_err().to_string();
        for part in ["- euler:", "- iterations:", "- stiffness:", "- f32:", "- dissipation:"] {
            assert!(help.contains(part), "{part} is not in: {help}");
        }
    }

    #[test]
    fn the_list_has_a_line_for_each_lesson() {
        let lines: Vec<_> = list().map(|line| line.to_string()).collect();
        assert_eq!(lines.len(), Lesson::ALL.len());
        assert_eq!(
            lines[3],
            "f32         What rounding to 32 bits does to a long sum, a clock and a velocity\n            \
             of \"Verlet Integration and Cloth Physics Simulation\", pikuma.com\n"
        );
    }
}
