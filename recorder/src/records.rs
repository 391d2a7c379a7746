//! The records of an MCAP file, one by one, with every checksum checked.

use std::io::{ErrorKind, Read};

use mcap::McapError;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::reader::ReadError;

/// Longest record and largest chunk, in bytes, that is read: a snapshot or topology of the most
/// elements that a scene can have is below it, and a damaged length is not followed further.
pub(crate) const RECORD_SIZE_BYTES_MAX: usize = 1 << 30;
/// Most bytes that are asked of the file at a time.
pub(crate) const READ_SIZE_BYTES_MAX: usize = 1 << 20;

/// How a file ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogEnd {
    /// As it should.
    Whole,
    /// In the middle: its writer was killed, or still writes.
    Truncated {
        /// How far it is readable.
        byte: u64,
    },
    /// With a part that is not what was written.
    Damaged {
        /// How far it is readable.
        byte: u64,
        /// What is wrong behind that.
        cause: String,
    },
}

impl std::fmt::Display for LogEnd {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Whole => formatter.write_str("complete"),
            Self::Truncated { byte } => write!(formatter, "truncated after byte {byte}"),
            Self::Damaged { byte, cause } => {
                write!(formatter, "damaged after byte {byte}: {cause}")
            }
        }
    }
}

/// Hands out the records of a file one by one and remembers how far they were whole.
pub(crate) struct RecordReader<R> {
    linear: LinearReader,
    source: R,
    /// Bytes taken from the source.
    read_count: u64,
    /// End of the last whole record, or of the chunk that it is in. Never more than the linear
    /// reader asks for is given to it, so this is exact.
    whole_count: u64,
    /// Whether the file begins as an MCAP file does.
    pub(crate) is_mcap: bool,
    /// How the file ends, once it has.
    pub(crate) end: Option<LogEnd>,
}

impl<R: Read> RecordReader<R> {
    pub(crate) fn new(source: R) -> Self {
        let options =
            options().with_validate_data_section_crc(true).with_validate_summary_section_crc(true);
        Self::with_options(source, options)
    }

    /// Reads records out of the middle of a file.
    pub(crate) fn of_records(source: R) -> Self {
        Self::with_options(source, options().with_skip_start_magic(true).with_skip_end_magic(true))
    }

    fn with_options(source: R, options: LinearReaderOptions) -> Self {
        Self {
            linear: LinearReader::new_with_options(options),
            source,
            read_count: 0,
            whole_count: 0,
            is_mcap: false,
            end: None,
        }
    }

    /// Hands the next record to `read`, with the place in the file that it is whole up to.
    /// `None` at the end of what is readable.
    pub(crate) fn next<T>(
        &mut self,
        read: impl FnOnce(Record<'_>, u64) -> Result<T, ReadError>,
    ) -> Result<Option<T>, ReadError> {
        while self.end.is_none() {
            let error = match self.linear.next_event() {
                None => {
                    self.end = Some(LogEnd::Whole);
                    break;
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted_count))) => {
                    let buffer = self.linear.insert(wanted_count.min(READ_SIZE_BYTES_MAX));
                    let count = read_some(&mut self.source, buffer)?;
                    self.linear.notify_read(count);
                    self.read_count += count as u64;
                    continue;
                }
                // Counts and indexes are for other readers; this one counts itself.
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    self.is_mcap = true;
                    self.whole_count = self.read_count;
                    match parse(opcode, data) {
                        Ok(record) => return read(record, self.whole_count).map(Some),
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
        let byte = self.whole_count;
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

/// An index record reads as an unknown one: a damaged one must not stop the reading.
fn parse(opcode: u8, data: &[u8]) -> mcap::McapResult<Record<'_>> {
    match opcode {
        op::HEADER | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | op::METADATA => {
            mcap::parse_record(opcode, data)
        }
        _ => Ok(Record::Unknown { opcode, data: data.into() }),
    }
}

pub(crate) fn read_some(source: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    loop {
        match source.read(buffer) {
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            other => return other,
        }
    }
}
