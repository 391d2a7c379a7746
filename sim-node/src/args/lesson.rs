//! The command line of `lesson`.

use clap::{Args as ClapArgs, ValueEnum};

#[derive(Debug, ClapArgs)]
#[command(after_help = "Every number is computed when the lesson is called, except for columns \
    marked `document`, which stand in the tutorials. `law` is a closed form, `loop` a few lines \
    of arithmetic in this program, `solver` what a scene of that kind does in the solver.\n\n\
    Examples:\n  \
    sim-node lesson               list the lessons\n  \
    sim-node lesson euler         why one table ends at 450, one at 550, and one at 500\n  \
    sim-node lesson f32 --json    the rows, for a plot")]
pub(crate) struct LessonArgs {
    /// Which lesson [default: list them]
    #[arg(value_enum)]
    pub(crate) lesson: Option<LessonName>,
    /// Print an array of tables with columns, rows and notes
    #[arg(long)]
    pub(crate) json: bool,
}

/// What a lesson is about. The texts are the help and the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum LessonName {
    /// One fall by explicit Euler, semi-implicit Euler, Verlet and the solver, and their errors
    Euler,
    /// What a pass does to one stick, and passes against substeps in a hanging rope
    Iterations,
    /// What k, k' and compliance mean, and which of them depend on the passes or on the rate
    Stiffness,
    /// A long sum, a clock and a velocity in 32 bits: what rounding does to each
    F32,
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
        for part in ["'nix'", "euler, iterations, stiffness, f32"] {
            assert!(text.contains(part), "{part} is not in: {text}");
        }
    }

    #[test]
    fn the_help_says_what_each_lesson_shows() {
        let help = Args::try_parse_from(["sim-node", "lesson", "--help"]).unwrap_err().to_string();
        for part in ["- euler:", "- iterations:", "- stiffness:", "- f32:", "hanging rope"] {
            assert!(help.contains(part), "{part} is not in: {help}");
        }
    }
}
