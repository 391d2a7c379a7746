//! The exit codes of the program.

use std::process::{ExitCode, Termination};

use sim_contract::console;

use super::damaged_input::DamagedInput;

/// The exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Exit {
    /// 0: success.
    Done,
    /// 1: failure, with the reason on stderr. (2 is a usage error, with which clap exits.)
    Failed,
    /// 3: finished, but with loss, truncation or divergence; or the input is so damaged that nothing of it can be
    /// used.
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
        console::note(&format!("error: {error:#}"));
        if error.is::<DamagedInput>() { Exit::Loss } else { Exit::Failed }
    })
}

/// Ends the program as clap does: with code 2 after an error of the command line, with 0 after a help
/// text, or with 1 if that cannot be written.
#[allow(clippy::exit, reason = "clap ends the program in the same way")]
pub(crate) fn with_usage(error: &clap::Error) -> ! {
    let (printed, code) = (error.print(), error.exit_code());
    std::process::exit(console::usage_exit_code(printed, error.use_stderr(), code))
}
