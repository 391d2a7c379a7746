//! The newest message of a latched service, kept so that it can be read again.

use std::fmt::Debug;
use std::sync::Arc;

use iceoryx2::prelude::ZeroCopySend;

use crate::ports::port::SliceHeader;
use crate::ports::reader::{ReadError, SliceReader, SliceSample};
use crate::ports::service::{ServiceError, ServiceSpec};
use crate::ports::services::Attachment;
use crate::ports::session::Slices;
use crate::ports::source::Source;

/// A reader that keeps its newest message.
#[derive(Debug)]
pub(crate) struct Latch<T: Debug + ZeroCopySend + 'static, H: SliceHeader> {
    reader: SliceReader<T, H>,
    kept: Option<SliceSample<T, H>>,
}

impl<T: Debug + ZeroCopySend + 'static, H: SliceHeader> Latch<T, H> {
    pub(crate) fn create(
        service: &Slices<T, H>,
        spec: &ServiceSpec,
        owner: &Arc<Source>,
    ) -> Result<Self, ServiceError> {
        Ok(Self { reader: SliceReader::create(service, spec, owner)?, kept: None })
    }

    /// Returns the newest message; `None` if none has arrived yet. Then it asks an owner on another host.
    pub(crate) fn newest(
        &mut self,
        attachment: &Attachment,
    ) -> Result<Option<&SliceSample<T, H>>, ReadError> {
        self.reader.replace_by_newest(&mut self.kept)?;
        if self.kept.is_none() {
            attachment.request_latched();
        }
        Ok(self.kept.as_ref())
    }
}
