//! Exit codes of the program.

use std::process::{ExitCode, Termination};

use crate::output;

/// End of a subcommand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Exit code 0.
    Done,
    /// Exit code 1: failed, with the reason on stderr. (Code 2 is a usage error.)
    Failed,
    /// Exit code 4: the node rejected the command of `ctl`.
    Rejected,
}

impl Termination for Exit {
    fn report(self) -> ExitCode {
        match self {
            Self::Done => ExitCode::SUCCESS,
            Self::Failed => ExitCode::FAILURE,
            Self::Rejected => ExitCode::from(4),
        }
    }
}

/// Prints an error as one line on stderr, followed by its causes.
pub(crate) fn from_result(result: anyhow::Result<Exit>) -> Exit {
    result.unwrap_or_else(|error| {
        output::note(&format!("error: {error:#}"));
        Exit::Failed
    })
}
