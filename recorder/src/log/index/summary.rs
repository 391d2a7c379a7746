//! The chunks as listed by the index at the end of a file.

use std::fs::File;
use std::io::Seek;

use mcap::Summary;
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

use super::chunk::{CHUNK_COUNT_MAX, LocatedChunk};
use crate::log::read::read_error::ReadError;
use crate::log::read::records::{RECORD_SIZE_BYTES_MAX, read_some};

/// Returns the chunks, or `None` if the file has no index or an inconsistent one.
pub(super) fn read(
    file: &mut File,
    size_bytes: u64,
) -> Result<Option<Vec<LocatedChunk>>, ReadError> {
    let Some(summary) = read_summary(file, size_bytes)? else { return Ok(None) };
    let chunks: Vec<_> = summary
        .chunk_indexes
        .into_iter()
        .map(|chunk| LocatedChunk {
            offset: chunk.chunk_start_offset,
            size_bytes: chunk.chunk_length,
            channels: chunk.message_index_offsets.into_keys().collect(),
        })
        .collect();
    let ends = chunks.iter().map(|chunk| chunk.offset.saturating_add(chunk.size_bytes));
    let next = chunks.iter().skip(1).map(|chunk| chunk.offset).chain([size_bytes]);
    let is_in_order = ends.zip(next).all(|(end, next)| end <= next);
    Ok((is_in_order && chunks.len() <= CHUNK_COUNT_MAX).then_some(chunks))
}

/// Returns `None` if the summary is missing or damaged, because a scan can replace it.
fn read_summary(mut file: &File, size_bytes: u64) -> Result<Option<Summary>, ReadError> {
    let options = SummaryReaderOptions::default()
        .with_file_size(size_bytes)
        .with_record_length_limit(RECORD_SIZE_BYTES_MAX);
    let mut reader = SummaryReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event {
            Ok(SummaryReadEvent::SeekRequest(to)) => reader.notify_seeked(file.seek(to)?),
            Ok(SummaryReadEvent::ReadRequest(count)) => {
                let count = read_some(&mut file, reader.insert(count))?;
                reader.notify_read(count);
            }
            Err(_) => return Ok(None),
        }
    }
    Ok(reader.finish())
}
