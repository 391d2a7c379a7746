//! Writers of the publish-subscribe services. They never wait for a reader.

use std::fs::File;
use std::marker::PhantomData;

use bytemuck::{Pod, bytes_of, cast_slice_mut};
use iceoryx2::port::publisher::PublisherCreateError;
use iceoryx2::prelude::{Config, PortFactory, PortName, ZeroCopySend};
use thiserror::Error;

use crate::ports::memory::{self, AllocateError};
use crate::ports::port::{Header, PortLimit, Service, create_port};
pub(crate) use crate::ports::raw::Capacity;
use crate::ports::raw::{self, Publisher};
use crate::ports::service::{ServiceError, ServiceSpec};

/// Error of publishing a message. The writer is unchanged and can continue.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PublishError {
    /// The message is longer than the load announced.
    #[error(
        "{len} elements do not fit into a message of '{service}', which the load limited to {len_max}"
    )]
    TooLong {
        /// Full name of the service.
        service: String,
        /// Number of elements in the message.
        len: usize,
        /// Most elements of a message.
        len_max: usize,
    },
    /// There was no memory for the message, or it could not be sent.
    #[error("cannot publish on '{service}': {detail}")]
    Failed {
        /// Full name of the service.
        service: String,
        /// Error of iceoryx2.
        detail: String,
    },
}

/// Size of iceoryx2's own header of a message, in bytes.
const MESSAGE_HEADER_SIZE_BYTES: usize = 48;
/// Most bytes that a segment has beside its messages, and a message beside its headers and elements.
const PADDING_SIZE_BYTES: usize = 64;

impl Capacity {
    /// Returns the memory of a writer of single values.
    pub(crate) fn of_values(spec: &ServiceSpec) -> Self {
        Self { len_max: 1, samples: spec.samples_in_use_max() }
    }

    /// Returns the most bytes of shared memory that a writer of messages of `T` with the header `H`
    /// takes.
    pub(crate) fn size_bytes<T, H>(self) -> u64 {
        let message = MESSAGE_HEADER_SIZE_BYTES + size_of::<H>() + self.len_max * size_of::<T>();
        let messages = self.samples * (message + PADDING_SIZE_BYTES) + PADDING_SIZE_BYTES;
        messages as u64
    }
}

/// A writer of messages with a payload of `T`s and the header `H`.
#[derive(Debug)]
pub(crate) struct Writer<T, H = ()> {
    publisher: Publisher,
    /// The memory of its messages.
    segment: File,
    service: String,
    capacity: Capacity,
    _types: PhantomData<fn() -> (T, H)>,
}

impl<T: Pod + ZeroCopySend, H: Header> Writer<T, H> {
    /// Creates the writer and allocates the memory of all its messages.
    pub(crate) fn create(
        config: &Config,
        service: &Service<T, H>,
        capacity: Capacity,
    ) -> Result<Self, ServiceError> {
        Self::create_named(config, service, capacity, "")
    }

    /// Same as [`Self::create`]. Other processes see the name of the port.
    pub(crate) fn create_named(
        config: &Config,
        service: &Service<T, H>,
        capacity: Capacity,
        port: &str,
    ) -> Result<Self, ServiceError> {
        let publisher = create_publisher(service, capacity, port)?;
        let service = service.name().to_string();
        let segment = allocate(config, &publisher, &service)?;
        Ok(Self { publisher, segment, service, capacity, _types: PhantomData })
    }

    /// Publishes `element(0)`, `element(1)`, ... as one message of `header.element_count()` elements.
    /// Each element is written once, straight into shared memory.
    pub(crate) fn write(
        &self,
        header: H,
        element: impl Fn(usize) -> T,
    ) -> Result<(), PublishError> {
        self.send(header, element).map(|_| ())
    }

    /// Returns the most elements of a message.
    pub(crate) fn len_max(&self) -> usize {
        self.capacity.len_max
    }

    /// Returns the memory of the writer.
    pub(crate) fn capacity(&self) -> Capacity {
        self.capacity
    }

    /// Same as [`Self::write`]. Returns the number of readers that received the message.
    pub(crate) fn send(
        &self,
        header: H,
        element: impl Fn(usize) -> T,
    ) -> Result<usize, PublishError> {
        let len = usize::try_from(header.element_count()).unwrap_or(usize::MAX);
        self.send_elements(header, len, element)
    }

    /// Same as [`Self::send`] with another number of elements than the header has.
    pub(crate) fn send_elements(
        &self,
        header: H,
        len: usize,
        element: impl Fn(usize) -> T,
    ) -> Result<usize, PublishError> {
        self.send_bytes(bytes_of(&header), len, &mut |payload| {
            for (index, place) in cast_slice_mut(payload).iter_mut().enumerate() {
                *place = element(index);
            }
        })
    }
}

impl<T: Pod + ZeroCopySend> Writer<T> {
    /// Creates a writer of single values, as [`Self::create`] does.
    pub(crate) fn of_values(
        config: &Config,
        service: &Service<T>,
        spec: &ServiceSpec,
    ) -> Result<Self, ServiceError> {
        Self::create(config, service, Capacity::of_values(spec))
    }

    /// Publishes a single value. Returns the number of readers that received it.
    pub(crate) fn send_value(&self, value: T) -> Result<usize, PublishError> {
        self.send((), |_| value)
    }
}

impl<T, H> Writer<T, H> {
    fn send_bytes(
        &self,
        header: &[u8],
        len: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<usize, PublishError> {
        let len_max = self.capacity.len_max;
        let service = || self.service.clone();
        if len > len_max {
            return Err(PublishError::TooLong { service: service(), len, len_max });
        }
        self.publisher
            .send(header, len, write)
            .map_err(|detail| PublishError::Failed { service: service(), detail })
    }

    /// Removes the writer, and returns its segment, which keeps its memory until it is closed.
    pub(crate) fn close(self) -> File {
        self.segment
    }

    /// Sends the latched message to readers that joined since it was written.
    pub(crate) fn refresh(&self) {
        self.publisher.refresh();
    }
}

/// Allocates the memory of a publisher, so that writing a message never ends in SIGBUS.
fn allocate(config: &Config, publisher: &Publisher, service: &str) -> Result<File, ServiceError> {
    let service = service.to_owned();
    memory::allocate(config, publisher.id().value()).map_err(|error| match error {
        AllocateError::Full(memory) => ServiceError::Memory { service, memory },
        AllocateError::System(error) => ServiceError::Failed { service, detail: error.to_string() },
    })
}

fn create_publisher(
    service: &raw::Service,
    capacity: Capacity,
    port: &str,
) -> Result<Publisher, ServiceError> {
    let name = PortName::new(port)
        .map_err(|error| ServiceError::failed(&service.name().to_string(), &error))?;
    let full = PublisherCreateError::ExceedsMaxSupportedPublishers;
    let limit = PortLimit { ports: "writers", max: service.static_config().max_publishers() };
    create_port(service, &full, limit, || Publisher::create(service, capacity, &name))
}
