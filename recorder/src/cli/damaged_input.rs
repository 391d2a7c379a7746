//! The error of a recording whose damage leaves nothing to work on.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use recorder::{FindStateError, IntactParts, LogEnd, ReadError, RepairError};
use sim_contract::{Stop, is_being_written};

/// A truncated or damaged recording that lacks what a subcommand needs. The program ends with exit code 3.
#[derive(Debug)]
pub(crate) struct DamagedInput {
    path: PathBuf,
    /// The content that the readable part lacks.
    problem: String,
    end: LogEnd,
}

impl DamagedInput {
    /// Returns the end of the readable part.
    pub(crate) fn end(&self) -> &LogEnd {
        &self.end
    }
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
            "{problem} in its readable part: the file is {end}. `recorder repair {path} OUT.mcap` copies what is intact"
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

/// Returns what is intact of a recording whose readable part has an end that is not that of the file, if
/// `saves_more` than that part.
pub(crate) fn intact_parts(
    path: &Path,
    end: &LogEnd,
    stop: &Stop,
    saves_more: impl FnOnce(&IntactParts) -> bool,
) -> anyhow::Result<Option<IntactParts>> {
    if *end == LogEnd::Complete || is_being_written(path) {
        return Ok(None);
    }
    match IntactParts::find(path, stop) {
        Ok(parts) => Ok(Some(parts).filter(saves_more)),
        Err(RepairError::Read(error @ ReadError::Interrupted)) => Err(error.into()),
        // Then the readable part is all.
        Err(_) => Ok(None),
    }
}

/// Returns the error of a recording without the state that a subcommand looks for.
pub(crate) fn lacks_state(path: &Path, error: FindStateError) -> anyhow::Error {
    match error {
        FindStateError::Missing { problem, end } => lacks(path, &problem, end.as_ref()),
        FindStateError::Read(error) => error.into(),
    }
}
