//! The chunks of a file without an index, found by a scan from record to record.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::records::op;

use sim_contract::Stop;

use super::chunk::{CHUNK_COUNT_MAX, ChannelSet, LocatedChunk, record_size_bytes};
use crate::log::read::file_source::check_stop;
use crate::log::read::limits::RECORD_HEADER_SIZE_BYTES;
use crate::log::read::read_error::{LogEnd, ReadError};

/// Size of a record's header and of the channel id that follows it in a message index.
const HEADER_AND_ID_SIZE_BYTES: usize = RECORD_HEADER_SIZE_BYTES + size_of::<u16>();

/// Bytes between two calls of the progress callback.
const PROGRESS_PERIOD_BYTES: u64 = 256 << 20;

/// Returns the complete chunks of a file and the end of the file.
pub(super) fn read(
    file: &File,
    size_bytes: u64,
    stop: Option<&Stop>,
    on_progress: &mut dyn FnMut(u64, u64),
) -> Result<(Vec<LocatedChunk>, LogEnd), ReadError> {
    let mut source = BufReader::new(file);
    let mut chunks: Vec<LocatedChunk> = Vec::new();
    let mut byte = MAGIC.len() as u64;
    source.seek(SeekFrom::Start(byte))?;
    let mut next_progress_byte = 0;
    loop {
        check_stop(stop)?;
        if byte >= next_progress_byte {
            on_progress(byte, size_bytes);
            next_progress_byte = byte + PROGRESS_PERIOD_BYTES;
        }
        let header = read_header(&mut source)?;
        let size = record_size_bytes(&header).filter(|size| *size <= size_bytes - byte);
        let Some(record_size) = size else { return Ok((chunks, LogEnd::Truncated { byte })) };
        match header[0] {
            0 => return Ok((chunks, damaged(byte, "a record with opcode 0"))),
            op::CHUNK if chunks.len() == CHUNK_COUNT_MAX => {
                return Ok((chunks, damaged(byte, "too many chunks")));
            }
            op::CHUNK => chunks.push(LocatedChunk {
                offset: byte,
                size_bytes: record_size,
                channels: ChannelSet::default(),
            }),
            op::MESSAGE_INDEX => {
                if let (Some(chunk), Some(channel)) = (chunks.last_mut(), channel_id(&header)) {
                    chunk.channels.add(channel);
                }
            }
            // The index follows. It is damaged or missing, or this scan would not run.
            op::DATA_END => return Ok((chunks, LogEnd::Truncated { byte })),
            _ => {}
        }
        let Some(remaining) = record_size.checked_sub(header.len() as u64) else {
            return Ok((chunks, damaged(byte, "a message index without a channel id")));
        };
        source.seek_relative(i64::try_from(remaining).unwrap_or(i64::MAX))?;
        byte += record_size;
    }
}

fn damaged(byte: u64, cause: &str) -> LogEnd {
    LogEnd::Damaged { byte, cause: cause.to_owned() }
}

fn channel_id(header: &[u8]) -> Option<u16> {
    let bytes = header.get(RECORD_HEADER_SIZE_BYTES..HEADER_AND_ID_SIZE_BYTES)?;
    Some(u16::from_le_bytes(bytes.try_into().ok()?))
}

/// Returns the header of the next record, followed by the channel id if it is a message index. The
/// result is shorter at the end of the file.
fn read_header(source: &mut impl Read) -> Result<Vec<u8>, ReadError> {
    let mut header = vec![0; RECORD_HEADER_SIZE_BYTES];
    if !read_exactly(source, &mut header)? {
        return Ok(Vec::new());
    }
    if header[0] == op::MESSAGE_INDEX {
        let mut id = [0; size_of::<u16>()];
        if read_exactly(source, &mut id)? {
            header.extend(id);
        }
    }
    Ok(header)
}

/// Fills `bytes`. Returns `false` if the file ends before.
pub(super) fn read_exactly(source: &mut impl Read, bytes: &mut [u8]) -> Result<bool, ReadError> {
    match source.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error.into()),
    }
}
