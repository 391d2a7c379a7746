//! What readers, writers and listeners have in common.

use std::fmt::Debug;

use iceoryx2::prelude::{IceoryxSend, PortFactory, ZeroCopySend, ipc};
use iceoryx2::service::port_factory::publish_subscribe;

use crate::messages::collider::CollidersHeader;
use crate::messages::parameters::ParametersHeader;
use crate::messages::snapshot::SnapshotHeader;
use crate::messages::tears::TearsHeader;
use crate::messages::topology::{KeyframeHeader, LoadHeader};
use crate::ports::service::ServiceError;
use crate::ports::session::CLEANUP_TIMEOUT;

/// A header that says how long its payload is.
pub(crate) trait Counted: Debug + Default + Copy + ZeroCopySend {
    fn count(&self) -> u64;
}

impl Counted for SnapshotHeader {
    fn count(&self) -> u64 {
        self.particle_count.into()
    }
}

impl Counted for LoadHeader {
    fn count(&self) -> u64 {
        self.count.into()
    }
}

impl Counted for TearsHeader {
    fn count(&self) -> u64 {
        self.count.into()
    }
}

impl Counted for CollidersHeader {
    fn count(&self) -> u64 {
        self.count.into()
    }
}

impl Counted for ParametersHeader {
    fn count(&self) -> u64 {
        self.count.into()
    }
}

impl Counted for KeyframeHeader {
    fn count(&self) -> u64 {
        self.size_bytes
    }
}

/// Readers of a service, killed ones included until their places are freed.
pub(crate) fn reader_count<P, H>(
    service: &publish_subscribe::PortFactory<ipc::Service, P, H>,
) -> usize
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    service.dynamic_config().number_of_subscribers()
}

/// The places for ports of one kind at a service.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Places {
    /// Whom they are for, in the plural.
    pub(crate) what: &'static str,
    pub(crate) max: usize,
}

/// Creates a port, after freeing the places of dead processes if all are taken.
pub(crate) fn create_port<T, E: PartialEq + Debug>(
    service: &impl PortFactory,
    full: &E,
    places: Places,
    create: impl Fn() -> Result<T, E>,
) -> Result<T, ServiceError> {
    let created = match create() {
        Err(error) if error == *full => {
            service.blocking_cleanup_dead_nodes(CLEANUP_TIMEOUT);
            create()
        }
        result => result,
    };
    created.map_err(|error| {
        let name = service.name().to_string();
        if error == *full {
            ServiceError::Full { service: name, what: places.what, max: places.max }
        } else {
            ServiceError::failed(&name, &error)
        }
    })
}
