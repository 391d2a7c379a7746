//! `lesson`: lists the lessons, or prints one.

use anyhow::Context;
use serde::Serialize;
use sim_lessons::Lesson;

use crate::args::LessonArgs;
use crate::output;

/// Prints a lesson, or lists all of them.
pub(crate) fn lesson(args: &LessonArgs) -> anyhow::Result<()> {
    let text = match (args.lesson, args.json) {
        (None, false) => list().map(|line| line.to_string()).collect(),
        (None, true) => json(&list().collect::<Vec<_>>())?,
        (Some(lesson), false) => {
            let tables = lesson.tables();
            tables.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n\n")
        }
        (Some(lesson), true) => json(&lesson.tables())?,
    };
    output::text(&text)
}

/// One line of the list of lessons.
#[derive(Serialize)]
struct ListLine {
    name: &'static str,
    text: &'static str,
}

impl std::fmt::Display for ListLine {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(formatter, "{:<11} {}", self.name, self.text)
    }
}

fn list() -> impl Iterator<Item = ListLine> {
    Lesson::ALL.into_iter().map(|lesson| ListLine { name: lesson.name(), text: lesson.summary() })
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
            "f32         What rounding to 32 bits does to a long sum, a clock and a velocity\n"
        );
    }
}
