//! The long work of a command, beside the loop.

mod beside;
pub(super) mod scene;
pub(super) mod work;

use sim_solver::Prepared;

use self::scene::{Loaded, Refusal};
use self::work::Work;
use super::inbox::Request;

/// Commands of a client whose work takes longer than the loop can wait.
#[derive(Debug)]
pub(super) struct Job {
    /// A single one, or settings.
    requests: Vec<Request>,
    /// None if nothing is left to do.
    work: Option<Work<Done>>,
}

/// Result of the work.
#[derive(Debug)]
pub(super) enum Done {
    /// Of a load.
    Scene(Result<Box<Loaded>, Refusal>),
    /// Of commands that change many constraints.
    Constraints(Box<Prepared>),
    /// Of commands that do their work themselves.
    Nothing,
}
