//! The reading ends of the publish-subscribe services: they check what they are given.

use std::fmt::Debug;

use iceoryx2::port::ReceiveError;
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::prelude::{IceoryxSend, PortFactory, ZeroCopySend, ipc};
use iceoryx2::sample::Sample;
use iceoryx2::service::port_factory::publish_subscribe;
use thiserror::Error;

use crate::limits::BORROWED_SAMPLES_MAX;
use crate::ports::port::{Counted, Places, create_port};
use crate::ports::service::{ServiceError, ServiceSpec};
use crate::ports::session::{Slices, Values};

/// Why a message could not be read.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// This reader holds as many messages as it may.
    #[error("{max} messages of '{service}' are held already: drop one before taking another")]
    TooManyHeld {
        /// The service's full name.
        service: String,
        /// Most messages that one reader may hold.
        max: usize,
    },
    /// The message contradicts itself; it was dropped.
    #[error("a message of '{service}' was dropped: {detail}")]
    Malformed {
        /// The service's full name.
        service: String,
        /// What is wrong with it.
        detail: String,
    },
    /// The reader could not be connected to the service.
    #[error(transparent)]
    Service(#[from] ServiceError),
}

/// What came of reading all that there was.
#[derive(Debug, Default)]
pub struct Drained {
    /// Messages taken, those that could not be read included.
    pub count: usize,
    /// Why some could not be read; each of them was dropped.
    pub errors: Vec<ReadError>,
}

/// A payload whose header agrees with it, in shared memory.
pub(crate) type SliceSample<T, H> = Sample<ipc::Service, [T], H>;

/// The reading end of a service of slices.
#[derive(Debug)]
pub(crate) struct SliceReader<T: Debug + ZeroCopySend + 'static, H: Counted> {
    subscriber: Subscriber<ipc::Service, [T], H>,
    service: String,
    buffered: usize,
}

impl<T: Debug + ZeroCopySend + 'static, H: Counted> SliceReader<T, H> {
    pub(crate) fn create(service: &Slices<T, H>, spec: &ServiceSpec) -> Result<Self, ServiceError> {
        let subscriber = subscribe(service)?;
        Ok(Self { subscriber, service: service.name().to_string(), buffered: spec.buffered })
    }

    /// The next message, if there is one.
    pub(crate) fn next(&self) -> Result<Option<SliceSample<T, H>>, ReadError> {
        let received = self.subscriber.receive();
        let Some(sample) = received.map_err(|error| read_error(&self.service, error))? else {
            return Ok(None);
        };
        let (len, count) = (sample.payload().len(), sample.user_header().count());
        if len as u64 == count {
            return Ok(Some(sample));
        }
        let detail = format!("its header counts {count} elements, but it has {len}");
        Err(ReadError::Malformed { service: self.service.clone(), detail })
    }

    /// The newest message, if there is any; older ones are dropped.
    pub(crate) fn newest(&self) -> Result<Option<SliceSample<T, H>>, ReadError> {
        let mut newest = None;
        // A writer that is faster than this loop does not keep it: the most that it takes is a
        // buffer of the writer before the last load and one of the present writer.
        for _ in 0..2 * self.buffered {
            match self.next()? {
                Some(sample) => newest = Some(sample),
                None => break,
            }
        }
        Ok(newest)
    }

    /// Shows at most one buffer of messages to `sink`, oldest first.
    pub(crate) fn drain(&self, drained: &mut Drained, mut sink: impl FnMut(&H, &[T])) {
        for _ in 0..self.buffered {
            match self.next() {
                Ok(Some(sample)) => sink(sample.user_header(), sample.payload()),
                Ok(None) => return,
                // It was dropped; those behind it are as good as ever.
                Err(error) => drained.errors.push(error),
            }
            drained.count += 1;
        }
    }
}

/// The reading end of a service of single values.
#[derive(Debug)]
pub(crate) struct ValueReader<T: Debug + Copy + ZeroCopySend + 'static> {
    subscriber: Subscriber<ipc::Service, T, ()>,
    service: String,
    buffered: usize,
}

impl<T: Debug + Copy + ZeroCopySend + 'static> ValueReader<T> {
    pub(crate) fn create(service: &Values<T>, spec: &ServiceSpec) -> Result<Self, ServiceError> {
        let subscriber = subscribe(service)?;
        Ok(Self { subscriber, service: service.name().to_string(), buffered: spec.buffered })
    }

    /// The next value, if there is one.
    pub(crate) fn next(&self) -> Result<Option<T>, ReadError> {
        let received = self.subscriber.receive();
        let sample = received.map_err(|error| read_error(&self.service, error))?;
        Ok(sample.map(|sample| *sample))
    }

    /// The newest value, if there is any; older ones are dropped.
    pub(crate) fn newest(&self) -> Result<Option<T>, ReadError> {
        let mut newest = None;
        for _ in 0..self.buffered {
            match self.next()? {
                Some(value) => newest = Some(value),
                None => break,
            }
        }
        Ok(newest)
    }

    /// Shows at most one buffer of values to `sink`, oldest first.
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

pub(crate) fn subscribe<P, H>(
    service: &publish_subscribe::PortFactory<ipc::Service, P, H>,
) -> Result<Subscriber<ipc::Service, P, H>, ServiceError>
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    let full = SubscriberCreateError::ExceedsMaxSupportedSubscribers;
    let places = Places { what: "readers", max: service.static_config().max_subscribers() };
    create_port(service, &full, places, || service.subscriber_builder().create())
}

fn read_error(service: &str, error: ReceiveError) -> ReadError {
    let service = service.to_owned();
    match error {
        ReceiveError::ExceedsMaxBorrows => {
            ReadError::TooManyHeld { service, max: BORROWED_SAMPLES_MAX }
        }
        ReceiveError::ConnectionFailure(error) => ServiceError::failed(&service, &error).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::tears::{TearsHeader, TornConstraint};
    use crate::ports::service::TEARS;
    use crate::ports::session::{Access, Session};
    use crate::testing::TestDomain;

    #[test]
    fn a_message_whose_header_lies_about_its_length_is_refused_and_the_next_one_is_read() {
        let domain = TestDomain::new();
        let session = Session::join(&domain.endpoint()).unwrap();
        let service: Slices<TornConstraint, TearsHeader> =
            session.slices(&TEARS, Access::Create).unwrap();
        let reader = SliceReader::create(&service, &TEARS).unwrap();
        let stranger = service.publisher_builder().initial_max_slice_len(2).create().unwrap();
        for count in [3, 2] {
            let mut sample = stranger.loan_slice(2).unwrap();
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
