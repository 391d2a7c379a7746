//! The newest message of a latched service, held so that it can be asked for again.

use std::fmt::Debug;

use iceoryx2::prelude::ZeroCopySend;

use crate::ports::port::Counted;
use crate::ports::reader::{ReadError, SliceReader, SliceSample};
use crate::ports::service::{ServiceError, ServiceSpec};
use crate::ports::session::Slices;

/// A reader that remembers its newest message.
#[derive(Debug)]
pub(crate) struct Latch<T: Debug + ZeroCopySend + 'static, H: Counted> {
    reader: SliceReader<T, H>,
    held: Option<SliceSample<T, H>>,
}

impl<T: Debug + ZeroCopySend + 'static, H: Counted> Latch<T, H> {
    pub(crate) fn create(service: &Slices<T, H>, spec: &ServiceSpec) -> Result<Self, ServiceError> {
        Ok(Self { reader: SliceReader::create(service, spec)?, held: None })
    }

    /// The newest message, if there has been any.
    pub(crate) fn newest(&mut self) -> Result<Option<&SliceSample<T, H>>, ReadError> {
        if let Some(sample) = self.reader.newest()? {
            self.held = Some(sample);
        }
        Ok(self.held.as_ref())
    }
}
