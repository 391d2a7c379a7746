//! Common parts of readers, writers and listeners.

use std::fmt::Debug;

use iceoryx2::prelude::{IceoryxSend, PortFactory, ZeroCopySend, ipc_threadsafe};
use iceoryx2::service::port_factory::publish_subscribe;
use sim_messages::{
    CollidersHeader, ForcesHeader, KeyframeHeader, LoadHeader, ParametersHeader, RestoreHeader,
    SnapshotHeader, TearsHeader,
};

use crate::ports::cleanup;
use crate::ports::memory;
use crate::ports::service::ServiceError;

/// A header that contains the length of its payload.
pub(crate) trait SliceHeader: Debug + Default + Copy + ZeroCopySend {
    fn element_count(&self) -> u64;
}

impl SliceHeader for SnapshotHeader {
    fn element_count(&self) -> u64 {
        self.particle_count.into()
    }
}

impl SliceHeader for LoadHeader {
    fn element_count(&self) -> u64 {
        self.count.into()
    }
}

impl SliceHeader for TearsHeader {
    fn element_count(&self) -> u64 {
        self.count.into()
    }
}

impl SliceHeader for CollidersHeader {
    fn element_count(&self) -> u64 {
        self.count.into()
    }
}

impl SliceHeader for ForcesHeader {
    fn element_count(&self) -> u64 {
        self.count.into()
    }
}

impl SliceHeader for ParametersHeader {
    fn element_count(&self) -> u64 {
        self.count.into()
    }
}

impl SliceHeader for KeyframeHeader {
    fn element_count(&self) -> u64 {
        self.size_bytes
    }
}

impl SliceHeader for RestoreHeader {
    fn element_count(&self) -> u64 {
        self.size_bytes
    }
}

/// Returns the number of readers of a service. Killed readers count until their ports are freed.
pub(crate) fn reader_count<P, H>(
    service: &publish_subscribe::PortFactory<ipc_threadsafe::Service, P, H>,
) -> usize
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    service.dynamic_config().number_of_subscribers()
}

/// Limit of the ports of one kind at a service.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PortLimit {
    /// Name of the ports for error messages, in the plural.
    pub(crate) ports: &'static str,
    pub(crate) max: usize,
}

/// Creates a port, unless shared memory is full. At the limit, frees the ports of dead processes and tries again.
pub(crate) fn create_port<T, E: PartialEq + Debug>(
    service: &impl PortFactory<Service = ipc_threadsafe::Service>,
    full: &E,
    limit: PortLimit,
    create: impl Fn() -> Result<T, E>,
) -> Result<T, ServiceError> {
    // Checked for each port with the memory of all, because a client creates some of them long after it joined.
    memory::check_ports()
        .map_err(|memory| ServiceError::Memory { service: service.name().to_string(), memory })?;
    let created = match create() {
        Err(error) if error == *full => {
            cleanup::free_ports(service);
            create()
        }
        result => result,
    };
    created.map_err(|error| {
        let name = service.name().to_string();
        if error == *full {
            ServiceError::Full { service: name, ports: limit.ports, max: limit.max }
        } else {
            ServiceError::failed(&name, &error)
        }
    })
}
