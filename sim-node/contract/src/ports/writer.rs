//! Writers of the publish-subscribe services. They never wait for a reader.

use std::fmt::Debug;
use std::fs::File;

use iceoryx2::identifiers::UniquePublisherId;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{
    BackpressureStrategy, Config, IceoryxSend, PortFactory, PortName, ZeroCopySend, ipc_threadsafe,
};
use iceoryx2::service::port_factory::publish_subscribe;
use thiserror::Error;

use crate::ports::memory::{self, AllocateError};
use crate::ports::port::{PortLimit, SliceHeader, create_port};
use crate::ports::service::{ServiceError, ServiceSpec};
use crate::ports::session::{Slices, Values};

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

impl PublishError {
    fn failed(service: &str, detail: &dyn Debug) -> Self {
        Self::Failed { service: service.to_owned(), detail: format!("{detail:?}") }
    }
}

/// Memory of a writer of slices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Capacity {
    /// Most elements of a message.
    pub(crate) len_max: usize,
    /// Most messages in use at the same time.
    pub(crate) samples: usize,
}

/// Size of iceoryx2's own header of a message, in bytes.
const MESSAGE_HEADER_SIZE_BYTES: usize = 48;
/// Most bytes that a segment has beside its messages, and a message beside its headers and elements.
const PADDING_SIZE_BYTES: usize = 64;

impl Capacity {
    /// Returns the most bytes of shared memory that a writer of messages of `T` with the header `H`
    /// takes.
    pub(crate) fn size_bytes<T, H>(self) -> u64 {
        let message = MESSAGE_HEADER_SIZE_BYTES + size_of::<H>() + self.len_max * size_of::<T>();
        let messages = self.samples * (message + PADDING_SIZE_BYTES) + PADDING_SIZE_BYTES;
        messages as u64
    }
}

/// A writer of a service of slices.
#[derive(Debug)]
pub(crate) struct SliceWriter<T: Debug + ZeroCopySend + 'static, H: SliceHeader> {
    publisher: Publisher<ipc_threadsafe::Service, [T], H>,
    /// The memory of its messages.
    segment: File,
    service: String,
    capacity: Capacity,
}

impl<T: Debug + Copy + ZeroCopySend + 'static, H: SliceHeader> SliceWriter<T, H> {
    /// Creates the writer and allocates the memory of all its messages.
    pub(crate) fn create(
        config: &Config,
        service: &Slices<T, H>,
        capacity: Capacity,
    ) -> Result<Self, ServiceError> {
        let Capacity { len_max, samples } = capacity;
        let publisher = create_publisher(service, || {
            service
                .publisher_builder()
                .initial_max_slice_len(len_max)
                .max_loaned_samples(1)
                .override_sample_preallocation(move |_| samples)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
        })?;
        let service = service.name().to_string();
        let segment = allocate(config, publisher.id(), &service)?;
        Ok(Self { publisher, segment, service, capacity })
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
        let len_max = self.capacity.len_max;
        if len > len_max {
            let service = self.service.clone();
            return Err(PublishError::TooLong { service, len, len_max });
        }
        let failed = |error: &dyn Debug| PublishError::failed(&self.service, error);
        let loan = self.publisher.loan_slice_uninit(len).map_err(|error| failed(&error))?;
        let mut sample = loan.write_from_fn(element);
        *sample.user_header_mut() = header;
        sample.send().map_err(|error| failed(&error))
    }

    /// Removes the writer, and returns its segment, which keeps its memory until it is closed.
    pub(crate) fn close(self) -> File {
        self.segment
    }

    /// Sends the latched message to readers that joined since it was written.
    pub(crate) fn refresh(&self) {
        // A reader that cannot be reached does not concern the owner.
        let _ = self.publisher.update_connections();
    }
}

/// A writer of a service of single values.
#[derive(Debug)]
pub(crate) struct ValueWriter<T: Debug + Copy + ZeroCopySend + 'static> {
    publisher: Publisher<ipc_threadsafe::Service, T, ()>,
    service: String,
}

impl<T: Debug + Copy + ZeroCopySend + 'static> ValueWriter<T> {
    /// Creates the writer and allocates the memory of all its messages.
    pub(crate) fn create(
        config: &Config,
        service: &Values<T>,
        spec: &ServiceSpec,
    ) -> Result<Self, ServiceError> {
        Self::create_named(config, service, spec, "")
    }

    /// Same as [`Self::create`]. Other processes see the name of the port.
    pub(crate) fn create_named(
        config: &Config,
        service: &Values<T>,
        spec: &ServiceSpec,
        port: &str,
    ) -> Result<Self, ServiceError> {
        let samples = spec.samples_in_use_max();
        let port = PortName::new(port)
            .map_err(|error| ServiceError::failed(&service.name().to_string(), &error))?;
        let publisher = create_publisher(service, || {
            service
                .publisher_builder()
                .name(&port)
                .max_loaned_samples(1)
                .override_sample_preallocation(move |_| samples)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
        })?;
        let service = service.name().to_string();
        let _segment = allocate(config, publisher.id(), &service)?;
        Ok(Self { publisher, service })
    }

    /// Publishes a value. Returns the number of readers that received it.
    pub(crate) fn write(&self, value: T) -> Result<usize, PublishError> {
        let sent = self.publisher.send_copy(value);
        sent.map_err(|error| PublishError::failed(&self.service, &error))
    }

    /// Same as [`SliceWriter::refresh`].
    pub(crate) fn refresh(&self) {
        let _ = self.publisher.update_connections();
    }
}

/// Allocates the memory of a publisher, so that writing a message never ends in SIGBUS.
fn allocate(config: &Config, id: UniquePublisherId, service: &str) -> Result<File, ServiceError> {
    let service = service.to_owned();
    memory::allocate(config, id.value()).map_err(|error| match error {
        AllocateError::Full(memory) => ServiceError::Memory { service, memory },
        AllocateError::System(error) => ServiceError::Failed { service, detail: error.to_string() },
    })
}

fn create_publisher<P, H, W>(
    service: &publish_subscribe::PortFactory<ipc_threadsafe::Service, P, H>,
    create: impl Fn() -> Result<W, PublisherCreateError>,
) -> Result<W, ServiceError>
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    let full = PublisherCreateError::ExceedsMaxSupportedPublishers;
    let limit = PortLimit { ports: "writers", max: service.static_config().max_publishers() };
    create_port(service, &full, limit, create)
}
