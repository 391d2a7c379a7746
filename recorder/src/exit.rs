//! How the program ends.

use std::process::{ExitCode, Termination};

/// The exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// 0: done.
    Done,
    /// 1: failed; the reason stands on stderr. (2 is a wrong option, which clap ends with.)
    Failed,
    /// 3: finished, but something is lost, cut off, or not as it should be.
    Loss,
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Failed => ExitCode::FAILURE,
            Self::Loss => ExitCode::from(3),
        }
    }
}

/// The exit of a subcommand; an error is printed as one line on stderr, its cause behind it.
#[allow(clippy::print_stderr, reason = "the one place where errors reach the user")]
pub(crate) fn of(result: anyhow::Result<Exit>) -> Exit {
    result.unwrap_or_else(|error| {
        eprintln!("error: {error:#}");
        Exit::Failed
    })
}
