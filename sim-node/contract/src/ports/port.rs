//! Common parts of readers, writers and listeners.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::ops::Deref;

use bytemuck::Pod;
use iceoryx2::prelude::{PortFactory, ZeroCopySend, ipc_threadsafe};
use iceoryx2::service::static_config::message_type_details::TypeVariant;
use sim_messages::{
    CollidersHeader, ForcesHeader, KeyframeHeader, LoadHeader, ParametersHeader, RestoreHeader,
    SnapshotHeader, TearsHeader,
};

use crate::ports::leftovers;
use crate::ports::memory;
use crate::ports::raw::{self, MessageType};
use crate::ports::service::ServiceError;

/// A header that contains the length of its payload. `()` is the header of single values.
pub(crate) trait Header: Pod + ZeroCopySend {
    const VARIANT: TypeVariant = TypeVariant::Dynamic;

    fn element_count(&self) -> u64;
}

impl Header for () {
    const VARIANT: TypeVariant = TypeVariant::FixedSize;

    fn element_count(&self) -> u64 {
        1
    }
}

macro_rules! headers {
    ($($header:ident: $count:ident),+ $(,)?) => {
        $(impl Header for $header {
            fn element_count(&self) -> u64 {
                self.$count.into()
            }
        })+
    };
}

headers! {
    SnapshotHeader: particle_count,
    LoadHeader: count,
    TearsHeader: count,
    CollidersHeader: count,
    ForcesHeader: count,
    ParametersHeader: count,
    KeyframeHeader: size_bytes,
    RestoreHeader: size_bytes,
}

/// A publish-subscribe service whose messages are slices of `T` with the header `H`, or single values.
#[derive(Debug)]
pub(crate) struct Service<T, H = ()> {
    raw: raw::Service,
    _types: PhantomData<fn() -> (T, H)>,
}

impl<T: Pod + ZeroCopySend, H: Header> Service<T, H> {
    pub(crate) fn message_type() -> MessageType {
        MessageType::of::<T, H>(H::VARIANT)
    }

    /// Adds the types to a service of [`Self::message_type`].
    pub(crate) fn of(raw: raw::Service) -> Self {
        Self { raw, _types: PhantomData }
    }
}

impl<T, H> Deref for Service<T, H> {
    type Target = raw::Service;

    fn deref(&self) -> &raw::Service {
        &self.raw
    }
}

/// Returns the number of readers of a service. Killed readers count until their ports are freed.
pub(crate) fn reader_count(service: &raw::Service) -> usize {
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
            leftovers::free_ports(service);
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
