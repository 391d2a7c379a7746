//! The start of a file, which says how to read the rest: the scene, the selection and the run.

use mcap::records::Metadata;

use super::content::ContentCheck;
use super::finding::Findings;
use crate::log::read_error::{LogEnd, ReadError};
use crate::log::run::selection::{ContentSelection, SELECTION_METADATA};
use crate::log::run::{CLOSING_METADATA, Closing, RUN_METADATA, SCENE_ATTACHMENT};
use crate::log::scanner::RecordScanner;

/// The start of a file, as far as it was read.
#[derive(Debug, Default)]
pub(super) struct FileHead {
    /// The library in the header of the file.
    pub(super) library: String,
    scene_size_bytes: usize,
    selection: ContentSelection,
    /// The checks of the messages, once the run is known.
    pub(super) content: Option<ContentCheck>,
    /// The scanner does not know the limits of the scene yet.
    has_new_limits: bool,
    /// The end of the recording.
    pub(super) closing: Option<Closing>,
}

impl FileHead {
    /// Returns `true` if an attachment is the scene of the run.
    pub(super) fn is_scene(&self, name: &str) -> bool {
        name == SCENE_ATTACHMENT && self.content.is_none()
    }

    pub(super) fn add_scene(&mut self, size_bytes: usize) {
        self.scene_size_bytes = size_bytes;
    }

    /// Allows for a scene in a damaged part before the first message.
    pub(super) fn add_damage(&mut self, size_bytes: u64) {
        if self.content.is_none() {
            let size_bytes = usize::try_from(size_bytes).unwrap_or(usize::MAX);
            self.scene_size_bytes = size_bytes.min(sim_messages::SCENE_SIZE_BYTES_MAX);
        }
    }

    pub(super) fn add_metadata(&mut self, metadata: &Metadata) -> Result<(), ReadError> {
        let Metadata { name, metadata } = metadata;
        if name == RUN_METADATA && self.content.is_none() {
            let content = ContentCheck::new(metadata, self.selection, self.scene_size_bytes)?;
            (self.content, self.has_new_limits) = (Some(content), true);
        } else if name == SELECTION_METADATA {
            self.selection = ContentSelection::read(metadata)?;
        } else if name == CLOSING_METADATA {
            self.closing = Some(Closing::from_map(metadata));
        }
        Ok(())
    }

    /// Passes the limits of the scene to a scanner, once they are known.
    pub(super) fn pass_limits<R: std::io::Read>(&mut self, scanner: &mut RecordScanner<R>) {
        if let Some(content) = &self.content
            && std::mem::take(&mut self.has_new_limits)
        {
            scanner.set_limits(*content.limits());
        }
    }

    /// Returns the error of a file without a readable description of its run.
    pub(super) fn no_run(&self, findings: &Findings) -> ReadError {
        let Some(first) = findings.list().first() else {
            return ReadError::Foreign { library: self.library.clone() };
        };
        ReadError::NoHeader(LogEnd::Damaged { byte: first.byte, cause: first.what.clone() })
    }
}
