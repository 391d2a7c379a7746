//! The chunks of a file without an index, found from record to record.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};

use mcap::MAGIC;
use mcap::records::op;

use super::{CHUNK_COUNT_MAX, FoundChunk, RECORD_HEAD_SIZE_BYTES, record_size_bytes};
use crate::reader::ReadError;
use crate::records::LogEnd;

/// The head of a record and the first number behind it.
const HEAD_AND_NUMBER: usize = RECORD_HEAD_SIZE_BYTES + size_of::<u16>();

/// Bytes between two reports.
const REPORT_SIZE_BYTES: u64 = 256 << 20;

/// The whole chunks of a file, and how it ends.
pub(super) fn read(
    file: &File,
    size_bytes: u64,
    on_walk: &mut dyn FnMut(u64, u64),
) -> Result<(Vec<FoundChunk>, LogEnd), ReadError> {
    let mut source = BufReader::new(file);
    let mut chunks: Vec<FoundChunk> = Vec::new();
    let mut byte = MAGIC.len() as u64;
    source.seek(SeekFrom::Start(byte))?;
    let mut report_byte = 0;
    loop {
        if byte >= report_byte {
            on_walk(byte, size_bytes);
            report_byte = byte + REPORT_SIZE_BYTES;
        }
        let head = read_head(&mut source)?;
        let size = record_size_bytes(&head).filter(|size| *size <= size_bytes - byte);
        let Some(record_size) = size else { return Ok((chunks, LogEnd::Truncated { byte })) };
        match head[0] {
            0 => return Ok((chunks, damaged(byte, "a record of no kind"))),
            op::CHUNK if chunks.len() == CHUNK_COUNT_MAX => {
                return Ok((chunks, damaged(byte, "too many chunks")));
            }
            op::CHUNK => chunks.push(FoundChunk {
                offset: byte,
                size_bytes: record_size,
                channels: Vec::new(),
            }),
            op::MESSAGE_INDEX => {
                if let (Some(chunk), Some(channel)) = (chunks.last_mut(), number(&head)) {
                    chunk.channels.push(channel);
                }
            }
            // What follows is the index, which was looked for before: it is damaged or missing.
            op::DATA_END => return Ok((chunks, LogEnd::Truncated { byte })),
            _ => {}
        }
        let Some(behind_head) = record_size.checked_sub(head.len() as u64) else {
            return Ok((chunks, damaged(byte, "an index without a channel")));
        };
        source.seek_relative(i64::try_from(behind_head).unwrap_or(i64::MAX))?;
        byte += record_size;
    }
}

fn damaged(byte: u64, cause: &str) -> LogEnd {
    LogEnd::Damaged { byte, cause: cause.to_owned() }
}

/// The number behind the head of a record: the channel of an index.
fn number(head: &[u8]) -> Option<u16> {
    let bytes = head.get(RECORD_HEAD_SIZE_BYTES..HEAD_AND_NUMBER)?;
    Some(u16::from_le_bytes(bytes.try_into().ok()?))
}

/// The head of the next record, and the number behind it where it is an index; less at the end of
/// the file.
fn read_head(source: &mut impl Read) -> Result<Vec<u8>, ReadError> {
    let mut head = vec![0; RECORD_HEAD_SIZE_BYTES];
    if !is_filled(source, &mut head)? {
        return Ok(Vec::new());
    }
    if head[0] == op::MESSAGE_INDEX {
        let mut number = [0; size_of::<u16>()];
        if is_filled(source, &mut number)? {
            head.extend(number);
        }
    }
    Ok(head)
}

fn is_filled(source: &mut impl Read, bytes: &mut [u8]) -> Result<bool, ReadError> {
    match source.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error.into()),
    }
}
