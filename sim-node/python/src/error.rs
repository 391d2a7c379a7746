//! Errors as Python exceptions, which the module `catenary._errors` defines.

use std::error::Error as StdError;
use std::path::Path;

use pyo3::import_exception;
use pyo3::prelude::*;
use sim_contract::{
    AttachError, EndpointError, LockstepError, OwnerState, ReadError, RequestError,
};
use sim_solver::scene::LoadError;

import_exception!(catenary._errors, Error);
import_exception!(catenary._errors, NotRunning);
import_exception!(catenary._errors, RecordingError);
import_exception!(catenary._errors, Rejected);
import_exception!(catenary._errors, SceneError);
import_exception!(catenary._errors, StateError);
import_exception!(catenary._errors, Timeout);
import_exception!(catenary._errors, TooManySnapshots);

pub(crate) fn attach_error(error: &AttachError) -> PyErr {
    match error {
        AttachError::NoNode { .. } | AttachError::NoServices { .. } => {
            NotRunning::new_err(error.to_string())
        }
        _ => Error::new_err(error.to_string()),
    }
}

pub(crate) fn endpoint_error(error: &EndpointError) -> PyErr {
    pyo3::exceptions::PyValueError::new_err(error.to_string())
}

pub(crate) fn read_error(error: &ReadError) -> PyErr {
    match error {
        ReadError::TooManyHeld { max, .. } => TooManySnapshots::new_err(format!(
            "this program holds {max} snapshots, the most that a node lends it: keep copies, such as \
             `snapshot.positions.copy()`, and drop the snapshots and the arrays that view them"
        )),
        _ => Error::new_err(error.to_string()),
    }
}

pub(crate) fn request_error(error: &RequestError) -> PyErr {
    let message = error.to_string();
    match error {
        RequestError::NoReceiver { .. }
        | RequestError::Timeout { owner: OwnerState::Gone { .. }, .. } => {
            NotRunning::new_err(message)
        }
        RequestError::Timeout { .. }
        | RequestError::OutcomesMissed { .. }
        | RequestError::QueueFull { .. } => Timeout::new_err(message),
        RequestError::InTurn => Error::new_err(
            "it is this node's turn in the lockstep, so no outcome would come: use the methods of the \
             lockstep, such as `steps.pin(3)`",
        ),
        RequestError::Read(error) => read_error(error),
        _ => Error::new_err(message),
    }
}

pub(crate) fn lockstep_error(error: &LockstepError) -> PyErr {
    match error {
        LockstepError::Attach(error) => attach_error(error),
        LockstepError::Read(error) => read_error(error),
        LockstepError::NotAdmitted { owner: OwnerState::Gone { .. }, .. } => {
            NotRunning::new_err(error.to_string())
        }
        LockstepError::NotAdmitted { .. } => Timeout::new_err(error.to_string()),
        _ => Error::new_err(error.to_string()),
    }
}

pub(crate) fn load_error(error: &LoadError) -> PyErr {
    SceneError::new_err(error.list())
}

pub(crate) fn recording_error(path: &Path, error: &dyn StdError) -> PyErr {
    // The option of the programs is an argument here.
    let problem = with_causes(error).replace("use --overwrite", "use overwrite=True");
    RecordingError::new_err(format!("{}: {problem}", path.display()))
}

/// Returns the message of an error, followed by those of its causes.
fn with_causes(error: &dyn StdError) -> String {
    match error.source() {
        Some(cause) => format!("{error}: {}", with_causes(cause)),
        None => error.to_string(),
    }
}
