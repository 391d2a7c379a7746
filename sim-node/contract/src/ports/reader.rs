//! Readers of the publish-subscribe services. They check each message.

use std::marker::PhantomData;
use std::sync::Arc;

use bytemuck::{Pod, cast_slice, from_bytes};
use iceoryx2::port::ReceiveError;
use iceoryx2::port::subscriber::SubscriberCreateError;
use iceoryx2::prelude::{PortFactory, ZeroCopySend};
use thiserror::Error;

use crate::ports::port::{Header, PortLimit, Service, create_port};
use crate::ports::raw::{self, Subscriber};
use crate::ports::service::{ServiceError, ServiceSpec};
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

/// A message in shared memory: a payload of `T`s and the header `H`.
#[derive(Debug)]
pub(crate) struct Sample<T, H = ()> {
    raw: raw::Sample,
    _types: PhantomData<fn() -> (T, H)>,
}

impl<T: Pod, H: Pod> Sample<T, H> {
    pub(crate) fn payload(&self) -> &[T] {
        cast_slice(self.raw.payload())
    }

    pub(crate) fn user_header(&self) -> &H {
        from_bytes(self.raw.header())
    }

    /// Returns the number of the publisher.
    pub(crate) fn origin(&self) -> u128 {
        self.raw.origin().value()
    }
}

/// A reader of messages with a payload of `T`s and the header `H`.
#[derive(Debug)]
pub(crate) struct Reader<T, H = ()> {
    port: Port,
    _types: PhantomData<fn() -> (T, H)>,
}

/// A reader of any messages.
#[derive(Debug)]
struct Port {
    subscriber: Subscriber,
    service: String,
    buffered: usize,
    borrowed: usize,
    /// Accepted publishers; `None` accepts all.
    source: Option<Arc<Source>>,
}

impl<T: Pod + ZeroCopySend, H: Header> Reader<T, H> {
    /// Reads the messages of the owner, and drops the messages of other publishers without a trace.
    pub(crate) fn create(
        service: &Service<T, H>,
        spec: &ServiceSpec,
        owner: &Arc<Source>,
    ) -> Result<Self, ServiceError> {
        let port = Port::create(service, spec, Some(Arc::clone(owner)))?;
        Ok(Self { port, _types: PhantomData })
    }

    pub(crate) fn of_every_publisher(
        service: &Service<T, H>,
        spec: &ServiceSpec,
    ) -> Result<Self, ServiceError> {
        Ok(Self { port: Port::create(service, spec, None)?, _types: PhantomData })
    }

    /// Returns the next message, even if its header disagrees with its payload; `None` if all were read.
    pub(crate) fn receive(&self) -> Result<Option<Sample<T, H>>, ReadError> {
        Ok(self.port.receive()?.map(|raw| Sample { raw, _types: PhantomData }))
    }

    /// Returns the next message; `None` if all were read.
    pub(crate) fn next(&self) -> Result<Option<Sample<T, H>>, ReadError> {
        let Some(sample) = self.receive()? else { return Ok(None) };
        let (len, count) = (sample.payload().len(), sample.user_header().element_count());
        self.port.check(len, count).map(|()| Some(sample))
    }

    /// Returns the newest message and drops older ones; `None` if all were read.
    pub(crate) fn newest(&self) -> Result<Option<Sample<T, H>>, ReadError> {
        let mut newest = None;
        self.replace_by_newest(&mut newest)?;
        Ok(newest)
    }

    /// Replaces a message by the newest one, if any has arrived. At most two messages are held at a time.
    pub(crate) fn replace_by_newest(
        &self,
        kept: &mut Option<Sample<T, H>>,
    ) -> Result<(), ReadError> {
        // The loop is bounded even if the writer is faster than it: there is at most a buffer of
        // the writer before the last load and a buffer of the present writer.
        for _ in 0..2 * self.port.buffered {
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
        for _ in 0..self.port.buffered {
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

impl<T: Pod + ZeroCopySend> Reader<T> {
    /// Returns the newest value and drops older ones; `None` if all were read.
    pub(crate) fn newest_value(&self) -> Result<Option<T>, ReadError> {
        Ok(self.newest()?.and_then(|sample| sample.payload().first().copied()))
    }

    /// Passes at most one buffer of values to `sink`, oldest first.
    pub(crate) fn drain_values(&self, drained: &mut Drained, sink: impl FnMut(&T)) {
        let mut sink = sink;
        self.drain(drained, |(), values| values.iter().for_each(&mut sink));
    }
}

impl Port {
    /// Connects a reader. It receives the latched message only where the contract has one: the mirror of a tunnel
    /// latches every service.
    fn create(
        service: &raw::Service,
        spec: &ServiceSpec,
        source: Option<Arc<Source>>,
    ) -> Result<Self, ServiceError> {
        let full = SubscriberCreateError::ExceedsMaxSupportedSubscribers;
        let limit = PortLimit { ports: "readers", max: service.static_config().max_subscribers() };
        let create = || Subscriber::create(service, spec.history);
        let subscriber = create_port(service, &full, limit, create)?;
        let service = service.name().to_string();
        let ServiceSpec { buffered, borrowed, .. } = *spec;
        Ok(Self { subscriber, service, buffered, borrowed, source })
    }

    /// Receives the next message of an accepted publisher.
    fn receive(&self) -> Result<Option<raw::Sample>, ReadError> {
        for _ in 0..REFUSALS_MAX {
            let received = self.subscriber.receive().map_err(|error| self.error(error))?;
            let is_refused = |sample: &raw::Sample| {
                self.source.as_ref().is_some_and(|source| !source.accepts(sample.node()))
            };
            if !received.as_ref().is_some_and(is_refused) {
                return Ok(received);
            }
        }
        Ok(None)
    }

    fn error(&self, error: ReceiveError) -> ReadError {
        let service = self.service.clone();
        match error {
            ReceiveError::ExceedsMaxBorrows => {
                ReadError::TooManyHeld { service, max: self.borrowed }
            }
            ReceiveError::ConnectionFailure(error) => ServiceError::failed(&service, &error).into(),
        }
    }

    /// Compares the length of a payload with the one in its header.
    fn check(&self, len: usize, count: u64) -> Result<(), ReadError> {
        if len as u64 == count {
            return Ok(());
        }
        let detail = format!("its header counts {count} elements, but it has {len}");
        Err(ReadError::Malformed { service: self.service.clone(), detail })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ports::service::TEARS;
    use crate::ports::session::{Access, Session};
    use crate::ports::writer::{Capacity, Writer};
    use crate::testing::TestDomain;
    use sim_messages::{TearsHeader, TornConstraint};

    #[test]
    fn a_message_with_a_wrong_length_in_its_header_is_dropped_and_the_next_one_is_read() {
        let domain = TestDomain::new();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service: Service<TornConstraint, TearsHeader> =
            session.service(&TEARS, Access::Create).unwrap();
        let reader = Reader::of_every_publisher(&service, &TEARS).unwrap();
        let capacity = Capacity { len_max: 2, samples: 3 };
        let writer = Writer::create(session.config(), &service, capacity).unwrap();
        for count in [3, 2] {
            let header = TearsHeader { count, ..TearsHeader::default() };
            writer.send_elements(header, 2, |_| TornConstraint::default()).unwrap();
        }
        assert_eq!(
            reader.next().unwrap_err().to_string(),
            "a message of 'sim/tears' was dropped: its header counts 3 elements, but it has 2"
        );
        assert_eq!(reader.next().unwrap().unwrap().payload(), [TornConstraint::default(); 2]);
    }
}
