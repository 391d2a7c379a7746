//! `lesson`: lists the lessons, or prints one.

use anyhow::Context;
use serde::Serialize;
use sim_lessons::{Lesson, Table};

use crate::args::LessonArgs;
use crate::output;

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
    use super::*;

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
