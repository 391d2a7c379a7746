//! The share of the file descriptors of the process that visitors can use. One that is missing does
//! harm elsewhere: the link to a node that starts needs about a hundred, and the Foxglove library accepts
//! no client again after one failure.

use std::io;

use rustix::io::Errno;
use rustix::process::{Resource, getrlimit};

use crate::limits::{DESCRIPTORS_PER_VISITOR, DESCRIPTORS_RESERVED, VISITORS_MAX, VISITORS_MIN};

/// Number of open files with which connections never fail for lack of a descriptor.
const OPEN_FILES_MIN: usize = DESCRIPTORS_RESERVED + VISITORS_MIN * DESCRIPTORS_PER_VISITOR;

/// Returns the number of visitors that each server can have under the limit of the system.
pub(super) fn visitor_count_max() -> usize {
    open_file_limit().map_or(VISITORS_MAX, visitor_count_for)
}

/// Returns a warning for the user if the system allows too few open files for all clients.
pub fn open_files_warning() -> Option<String> {
    let limit = open_file_limit().filter(|limit| *limit < OPEN_FILES_MIN)?;
    Some(format!(
        "warning: the system allows only {limit} open files, too few for all clients; raise the limit \
         with `ulimit -n {OPEN_FILES_MIN}`"
    ))
}

fn open_file_limit() -> Option<usize> {
    getrlimit(Resource::Nofile).current.and_then(|limit| usize::try_from(limit).ok())
}

fn visitor_count_for(limit: usize) -> usize {
    let available = limit.saturating_sub(DESCRIPTORS_RESERVED);
    (available / DESCRIPTORS_PER_VISITOR).clamp(VISITORS_MIN, VISITORS_MAX)
}

/// Returns whether the process or the system has no descriptor or memory left for a socket.
pub(super) fn are_exhausted(error: &io::Error) -> bool {
    matches!(
        Errno::from_io_error(error),
        Some(Errno::MFILE | Errno::NFILE | Errno::NOBUFS | Errno::NOMEM)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visitors_and_everything_else_stay_within_the_limit() {
        for limit in [512, 700, 1024, 1 << 20] {
            let count = visitor_count_for(limit);
            assert!(count * DESCRIPTORS_PER_VISITOR + DESCRIPTORS_RESERVED <= limit, "{limit}");
        }
        assert_eq!(visitor_count_for(1024), VISITORS_MAX);
        assert_eq!(visitor_count_for(OPEN_FILES_MIN), VISITORS_MIN);
        assert_eq!(visitor_count_for(0), VISITORS_MIN);
    }
}
