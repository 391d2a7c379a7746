//! Readers that keep a message, so that it can be read again: the newest one of a latched service, or the forces of a
//! snapshot.

use std::sync::Arc;

use bytemuck::Pod;
use iceoryx2::prelude::ZeroCopySend;
use sim_messages::{ForceRow, ForcesHeader, SnapshotHeader};

use crate::client::views::Forces;
use crate::ports::port::{Header, Service};
use crate::ports::reader::{ReadError, Reader, Sample};
use crate::ports::service::{FORCES, ServiceError, ServiceSpec};
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

/// A reader of forces that keeps the message that it read last.
#[derive(Debug)]
pub(crate) struct ForcesReader {
    reader: Reader<ForceRow, ForcesHeader>,
    kept: Option<Sample<ForceRow, ForcesHeader>>,
}

/// Forces of a step that have arrived, or will not come.
#[derive(Debug)]
pub(crate) enum Search {
    Found(Forces),
    /// Those of a later step have arrived.
    Passed,
}

impl ForcesReader {
    pub(crate) fn create(attachment: &Attachment) -> Result<Self, ServiceError> {
        let Attachment { services, source, .. } = attachment;
        Ok(Self { reader: Reader::create(&services.forces, &FORCES, source)?, kept: None })
    }

    /// Reads all messages, and returns the last one.
    pub(crate) fn newest(&mut self) -> Result<Option<Forces>, ReadError> {
        self.reader.replace_by_newest(&mut self.kept)?;
        Ok(self.kept.as_ref().map(to_forces))
    }

    /// Reads messages up to that of a step. `None` if it has not arrived yet.
    pub(crate) fn of_step(&mut self, wanted: &SnapshotHeader) -> Result<Option<Search>, ReadError> {
        loop {
            if let Some(kept) = &self.kept
                && kept.user_header().run_id == wanted.run_id
                && kept.user_header().step >= wanted.step
            {
                let is_found = kept.user_header().step == wanted.step;
                let found = is_found.then(|| Search::Found(to_forces(kept)));
                return Ok(Some(found.unwrap_or(Search::Passed)));
            }
            match self.reader.next()? {
                Some(next) => self.kept = Some(next),
                None => return Ok(None),
            }
        }
    }
}

fn to_forces(sample: &Sample<ForceRow, ForcesHeader>) -> Forces {
    Forces { header: *sample.user_header(), rows: sample.payload().to_vec() }
}
