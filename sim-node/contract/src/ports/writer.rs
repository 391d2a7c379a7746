//! The writing ends of the publish-subscribe services: they never wait for a reader.

use std::fmt::Debug;

use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{BackpressureStrategy, IceoryxSend, PortFactory, ZeroCopySend, ipc};
use iceoryx2::service::port_factory::publish_subscribe;
use thiserror::Error;

use crate::ports::port::{Counted, Places, create_port};
use crate::ports::service::{ServiceError, ServiceSpec};
use crate::ports::session::{Slices, Values};

/// Why a message was not published. The owner is as before, and can go on.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PublishError {
    /// The message is longer than what the load announced.
    #[error(
        "{len} elements do not fit into a message of '{service}', which the load limited to {len_max}"
    )]
    TooLong {
        /// The service's full name.
        service: String,
        /// Elements of the message.
        len: usize,
        /// Most elements of a message.
        len_max: usize,
    },
    /// No memory for the message could be had, or it could not be sent.
    #[error("cannot publish on '{service}': {detail}")]
    Failed {
        /// The service's full name.
        service: String,
        /// What iceoryx2 says.
        detail: String,
    },
}

impl PublishError {
    fn failed(service: &str, detail: &dyn Debug) -> Self {
        Self::Failed { service: service.to_owned(), detail: format!("{detail:?}") }
    }
}

/// How much memory a writer of slices has.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Capacity {
    /// Most elements of a message.
    pub(crate) len_max: usize,
    /// Messages in use at the same time.
    pub(crate) samples: usize,
}

/// The writing end of a service of slices.
#[derive(Debug)]
pub(crate) struct SliceWriter<T: Debug + ZeroCopySend + 'static, H: Counted> {
    publisher: Publisher<ipc::Service, [T], H>,
    service: String,
    len_max: usize,
}

impl<T: Debug + Copy + ZeroCopySend + 'static, H: Counted> SliceWriter<T, H> {
    pub(crate) fn create(service: &Slices<T, H>, capacity: Capacity) -> Result<Self, ServiceError> {
        let Capacity { len_max, samples } = capacity;
        let publisher = publish(service, || {
            service
                .publisher_builder()
                .initial_max_slice_len(len_max)
                .max_loaned_samples(1)
                .override_sample_preallocation(move |_| samples)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
        })?;
        Ok(Self { publisher, service: service.name().to_string(), len_max })
    }

    /// Publishes `element(0)`, `element(1)`, ... as one message of `header.count()` elements,
    /// written straight into shared memory, once.
    pub(crate) fn write(
        &self,
        header: H,
        element: impl Fn(usize) -> T,
    ) -> Result<(), PublishError> {
        let len = usize::try_from(header.count()).unwrap_or(usize::MAX);
        if len > self.len_max {
            let (service, len_max) = (self.service.clone(), self.len_max);
            return Err(PublishError::TooLong { service, len, len_max });
        }
        let failed = |error: &dyn Debug| PublishError::failed(&self.service, error);
        let loan = self.publisher.loan_slice_uninit(len).map_err(|error| failed(&error))?;
        let mut sample = loan.write_from_fn(element);
        *sample.user_header_mut() = header;
        sample.send().map_err(|error| failed(&error))?;
        Ok(())
    }

    /// Gives the latched message to readers that have come since the last one was written.
    pub(crate) fn refresh(&self) {
        // A reader that cannot be reached is none of the owner's concern.
        let _ = self.publisher.update_connections();
    }
}

/// The writing end of a service of single values.
#[derive(Debug)]
pub(crate) struct ValueWriter<T: Debug + Copy + ZeroCopySend + 'static> {
    publisher: Publisher<ipc::Service, T, ()>,
    service: String,
}

impl<T: Debug + Copy + ZeroCopySend + 'static> ValueWriter<T> {
    pub(crate) fn create(service: &Values<T>, spec: &ServiceSpec) -> Result<Self, ServiceError> {
        let samples = spec.samples_in_use_max();
        let publisher = publish(service, || {
            service
                .publisher_builder()
                .max_loaned_samples(1)
                .override_sample_preallocation(move |_| samples)
                .backpressure_strategy(BackpressureStrategy::DiscardData)
                .create()
        })?;
        Ok(Self { publisher, service: service.name().to_string() })
    }

    /// Publishes a value; returns how many readers' buffers have taken it.
    pub(crate) fn write(&self, value: T) -> Result<usize, PublishError> {
        let sent = self.publisher.send_copy(value);
        sent.map_err(|error| PublishError::failed(&self.service, &error))
    }

    /// As [`SliceWriter::refresh`].
    pub(crate) fn refresh(&self) {
        let _ = self.publisher.update_connections();
    }
}

fn publish<P, H, W>(
    service: &publish_subscribe::PortFactory<ipc::Service, P, H>,
    create: impl Fn() -> Result<W, PublisherCreateError>,
) -> Result<W, ServiceError>
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    let full = PublisherCreateError::ExceedsMaxSupportedPublishers;
    let places = Places { what: "writers", max: service.static_config().max_publishers() };
    create_port(service, &full, places, create)
}
