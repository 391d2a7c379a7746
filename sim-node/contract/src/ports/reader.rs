//! Readers of the publish-subscribe services. They check each message.

use std::fmt::Debug;
use std::sync::Arc;

use iceoryx2::port::ReceiveError;
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::prelude::{IceoryxSend, PortFactory, ZeroCopySend, ipc_threadsafe};
use iceoryx2::sample::Sample;
use iceoryx2::service::header::payload_header::PayloadHeader;
use iceoryx2::service::port_factory::publish_subscribe;
use sim_messages::BORROWED_UPDATES_MAX;
use thiserror::Error;

use crate::ports::port::{PortLimit, SliceHeader, create_port};
use crate::ports::service::{ServiceError, ServiceSpec};
use crate::ports::session::{Slices, Values};
use crate::ports::source::Source;

/// Most refused messages to skip in one read, so that another process cannot keep a reader from
/// returning.
const REFUSALS_MAX: usize = 1024;

/// Error of reading a message.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The reader already holds the most messages that it may.
    #[error("{max} messages of '{service}' are already held: drop one before reading another")]
    TooManyHeld {
        /// Full name of the service.
        service: String,
        /// Most messages that one reader may hold.
        max: usize,
    },
    /// The message contradicts itself. It was dropped.
    #[error("a message of '{service}' was dropped: {detail}")]
    Malformed {
        /// Full name of the service.
        service: String,
        /// The contradiction.
        detail: String,
    },
    /// The reader could not be connected to the service.
    #[error(transparent)]
    Service(#[from] ServiceError),
}

/// Result of draining services.
#[derive(Debug, Default)]
pub(crate) struct Drained {
    /// Number of received messages, including those that could not be read.
    pub(crate) count: usize,
    /// Errors of the messages that could not be read. These messages were dropped.
    pub(crate) errors: Vec<ReadError>,
}

/// A message in shared memory whose header agrees with its payload.
pub(crate) type SliceSample<T, H> = Sample<ipc_threadsafe::Service, [T], H>;

/// A reader of a service of slices.
#[derive(Debug)]
pub(crate) struct SliceReader<T: Debug + ZeroCopySend + 'static, H: SliceHeader> {
    subscriber: Subscriber<ipc_threadsafe::Service, [T], H>,
    service: String,
    buffered: usize,
    borrowed: usize,
    /// Accepted publishers; `None` accepts all.
    source: Option<Arc<Source>>,
}

impl<T: Debug + ZeroCopySend + 'static, H: SliceHeader> SliceReader<T, H> {
    /// Reads the messages of the owner, and drops the messages of other publishers without a trace.
    pub(crate) fn create(
        service: &Slices<T, H>,
        spec: &ServiceSpec,
        owner: &Arc<Source>,
    ) -> Result<Self, ServiceError> {
        let reader = Self::of_every_publisher(service, spec)?;
        Ok(Self { source: Some(Arc::clone(owner)), ..reader })
    }

    pub(crate) fn of_every_publisher(
        service: &Slices<T, H>,
        spec: &ServiceSpec,
    ) -> Result<Self, ServiceError> {
        let subscriber = subscribe(service, spec)?;
        let service = service.name().to_string();
        let ServiceSpec { buffered, borrowed, .. } = *spec;
        Ok(Self { subscriber, service, buffered, borrowed, source: None })
    }

    /// Returns the next message; `None` if all were read.
    pub(crate) fn next(&self) -> Result<Option<SliceSample<T, H>>, ReadError> {
        let received = next_accepted(self.source.as_deref(), || self.subscriber.receive());
        let Some(sample) =
            received.map_err(|error| read_error(&self.service, self.borrowed, error))?
        else {
            return Ok(None);
        };
        let (len, count) = (sample.payload().len(), sample.user_header().element_count());
        if len as u64 == count {
            return Ok(Some(sample));
        }
        let detail = format!("its header counts {count} elements, but it has {len}");
        Err(ReadError::Malformed { service: self.service.clone(), detail })
    }

    /// Returns the newest message and drops older ones; `None` if all were read.
    pub(crate) fn newest(&self) -> Result<Option<SliceSample<T, H>>, ReadError> {
        let mut newest = None;
        self.replace_by_newest(&mut newest)?;
        Ok(newest)
    }

    /// Replaces a message by the newest one, if any has arrived. At most two messages are held at a time.
    pub(crate) fn replace_by_newest(
        &self,
        kept: &mut Option<SliceSample<T, H>>,
    ) -> Result<(), ReadError> {
        // The loop is bounded even if the writer is faster than it: there is at most a buffer of
        // the writer before the last load and a buffer of the present writer.
        for _ in 0..2 * self.buffered {
            match self.next() {
                Ok(Some(sample)) => *kept = Some(sample),
                Ok(None) => break,
                // The program holds all but one of the messages that it may hold.
                Err(ReadError::TooManyHeld { .. }) if kept.is_some() => break,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Passes at most one buffer of messages to `sink`, oldest first.
    pub(crate) fn drain(&self, drained: &mut Drained, mut sink: impl FnMut(&H, &[T])) {
        for _ in 0..self.buffered {
            match self.next() {
                Ok(Some(sample)) => sink(sample.user_header(), sample.payload()),
                Ok(None) => return,
                // Only this message was dropped; the next ones can be read.
                Err(error) => drained.errors.push(error),
            }
            drained.count += 1;
        }
    }
}

/// A reader of a service of single values.
#[derive(Debug)]
pub(crate) struct ValueReader<T: Debug + Copy + ZeroCopySend + 'static> {
    subscriber: Subscriber<ipc_threadsafe::Service, T, ()>,
    service: String,
    buffered: usize,
    /// Accepted publishers; `None` accepts all.
    source: Option<Arc<Source>>,
}

impl<T: Debug + Copy + ZeroCopySend + 'static> ValueReader<T> {
    /// Reads the messages of the owner, and drops the messages of other publishers without a trace.
    pub(crate) fn create(
        service: &Values<T>,
        spec: &ServiceSpec,
        owner: &Arc<Source>,
    ) -> Result<Self, ServiceError> {
        let reader = Self::of_every_publisher(service, spec)?;
        Ok(Self { source: Some(Arc::clone(owner)), ..reader })
    }

    pub(crate) fn of_every_publisher(
        service: &Values<T>,
        spec: &ServiceSpec,
    ) -> Result<Self, ServiceError> {
        let subscriber = subscribe(service, spec)?;
        let (service, buffered) = (service.name().to_string(), spec.buffered);
        Ok(Self { subscriber, service, buffered, source: None })
    }

    /// Returns the next value; `None` if all were read.
    pub(crate) fn next(&self) -> Result<Option<T>, ReadError> {
        let received = next_accepted(self.source.as_deref(), || self.subscriber.receive());
        let sample =
            received.map_err(|error| read_error(&self.service, BORROWED_UPDATES_MAX, error))?;
        Ok(sample.map(|sample| *sample))
    }

    /// Returns the newest value and drops older ones; `None` if all were read.
    pub(crate) fn newest(&self) -> Result<Option<T>, ReadError> {
        let mut newest = None;
        // As for slices: a buffer of the writer before, and a buffer of the present one.
        for _ in 0..2 * self.buffered {
            match self.next()? {
                Some(value) => newest = Some(value),
                None => break,
            }
        }
        Ok(newest)
    }

    /// Passes at most one buffer of values to `sink`, oldest first.
    pub(crate) fn drain(&self, drained: &mut Drained, mut sink: impl FnMut(&T)) {
        for _ in 0..self.buffered {
            match self.next() {
                Ok(Some(value)) => sink(&value),
                Ok(None) => return,
                Err(error) => drained.errors.push(error),
            }
            drained.count += 1;
        }
    }
}

/// Connects a reader. It receives the latched message only where the contract has one: the mirror of a tunnel
/// latches every service.
pub(crate) fn subscribe<P, H>(
    service: &publish_subscribe::PortFactory<ipc_threadsafe::Service, P, H>,
    spec: &ServiceSpec,
) -> Result<Subscriber<ipc_threadsafe::Service, P, H>, ServiceError>
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    let full = SubscriberCreateError::ExceedsMaxSupportedSubscribers;
    let limit = PortLimit { ports: "readers", max: service.static_config().max_subscribers() };
    create_port(service, &full, limit, || {
        service.subscriber_builder().history_request(spec.history).create()
    })
}

/// Receives the next message of an accepted publisher.
fn next_accepted<P, H>(
    source: Option<&Source>,
    receive: impl Fn() -> Result<Option<Sample<ipc_threadsafe::Service, P, H>>, ReceiveError>,
) -> Result<Option<Sample<ipc_threadsafe::Service, P, H>>, ReceiveError>
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    for _ in 0..REFUSALS_MAX {
        let received = receive()?;
        let is_refused = |sample: &Sample<ipc_threadsafe::Service, P, H>| {
            source.is_some_and(|source| !source.accepts(sample.header().node_id()))
        };
        if !received.as_ref().is_some_and(is_refused) {
            return Ok(received);
        }
    }
    Ok(None)
}

fn read_error(service: &str, max: usize, error: ReceiveError) -> ReadError {
    let service = service.to_owned();
    match error {
        ReceiveError::ExceedsMaxBorrows => ReadError::TooManyHeld { service, max },
        ReceiveError::ConnectionFailure(error) => ServiceError::failed(&service, &error).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ports::service::TEARS;
    use crate::ports::session::{Access, Session};
    use crate::testing::TestDomain;
    use sim_messages::{TearsHeader, TornConstraint};

    #[test]
    fn a_message_with_a_wrong_length_in_its_header_is_dropped_and_the_next_one_is_read() {
        let domain = TestDomain::new();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service: Slices<TornConstraint, TearsHeader> =
            session.slices(&TEARS, Access::Create).unwrap();
        let reader = SliceReader::of_every_publisher(&service, &TEARS).unwrap();
        let publisher = service.publisher_builder().initial_max_slice_len(2).create().unwrap();
        for count in [3, 2] {
            let mut sample = publisher.loan_slice(2).unwrap();
            sample.user_header_mut().count = count;
            sample.send().unwrap();
        }
        assert_eq!(
            reader.next().unwrap_err().to_string(),
            "a message of 'sim/tears' was dropped: its header counts 3 elements, but it has 2"
        );
        assert_eq!(reader.next().unwrap().unwrap().payload(), [TornConstraint::default(); 2]);
    }
}
