//! The newest message of a latched service, kept so that it can be read again.

use std::sync::Arc;

use bytemuck::Pod;
use iceoryx2::prelude::ZeroCopySend;

use crate::ports::port::{Header, Service};
use crate::ports::reader::{ReadError, Reader, Sample};
use crate::ports::service::{ServiceError, ServiceSpec};
use crate::ports::services::Attachment;
use crate::ports::source::Source;

/// A reader that keeps its newest message.
#[derive(Debug)]
pub(crate) struct Latch<T, H> {
    reader: Reader<T, H>,
    kept: Option<Sample<T, H>>,
}

impl<T: Pod + ZeroCopySend, H: Header> Latch<T, H> {
    pub(crate) fn create(
        service: &Service<T, H>,
        spec: &ServiceSpec,
        owner: &Arc<Source>,
    ) -> Result<Self, ServiceError> {
        Ok(Self { reader: Reader::create(service, spec, owner)?, kept: None })
    }

    /// Returns the newest message; `None` if none has arrived yet. Then it asks an owner on another host.
    pub(crate) fn newest(
        &mut self,
        attachment: &Attachment,
    ) -> Result<Option<&Sample<T, H>>, ReadError> {
        self.reader.replace_by_newest(&mut self.kept)?;
        if self.kept.is_none() {
            attachment.request_latched();
        }
        Ok(self.kept.as_ref())
    }
}
