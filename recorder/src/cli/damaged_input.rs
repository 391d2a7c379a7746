//! The error of a recording whose damage leaves nothing to work on.

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use recording::{FindStateError, IntactParts, LogEnd, ReadError, RepairError};
use sim_host::{Stop, is_being_written};

/// Most lines about the losses of a file.
const LOSSES_SHOWN_MAX: usize = 10;

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

    /// Returns what the recording has lost, as lines.
    pub(crate) fn losses(&self) -> Vec<String> {
        losses(&self.path, &self.end, &Stop::default())
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

/// Returns the error of a recording that lacks something. The end of its readable part explains `problem`, unless
/// the file is complete.
pub(crate) fn lacks(path: &Path, problem: &str, end: Option<&LogEnd>) -> anyhow::Error {
    match end {
        None | Some(LogEnd::Complete) => anyhow!("{problem}"),
        Some(end) => {
            let (path, problem, end) = (path.to_owned(), problem.to_owned(), end.clone());
            anyhow::Error::new(DamagedInput { path, problem, end })
        }
    }
}

/// Returns the intact parts of a recording that is readable up to `end`. Returns `None` if that is the end of
/// the file, if no repair is possible, or if `saves_more` says that the parts have no more than the readable part.
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
        Err(error @ RepairError::Read(ReadError::Interrupted | ReadError::Io(_))) => {
            Err(error).with_context(|| path.display().to_string())
        }
        Err(_) => Ok(None),
    }
}

/// Returns what a recording has lost behind the end of its readable part, as `recorder check` and `recorder repair` name
/// it, as lines.
pub(crate) fn losses(path: &Path, end: &LogEnd, stop: &Stop) -> Vec<String> {
    if *end == LogEnd::Complete || is_being_written(path) {
        return Vec::new();
    }
    let mut lines = IntactParts::find(path, stop).map_or_else(|_| Vec::new(), |one| one.losses());
    if let Some(more) = lines.len().checked_sub(LOSSES_SHOWN_MAX).filter(|more| *more > 0) {
        lines.truncate(LOSSES_SHOWN_MAX);
        lines.push(format!("{more} more; `recorder check {}` lists them", path.display()));
    }
    lines
}

/// Returns the error of a recording without the state that a subcommand looks for.
pub(crate) fn lacks_state(path: &Path, error: FindStateError) -> anyhow::Error {
    match error {
        FindStateError::Missing { problem, end, .. } => lacks(path, &problem, end.as_ref()),
        FindStateError::Read(error) => error.into(),
    }
}
