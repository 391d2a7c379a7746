//! Arguments of `lesson`.

use clap::Args as ClapArgs;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use sim_lessons::{Lesson, UnknownLesson};

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

#[cfg(test)]
mod tests {
    use clap::Parser;
    use clap::error::ErrorKind;

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
}
