//! The chunks as listed by the index at the end of a file.

use std::fs::File;
use std::io::{BufReader, Seek, SeekFrom};
use std::os::unix::fs::FileExt;

use mcap::MAGIC;
use mcap::records::{ChunkIndex, Record, op};
use sim_contract::Stop;

use super::chunk::{CHUNK_COUNT_MAX, ChannelSet, LocatedChunk, record_size_bytes};
use super::scan::read_exactly;
use crate::log::read::file_source::check_stop;
use crate::log::read::lengths::check_lengths;
use crate::log::read::limits::RECORD_HEADER_SIZE_BYTES;
use crate::log::read::limits::TEXT_SIZE_BYTES_MAX;
use crate::log::read::read_error::ReadError;

/// Two positions and a checksum.
const FOOTER_SIZE_BYTES: usize = 8 + 8 + 4;
/// The footer with its header, and the magic after it.
const END_SIZE_BYTES: usize = RECORD_HEADER_SIZE_BYTES + FOOTER_SIZE_BYTES + MAGIC.len();
/// Longest entry for a chunk: fields, and one position for each channel. A longer one is not ours.
const ENTRY_SIZE_BYTES_MAX: u64 = TEXT_SIZE_BYTES_MAX;

/// Returns the chunks, or `None` if the file has no index or an inconsistent one, because a scan can
/// replace it.
pub(super) fn read(
    file: &File,
    size_bytes: u64,
    stop: Option<&Stop>,
) -> Result<Option<Vec<LocatedChunk>>, ReadError> {
    let Some(start) = summary_start(file, size_bytes)? else { return Ok(None) };
    let Some(chunks) = read_entries(file, start, size_bytes - END_SIZE_BYTES as u64, stop)? else {
        return Ok(None);
    };
    let ends = chunks.iter().map(|chunk| chunk.offset.saturating_add(chunk.size_bytes));
    let next = chunks.iter().skip(1).map(|chunk| chunk.offset).chain([size_bytes]);
    let is_in_order = ends.zip(next).all(|(end, next)| end <= next);
    Ok(is_in_order.then_some(chunks))
}

/// Returns the position of the index, from the footer.
pub(in crate::log) fn summary_start(
    file: &File,
    size_bytes: u64,
) -> Result<Option<u64>, ReadError> {
    let Some(footer_start) = size_bytes.checked_sub(END_SIZE_BYTES as u64) else { return Ok(None) };
    let mut end = [0; END_SIZE_BYTES];
    file.read_exact_at(&mut end, footer_start)?;
    let (footer, magic) = end.split_at(end.len() - MAGIC.len());
    let start =
        footer[RECORD_HEADER_SIZE_BYTES..].first_chunk().map(|one| u64::from_le_bytes(*one));
    let is_footer = magic == MAGIC && footer[0] == op::FOOTER;
    Ok(start.filter(|start| is_footer && *start > 0 && *start <= footer_start))
}

/// Returns the chunks in the index, or `None` if it is damaged.
fn read_entries(
    file: &File,
    start: u64,
    end: u64,
    stop: Option<&Stop>,
) -> Result<Option<Vec<LocatedChunk>>, ReadError> {
    let mut source = BufReader::new(file);
    source.seek(SeekFrom::Start(start))?;
    let mut chunks = Vec::new();
    let mut entry = Vec::new();
    let mut byte = start;
    while byte < end {
        check_stop(stop)?;
        let mut header = [0; RECORD_HEADER_SIZE_BYTES];
        if !read_exactly(&mut source, &mut header)? {
            return Ok(None);
        }
        let size = record_size_bytes(&header).filter(|size| *size <= end - byte);
        let Some(record_size) = size else { return Ok(None) };
        byte += record_size;
        let body_size = record_size - RECORD_HEADER_SIZE_BYTES as u64;
        if header[0] != op::CHUNK_INDEX {
            source.seek_relative(i64::try_from(body_size).unwrap_or(i64::MAX))?;
            continue;
        }
        if body_size > ENTRY_SIZE_BYTES_MAX || chunks.len() == CHUNK_COUNT_MAX {
            return Ok(None);
        }
        entry.resize(usize::try_from(body_size).unwrap_or(0), 0);
        let is_whole = read_exactly(&mut source, &mut entry)?;
        let Some(chunk) = parse(&entry).filter(|_| is_whole) else { return Ok(None) };
        chunks.push(chunk);
    }
    Ok(Some(chunks))
}

fn parse(entry: &[u8]) -> Option<LocatedChunk> {
    check_lengths(op::CHUNK_INDEX, entry).ok()?;
    let Ok(Record::ChunkIndex(index)) = mcap::parse_record(op::CHUNK_INDEX, entry) else {
        return None;
    };
    let ChunkIndex { chunk_start_offset, chunk_length, message_index_offsets, .. } = index;
    let mut channels = ChannelSet::default();
    for channel in message_index_offsets.into_keys() {
        channels.add(channel);
    }
    Some(LocatedChunk { offset: chunk_start_offset, size_bytes: chunk_length, channels })
}
