//! The claim of a name: its lock, and the owner's publisher of `status`.

use std::time::Duration;

use sim_host::clock::{self, Deadline};
use sim_messages::NodeStatus;

use crate::endpoint::Endpoint;
use crate::owner::error::OwnerError;
use crate::ports::domain::root::RootError;
use crate::ports::domain::{self, root};
use crate::ports::leftovers::lock::{LockError, OwnerLock};
use crate::ports::leftovers::{orphans, unfinished};
use crate::ports::port::Service;
use crate::ports::service::{OWNER_PORT, STATUS, ServiceError};
use crate::ports::services::{OwnerProcess, living_process};
use crate::ports::session::Session;
use crate::ports::source::claiming_nodes;
use crate::ports::writer::{Capacity, Writer};

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

/// Creates the publisher of `status` by which others know the owner. The caller holds the lock of the name,
/// but a process may own the name without it, such as one in a container with another root. The place can be
/// taken by a killed owner, until a process has cleaned up after it; the other place is a tunnel's.
pub(super) fn claim_name(
    session: &Session,
    service: &Service<NodeStatus>,
) -> Result<Writer<NodeStatus>, OwnerError> {
    let (deadline, capacity) = (Deadline::after(CLEANUP_MAX), Capacity::of_values(&STATUS));
    loop {
        if let Some(process) = owner(service) {
            let endpoint = session.endpoint.clone();
            return Err(OwnerError::NameTaken { endpoint, process_id: process.id });
        }
        match Writer::create_named(session.config(), service, capacity, OWNER_PORT) {
            Err(ServiceError::Full { .. }) if !deadline.remaining().is_zero() => {
                session.restore_orphans(&orphans::ports(service));
                clock::sleep_until(clock::monotonic_ns() + LOCK_PAUSE_NS);
            }
            status => return Ok(status?),
        }
    }
}

/// Returns the living process that calls itself the owner.
fn owner(status: &Service<NodeStatus>) -> Option<OwnerProcess> {
    living_process(status, &claiming_nodes(status))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::reader::Reader;
    use crate::ports::service::{COMMANDS, READY, RESTORE};
    use crate::ports::services::Services;
    use crate::ports::session::Access;
    use crate::testing::TestDomain;
    use crate::{AttachError, Client};

    fn create_owner(endpoint: &Endpoint) -> Result<Owner, OwnerError> {
        let load = Load::default();
        Owner::create(endpoint, &load)
    }

    /// A tunnel's publisher of `status`.
    fn tunnel(session: &Session) -> Writer<NodeStatus> {
        let service = session.service(&STATUS, Access::Open).unwrap();
        Writer::of_values(session.config(), &service, &STATUS).unwrap()
    }

    #[test]
    fn the_place_of_a_tunnel_is_not_that_of_a_second_owner() {
        let domain = TestDomain::new();
        let _first = create_owner(&domain.endpoint()).unwrap();
        // Even without the lock, whose files a person has removed.
        let config = domain::configuration(Some(domain.name())).unwrap();
        for path in OwnerLock::paths(&config, "sim") {
            fs::remove_file(path).unwrap();
        }
        let error = create_owner(&domain.endpoint()).unwrap_err();
        assert!(matches!(error, OwnerError::NameTaken { .. }), "{error}");
    }

    #[test]
    fn a_client_attaches_only_to_an_owner_that_receives_commands() {
        let domain = TestDomain::new();
        let endpoint = domain.endpoint();
        let session = Session::join(&endpoint).unwrap();
        let status = session.service(&STATUS, Access::Create).unwrap();
        let _status = claim_name(&session, &status).unwrap();
        // As within `Owner::create`, between the services and the ports.
        let services = Services::access(&session, Access::Create).unwrap();
        let error = Client::attach(&endpoint).unwrap_err();
        assert!(matches!(error, AttachError::NoNode { .. }), "{error}");
        let _ready = Reader::of_every_publisher(&services.ready, &READY).unwrap();
        let _restore = Reader::of_every_publisher(&services.restore, &RESTORE).unwrap();
        std::thread::scope(|scope| {
            let client = scope.spawn(|| Client::attach(&endpoint).map(drop));
            let _commands = Reader::of_every_publisher(&services.commands, &COMMANDS).unwrap();
            client.join().unwrap().unwrap();
        });
    }

    #[test]
    fn a_tunnel_does_not_own_the_name() {
        let domain = TestDomain::new();
        let first = create_owner(&domain.endpoint()).unwrap();
        let session = Session::join(&domain.endpoint()).unwrap();
        let status = session.service(&STATUS, Access::Open).unwrap();
        let _tunnel = tunnel(&session);
        assert!(owner(&status).is_some());
        drop(first);
        assert!(owner(&status).is_none());
        let _second = create_owner(&domain.endpoint()).unwrap();
        assert!(owner(&status).is_some());
    }
}
