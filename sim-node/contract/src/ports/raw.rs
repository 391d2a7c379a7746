//! Publish-subscribe services and ports whose type of message is a value.
//!
//! iceoryx2 compiles its services and ports for each type of payload and header. Those of this file are compiled
//! once for all messages. `port.rs`, `reader.rs` and `writer.rs` add the types again. Other programs see no difference:
//! names, sizes and alignments of the types are those of the typed ports.
#![allow(
    unsafe_code,
    reason = "iceoryx2 cannot check messages of a type that the compiler does not know"
)]

use std::fmt::Debug;
use std::{ptr, slice};

use iceoryx2::identifiers::{UniqueNodeId, UniquePublisherId};
use iceoryx2::port::ReceiveError;
use iceoryx2::port::publisher::{self, PublisherCreateError};
use iceoryx2::port::subscriber::{self, SubscriberCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::{
    BackpressureStrategy, Node, PortFactory, PortName, ServiceName, ZeroCopySend, ipc_threadsafe,
};
use iceoryx2::sample;
use iceoryx2::service::builder::publish_subscribe;
use iceoryx2::service::header::payload_header::PayloadHeader;
use iceoryx2::service::marker::{CustomHeaderMarker, CustomPayloadMarker};
use iceoryx2::service::port_factory;
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};

type Ipc = ipc_threadsafe::Service;
/// Bytes of any payload.
type Payload = [CustomPayloadMarker];
/// A header of any size.
type Header = CustomHeaderMarker;

/// A publish-subscribe service.
pub(crate) type Service = port_factory::publish_subscribe::PortFactory<Ipc, Payload, Header>;
/// A builder of a service.
pub(crate) type Builder = publish_subscribe::Builder<Payload, Header, Ipc>;

/// The types of the messages of a service.
#[derive(Debug)]
pub(crate) struct MessageType {
    payload: TypeDetail,
    header: TypeDetail,
}

impl MessageType {
    /// Returns the type of messages with the header `H`, and a payload of single `T`s or slices of `T`.
    pub(crate) fn of<T: ZeroCopySend, H: ZeroCopySend>(variant: TypeVariant) -> Self {
        Self {
            payload: TypeDetail::new::<T>(variant),
            header: TypeDetail::new::<H>(TypeVariant::FixedSize),
        }
    }
}

/// Begins to open or create a service.
pub(crate) fn builder(node: &Node<Ipc>, name: &ServiceName, message: &MessageType) -> Builder {
    let builder = node.service_builder(name).publish_subscribe::<Payload>().user_header::<Header>();
    // SAFETY: the ports of this file read and write a payload as bytes, so its type only has to be plain data.
    let builder = unsafe { builder.__internal_set_payload_type_details(&message.payload) };
    // SAFETY: the same holds for the header.
    unsafe { builder.__internal_set_user_header_type_details(&message.header) }
}

fn header_size(service: &Service) -> usize {
    service.static_config().message_type_details().user_header.size()
}

/// Memory of a publisher.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Capacity {
    /// Most elements of a message.
    pub(crate) len_max: usize,
    /// Most messages in use at the same time.
    pub(crate) samples: usize,
}

/// A publisher that drops a message for a reader with a full queue.
#[derive(Debug)]
pub(crate) struct Publisher {
    port: publisher::Publisher<Ipc, Payload, Header>,
    header_size: usize,
    variant: TypeVariant,
}

impl Publisher {
    /// Creates a publisher that other processes see under a name.
    pub(crate) fn create(
        service: &Service,
        capacity: Capacity,
        name: &PortName,
    ) -> Result<Self, PublisherCreateError> {
        let Capacity { len_max, samples } = capacity;
        let builder = service.publisher_builder().name(name).initial_max_slice_len(len_max);
        let port = builder
            .max_loaned_samples(1)
            .override_sample_preallocation(move |_| samples)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()?;
        let variant = service.static_config().message_type_details().payload.variant();
        Ok(Self { port, header_size: header_size(service), variant })
    }

    pub(crate) fn id(&self) -> UniquePublisherId {
        self.port.id()
    }

    /// Sends a message of `len` elements, whose payload `write` fills. Returns the number of readers that received it.
    /// On error, returns the text of the error of iceoryx2.
    pub(crate) fn send(
        &self,
        header: &[u8],
        len: usize,
        write: &mut dyn FnMut(&mut [u8]),
    ) -> Result<usize, String> {
        assert!(header.len() == self.header_size, "a header of another service");
        assert!(len == 1 || self.variant == TypeVariant::Dynamic, "several single values");
        // SAFETY: a message of single values has one element.
        let mut loan = unsafe { self.port.loan_custom_payload(len) }.map_err(text)?;
        let payload = loan.payload_mut();
        let (start, size) = (payload.as_mut_ptr().cast::<u8>(), payload.len());
        // SAFETY: these bytes belong to the loan alone, and the kernel has initialized all of shared memory.
        write(unsafe { slice::from_raw_parts_mut(start, size) });
        let target = ptr::from_mut(loan.user_header_mut()).cast::<u8>();
        // SAFETY: the loan has a header of this size.
        unsafe { ptr::copy_nonoverlapping(header.as_ptr(), target, header.len()) };
        // SAFETY: header and payload are written.
        unsafe { loan.assume_init() }.send().map_err(text)
    }

    /// Connects to readers that joined, which then receive the latched message.
    pub(crate) fn refresh(&self) {
        // A reader that cannot be reached does not concern the writer.
        let _ = self.port.update_connections();
    }
}

fn text(error: impl Debug) -> String {
    format!("{error:?}")
}

/// A subscriber.
#[derive(Debug)]
pub(crate) struct Subscriber {
    port: subscriber::Subscriber<Ipc, Payload, Header>,
    header_size: usize,
}

impl Subscriber {
    /// Creates a subscriber that receives the last `history` messages.
    pub(crate) fn create(service: &Service, history: usize) -> Result<Self, SubscriberCreateError> {
        let port = service.subscriber_builder().history_request(history).create()?;
        Ok(Self { port, header_size: header_size(service) })
    }

    pub(crate) fn receive(&self) -> Result<Option<Sample>, ReceiveError> {
        let header_size = self.header_size;
        Ok(self.port.receive()?.map(|sample| Sample { sample, header_size }))
    }
}

/// A message in shared memory.
#[derive(Debug)]
pub(crate) struct Sample {
    sample: sample::Sample<Ipc, Payload, Header>,
    header_size: usize,
}

impl Sample {
    pub(crate) fn payload(&self) -> &[u8] {
        let payload = self.sample.payload();
        // SAFETY: an element of this slice is a byte.
        unsafe { slice::from_raw_parts(payload.as_ptr().cast(), payload.len()) }
    }

    pub(crate) fn header(&self) -> &[u8] {
        let header = ptr::from_ref(self.sample.user_header()).cast();
        // SAFETY: every message of the service has a header of this size.
        unsafe { slice::from_raw_parts(header, self.header_size) }
    }

    /// Returns the publisher of the message.
    pub(crate) fn origin(&self) -> UniquePublisherId {
        self.sample.origin()
    }

    /// Returns the iceoryx2 node of the publisher.
    pub(crate) fn node(&self) -> UniqueNodeId {
        self.sample.header().node_id()
    }
}
