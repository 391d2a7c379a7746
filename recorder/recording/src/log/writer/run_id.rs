//! Replaces the id of the run in a complete recording, for a run whose id follows from all of its commands.

use std::fs::OpenOptions;
use std::io::{self, ErrorKind};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

use mcap::records::{Record, op};

use crate::log::index::summary_start;
use crate::log::read_error::ReadError;
use crate::log::run::RUN_METADATA;
use crate::log::scanner::limits::RECORD_HEADER_SIZE_BYTES;
use crate::log::scanner::window::Window;
use crate::log::scanner::{FilePart, RecordScanner};
use crate::log::source::FileSource;

/// Replaces the id, which has as many digits as before, and the checksum that covers it.
///
/// # Errors
/// If the file cannot be read or written, or does not name the run `old`.
pub(crate) fn replace_run_id(path: &Path, old: u64, new: u64) -> io::Result<()> {
    if old == new {
        return Ok(());
    }
    let file = Arc::new(OpenOptions::new().read(true).write(true).open(path)?);
    let [old, new] = [old, new].map(|id| format!("{id:016x}").into_bytes());
    let mut window = Window::new(FileSource::from(Arc::clone(&file)), None)?;
    let summary = summary_start(&mut window)?.ok_or(ErrorKind::InvalidData)?;
    let id_at = find_run_id(window, &old)?.ok_or(ErrorKind::InvalidData)?;
    // The record before the index is the end of the data, with the checksum of all bytes before it.
    let mut checksum = [0; size_of::<u32>()];
    let checksum_at = summary - checksum.len() as u64;
    let data_end = checksum_at - RECORD_HEADER_SIZE_BYTES as u64;
    file.read_exact_at(&mut checksum, checksum_at)?;
    let change = change(&old, &new, data_end - (id_at + new.len() as u64));
    file.write_all_at(&new, id_at)?;
    file.write_all_at(&(u32::from_le_bytes(checksum) ^ change).to_le_bytes(), checksum_at)
}

/// Returns the position of the id in the metadata of the run, which precede the first chunk.
fn find_run_id(window: Window<FileSource>, id: &[u8]) -> Result<Option<u64>, ReadError> {
    let mut scanner = RecordScanner::new(window)?.stopping_at_damage();
    // The length of the value precedes it.
    let entry = [b"run_id", &[16, 0, 0, 0][..], id].concat();
    while let Some(part) = scanner.next()? {
        if let FilePart::Record { byte, opcode: op::METADATA, body, .. } = part
            && let Ok(Record::Metadata(metadata)) = mcap::parse_record(op::METADATA, body)
            && metadata.name == RUN_METADATA
        {
            let place = body.windows(entry.len()).position(|window| window == entry);
            let body_at = byte + RECORD_HEADER_SIZE_BYTES as u64;
            return Ok(place.map(|place| body_at + (place + entry.len() - id.len()) as u64));
        }
    }
    Ok(None)
}

/// Returns the change of a checksum after which `after` bytes follow. CRC-32 is linear: the change is that of the
/// bytes alone, shifted by zeros.
fn change(old: &[u8], new: &[u8], after: u64) -> u32 {
    let difference = crc32fast::hash(old) ^ crc32fast::hash(new);
    let mut shifted = crc32fast::Hasher::new_with_initial_len(difference, old.len() as u64);
    shifted.combine(&crc32fast::Hasher::new_with_initial_len(0, after));
    shifted.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_change_of_a_checksum_is_that_of_the_whole_text() {
        let text = |id: &str| format!("before {id}, and a lot of text after it");
        let [old, new] = ["0123456789abcdef", "fedcba9876543210"];
        let after = (text(old).len() - "before ".len() - old.len()) as u64;
        let changed =
            crc32fast::hash(text(old).as_bytes()) ^ change(old.as_bytes(), new.as_bytes(), after);
        assert_eq!(changed, crc32fast::hash(text(new).as_bytes()));
    }
}
