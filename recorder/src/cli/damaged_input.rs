//! The error of a recording whose damage leaves nothing to work on.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use recorder::{FindStateError, LogEnd};
use sim_contract::is_being_written;

/// A truncated or damaged recording that lacks what a subcommand needs. The program ends with exit code 3.
#[derive(Debug)]
pub(crate) struct DamagedInput {
    path: PathBuf,
    /// The content that the readable part lacks.
    problem: String,
    end: LogEnd,
}

impl std::error::Error for DamagedInput {}

impl fmt::Display for DamagedInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, problem, end } = self;
        if is_being_written(path) {
            return write!(f, "{problem}: the file is being written by another program");
        }
        let path = path.display();
        write!(
            f,
            "{problem}: the file is {end}. `recorder repair {path} OUT.mcap` copies what is intact"
        )
    }
}

/// Returns the error of a recording that lacks something, which its end explains unless it is complete.
pub(crate) fn lacks(path: &Path, problem: &str, end: Option<&LogEnd>) -> anyhow::Error {
    match end {
        None | Some(LogEnd::Complete) => anyhow!("{problem}"),
        Some(end) => {
            let (path, problem, end) = (path.to_owned(), problem.to_owned(), end.clone());
            anyhow::Error::new(DamagedInput { path, problem, end })
        }
    }
}

/// Returns the error of a recording without the state that a subcommand looks for.
pub(crate) fn lacks_state(path: &Path, error: FindStateError) -> anyhow::Error {
    match error {
        FindStateError::Missing { problem, end } => lacks(path, &problem, end.as_ref()),
        FindStateError::Read(error) => error.into(),
    }
}
