//! The claim of a name: its lock, and the one publisher of `status`.

use std::time::Duration;

use crate::clock::{self, Deadline};
use crate::endpoint::Endpoint;
use crate::messages::status::NodeStatus;
use crate::owner::error::OwnerError;
use crate::ports::domain::owner_lock::{LockError, OwnerLock};
use crate::ports::domain::root::RootError;
use crate::ports::domain::{self, orphans, root, unfinished};
use crate::ports::service::{STATUS, ServiceError};
use crate::ports::services::owner;
use crate::ports::session::{Session, Values};
use crate::ports::writer::ValueWriter;

/// Most attempts to take the lock of a name, in half a second: an owner that ends frees it a moment
/// after its clients have noticed.
const LOCK_ATTEMPTS_MAX: usize = 100;
/// Pause between two attempts to take the lock or the place of the owner.
const LOCK_PAUSE_NS: u64 = clock::SECOND_NS / 200;

/// Longest wait for another process that cleans up after a killed owner, and is slow on a busy machine.
const CLEANUP_MAX: Duration = Duration::from_secs(2);

/// Takes the lock of the name, and removes what killed owners of the name left unfinished.
pub(super) fn take_lock(endpoint: &Endpoint) -> Result<OwnerLock, OwnerError> {
    let config = domain::configuration(endpoint.domain()).map_err(|error| {
        ServiceError::Domain { endpoint: endpoint.clone(), cause: format!("{error:?}") }
    })?;
    let root = root::path(&config);
    root::prepare(&root)
        .map_err(|cause| ServiceError::Root { endpoint: endpoint.clone(), cause })?;
    let mut attempt_count = 1;
    loop {
        match OwnerLock::take(&config, endpoint.name()) {
            Ok(lock) => {
                unfinished::remove_services(&config, endpoint.name());
                return Ok(lock);
            }
            Err(LockError::Held(_)) if attempt_count < LOCK_ATTEMPTS_MAX => {
                attempt_count += 1;
                clock::sleep_until(clock::monotonic_ns() + LOCK_PAUSE_NS);
            }
            Err(LockError::Held(process_id)) => {
                return Err(OwnerError::NameTaken { endpoint: endpoint.clone(), process_id });
            }
            Err(LockError::System { path, error }) => {
                let cause = RootError::System { path, cause: format!("cannot lock it: {error}") };
                return Err(ServiceError::Root { endpoint: endpoint.clone(), cause }.into());
            }
        }
    }
}

/// Creates the one possible publisher of `status`. It exists already where a process owns the name
/// without its lock, such as one in a container with another root; and for a killed owner, until a
/// process has cleaned up after it.
pub(super) fn claim_name(
    session: &Session,
    service: &Values<NodeStatus>,
) -> Result<ValueWriter<NodeStatus>, OwnerError> {
    let deadline = Deadline::after(CLEANUP_MAX);
    loop {
        match ValueWriter::create(session.config(), service, &STATUS) {
            Err(ServiceError::Full { .. }) => {
                let owner = owner(service);
                if owner.is_some() || deadline.remaining().is_zero() {
                    let process_id = owner.and_then(|process| process.id);
                    let endpoint = session.endpoint.clone();
                    return Err(OwnerError::NameTaken { endpoint, process_id });
                }
                session.restore_orphans(&orphans::ports(service));
                clock::sleep_until(clock::monotonic_ns() + LOCK_PAUSE_NS);
            }
            status => return Ok(status?),
        }
    }
}
