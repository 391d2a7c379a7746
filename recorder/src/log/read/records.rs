//! The records of an MCAP file, one by one, with every checksum verified.

use std::io::{ErrorKind, Read};

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::read_error::{LogEnd, ReadError};

/// Longest record and largest chunk to read, in bytes. The largest possible snapshot and topology
/// are smaller, and a damaged length does not cause a huge allocation.
pub(in crate::log) const RECORD_SIZE_BYTES_MAX: usize = 1 << 30;
/// Most bytes to request from the file at a time.
pub(in crate::log) const READ_SIZE_BYTES_MAX: usize = 1 << 20;

/// Reads the records one by one and remembers how far the file is intact.
pub(in crate::log) struct RecordReader<R> {
    linear: LinearReader,
    source: R,
    /// Bytes read from the source.
    read_count: u64,
    /// End of the last intact record, or of the chunk that contains it. The linear reader never
    /// gets more than it requests, so this is exact.
    intact_count: u64,
    /// The file starts as an MCAP file does.
    pub(in crate::log) is_mcap: bool,
    /// The end of the file, once it is reached.
    pub(in crate::log) end: Option<LogEnd>,
}

impl<R: Read> RecordReader<R> {
    pub(in crate::log) fn new(source: R) -> Self {
        let options =
            options().with_validate_data_section_crc(true).with_validate_summary_section_crc(true);
        Self::with_options(source, options)
    }

    /// Reads records from the middle of a file.
    pub(in crate::log) fn without_magic(source: R) -> Self {
        Self::with_options(source, options().with_skip_start_magic(true).with_skip_end_magic(true))
    }

    fn with_options(source: R, options: LinearReaderOptions) -> Self {
        Self {
            linear: LinearReader::new_with_options(options),
            source,
            read_count: 0,
            intact_count: 0,
            is_mcap: false,
            end: None,
        }
    }

    /// Passes the next record to `read`, with the position up to which the file is intact.
    /// Returns `None` at the end of the readable part.
    pub(in crate::log) fn next<T>(
        &mut self,
        read: impl FnOnce(Record<'_>, u64) -> Result<T, ReadError>,
    ) -> Result<Option<T>, ReadError> {
        while self.end.is_none() {
            let error = match self.linear.next_event() {
                None => {
                    self.end = Some(LogEnd::Complete);
                    break;
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted_count))) => {
                    let buffer = self.linear.insert(wanted_count.min(READ_SIZE_BYTES_MAX));
                    let count = read_some(&mut self.source, buffer)?;
                    self.linear.notify_read(count);
                    self.read_count += count as u64;
                    continue;
                }
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    self.is_mcap = true;
                    self.intact_count = self.read_count;
                    match parse(opcode, data) {
                        Ok(record) => return read(record, self.intact_count).map(Some),
                        Err(error) => error,
                    }
                }
                Some(Err(error)) => error,
            };
            self.stop(&error);
        }
        Ok(None)
    }

    fn stop(&mut self, error: &McapError) {
        let byte = self.intact_count;
        self.end = Some(match error {
            McapError::UnexpectedEof => LogEnd::Truncated { byte },
            other => LogEnd::Damaged { byte, cause: other.to_string() },
        });
    }
}

fn options() -> LinearReaderOptions {
    LinearReaderOptions::default()
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(RECORD_SIZE_BYTES_MAX)
}

/// Parses the records that this reader uses. Index records and statistics stay unknown, so that a
/// damaged one does not end the reading.
fn parse(opcode: u8, data: &[u8]) -> mcap::McapResult<Record<'_>> {
    match opcode {
        op::HEADER | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | op::METADATA => {
            mcap::parse_record(opcode, data)
        }
        _ => Ok(Record::Unknown { opcode, data: data.into() }),
    }
}

pub(in crate::log) fn read_some(
    source: &mut impl Read,
    buffer: &mut [u8],
) -> std::io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
