//! The exit codes of the program.

use std::process::{ExitCode, Termination};

use super::output;

/// The exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// 0: success.
    Done,
    /// 1: failure, with the reason on stderr. (2 is a usage error, with which clap exits.)
    Failed,
    /// 3: finished, but with loss, truncation or divergence.
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

/// Returns the exit code of a subcommand. Prints an error and its causes as one line on stderr.
pub(crate) fn from_result(result: anyhow::Result<Exit>) -> Exit {
    result.unwrap_or_else(|error| {
        output::note(&format!("error: {error:#}"));
        Exit::Failed
    })
}
