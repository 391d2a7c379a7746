//! Attachments that are too long for memory.

use std::io::{Read, Seek, Write};

use super::{Repair, RepairError};
use crate::log::container::attachment::{Checksum, LongAttachment, WRONG_CHECKSUM};
use crate::log::container::walk::Walk;

impl<W: Write> Repair<W> {
    /// Copies a long attachment in pieces. No message is missing without it.
    pub(super) fn add_long_attachment<R: Read + Seek>(
        &mut self,
        walk: &mut Walk<R>,
        attachment: LongAttachment,
        checksum: Checksum,
    ) -> Result<(), RepairError> {
        let LongAttachment { byte, header, data, .. } = attachment;
        if self.content.is_none() {
            return self.lose(
                byte,
                "attachment",
                "it is too long to stand before the metadata 'run'",
            );
        }
        self.begin()?;
        let Some(salvage) = &mut self.salvage else { return Ok(()) };
        if checksum == Checksum::Wrong {
            self.findings.add(byte, "attachment", WRONG_CHECKSUM);
            salvage.losses.add_attachment();
            return Ok(());
        }
        salvage.start_attachment(data.end - data.start, header)?;
        let mut at = data.start;
        while at < data.end {
            let block = walk.block(at..data.end)?;
            salvage.put_attachment_bytes(block)?;
            at += block.len() as u64;
        }
        Ok(salvage.finish_attachment()?)
    }
}
