//! The positions of the chunks of a file: from the index at its end, or else from the headers of its records.

use mcap::MAGIC;
use mcap::records::{ChunkIndex, Footer, Record, op};
use sim_messages::StopFlag;

use crate::log::read_error::{LogEnd, ReadError};
use crate::log::scanner::limits::RECORD_HEADER_SIZE_BYTES;
use crate::log::scanner::window::Window;
use crate::log::scanner::{FilePart, RecordScanner, split_header};
use crate::log::source::FileSource;

/// Most chunks of a file. At the usual chunk size this is 1 TB. Their index takes less than 200 MB
/// of memory.
const CHUNK_COUNT_MAX: usize = 1 << 20;
/// Size of a record's header and of the channel id that follows it in a message index.
const HEADER_AND_ID_SIZE_BYTES: usize = RECORD_HEADER_SIZE_BYTES + size_of::<u16>();
/// The footer with its header, and the magic after it.
const END_SIZE_BYTES: usize = RECORD_HEADER_SIZE_BYTES + 8 + 8 + 4 + MAGIC.len();
/// Bytes between two calls of the progress callback.
const PROGRESS_PERIOD_BYTES: u64 = 256 << 20;

/// A chunk with the ids of its channels, which are not resolved to topics yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct LocatedChunk {
    pub(super) offset: u64,
    pub(super) size_bytes: u64,
    pub(super) channels: ChannelSet,
}

/// A set of channel ids, as bits: a recording has a dozen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct ChannelSet {
    ids: u64,
    /// The set has an id that does not fit.
    is_unknown: bool,
}

impl ChannelSet {
    fn add(&mut self, id: u16) {
        match 1_u64.checked_shl(u32::from(id)) {
            Some(bit) => self.ids |= bit,
            None => self.is_unknown = true,
        }
    }

    /// Returns the ids, or `None` if the file does not list them or they are unknown.
    pub(super) fn known_ids(self) -> Option<impl Iterator<Item = u16>> {
        let is_known = self.ids != 0 && !self.is_unknown;
        is_known.then(|| (0..64).filter(move |id| self.ids >> id & 1 != 0))
    }
}

/// Returns the chunks in the index of a file, or `None` if the file has no index or an inconsistent one, because a scan
/// can replace it.
pub(super) fn read_index(
    file: FileSource,
    stop: Option<&StopFlag>,
) -> Result<Option<Vec<LocatedChunk>>, ReadError> {
    let mut window = Window::new(file, stop.cloned())?;
    let Some(start) = summary_start(&mut window)? else { return Ok(None) };
    let size_bytes = window.size_bytes();
    let mut scanner = RecordScanner::new(window)?.stopping_at_damage();
    scanner.go_to(start);
    let mut chunks: Vec<LocatedChunk> = Vec::new();
    loop {
        match scanner.next()? {
            Some(FilePart::Record { opcode: op::FOOTER, .. }) => return Ok(Some(chunks)),
            Some(FilePart::Record { opcode: op::CHUNK_INDEX, body, .. }) => {
                let Ok(Record::ChunkIndex(index)) = mcap::parse_record(op::CHUNK_INDEX, body)
                else {
                    return Ok(None);
                };
                let chunk = located(index);
                let is_after = |last: &LocatedChunk| {
                    last.offset.saturating_add(last.size_bytes) <= chunk.offset
                };
                let is_within = chunk.offset.saturating_add(chunk.size_bytes) <= size_bytes;
                if chunks.len() == CHUNK_COUNT_MAX
                    || !chunks.last().is_none_or(is_after)
                    || !is_within
                {
                    return Ok(None);
                }
                chunks.push(chunk);
            }
            Some(FilePart::Record { .. } | FilePart::Skipped { .. }) => {}
            _ => return Ok(None),
        }
    }
}

fn located(index: ChunkIndex) -> LocatedChunk {
    let ChunkIndex { chunk_start_offset, chunk_length, message_index_offsets, .. } = index;
    let mut channels = ChannelSet::default();
    for channel in message_index_offsets.into_keys() {
        channels.add(channel);
    }
    LocatedChunk { offset: chunk_start_offset, size_bytes: chunk_length, channels }
}

/// Returns the position of the index, from the footer.
pub(in crate::log) fn summary_start(
    window: &mut Window<FileSource>,
) -> Result<Option<u64>, ReadError> {
    let Some(footer_start) = window.size_bytes().checked_sub(END_SIZE_BYTES as u64) else {
        return Ok(None);
    };
    let end = window.bytes(footer_start, END_SIZE_BYTES)?;
    let footer = end.strip_suffix(MAGIC).filter(|end| end.first() == Some(&op::FOOTER));
    let body = footer.and_then(|footer| footer.get(RECORD_HEADER_SIZE_BYTES..));
    let footer = body.map(|body| mcap::parse_record(op::FOOTER, body));
    Ok(match footer {
        Some(Ok(Record::Footer(Footer { summary_start, .. }))) => {
            Some(summary_start).filter(|start| (1..=footer_start).contains(start))
        }
        _ => None,
    })
}

/// Returns the complete chunks of a file and the end of the file, from the headers of its records.
pub(super) fn scan(
    file: FileSource,
    stop: Option<&StopFlag>,
    on_progress: &mut dyn FnMut(u64, u64),
) -> Result<(Vec<LocatedChunk>, LogEnd), ReadError> {
    let mut window = Window::new(file, stop.cloned())?.reading_little_ahead();
    let mut chunks: Vec<LocatedChunk> = Vec::new();
    let mut byte = MAGIC.len() as u64;
    let mut next_progress_byte = 0;
    loop {
        window.check_stop()?;
        let size_bytes = window.size_bytes();
        if byte >= next_progress_byte {
            on_progress(byte, size_bytes);
            next_progress_byte = byte + PROGRESS_PERIOD_BYTES;
        }
        let damaged = |cause: &str| LogEnd::Damaged { byte, cause: cause.to_owned() };
        let start = window.bytes(byte, HEADER_AND_ID_SIZE_BYTES)?;
        let header = split_header(start).map(|(opcode, length)| {
            (opcode, length.saturating_add(RECORD_HEADER_SIZE_BYTES as u64))
        });
        let header = header.filter(|(_, record_size)| *record_size <= size_bytes - byte);
        let Some((opcode, record_size)) = header else {
            return Ok((chunks, LogEnd::Truncated { byte }));
        };
        match opcode {
            0 => return Ok((chunks, damaged("a record with opcode 0"))),
            op::CHUNK if chunks.len() == CHUNK_COUNT_MAX => {
                return Ok((chunks, damaged("too many chunks")));
            }
            op::CHUNK => chunks.push(LocatedChunk {
                offset: byte,
                size_bytes: record_size,
                channels: ChannelSet::default(),
            }),
            op::MESSAGE_INDEX => {
                let id = start[RECORD_HEADER_SIZE_BYTES..].first_chunk();
                let Some(id) = id.filter(|_| record_size >= HEADER_AND_ID_SIZE_BYTES as u64) else {
                    return Ok((chunks, damaged("a message index without a channel id")));
                };
                if let Some(chunk) = chunks.last_mut() {
                    chunk.channels.add(u16::from_le_bytes(*id));
                }
            }
            // The index follows. It is damaged or missing, or this scan would not run.
            op::DATA_END => return Ok((chunks, LogEnd::Truncated { byte })),
            _ => {}
        }
        byte += record_size;
    }
}
