//! Replaces the id of the run in a complete recording, for a run whose id follows from all of its commands.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;

use crate::log::run::RUN_METADATA;

const MAGIC_SIZE_BYTES: u64 = 8;
/// Number of the kind of a record, and its size.
const RECORD_HEAD_SIZE_BYTES: u64 = 9;
const METADATA: u8 = 0x0c;
const FOOTER_SIZE_BYTES: u64 = RECORD_HEAD_SIZE_BYTES + 20;

/// Replaces the id, which has as many digits as before, and the checksum that covers it.
///
/// # Errors
/// If the file cannot be read or written, or does not name the run `old`.
pub(crate) fn replace_run_id(path: &Path, old: u64, new: u64) -> io::Result<()> {
    if old == new {
        return Ok(());
    }
    let mut file = OpenOptions::new().read(true).write(true).open(path)?;
    let [old, new] = [old, new].map(|id| format!("{id:016x}").into_bytes());
    let start = find_run_id(&mut file, &old)?;
    file.seek(SeekFrom::Start(start))?;
    file.write_all(&new)?;
    // The footer begins with the start of the summary, before which stands the checksum of all data.
    file.seek(SeekFrom::End(-negative(
        FOOTER_SIZE_BYTES + MAGIC_SIZE_BYTES - RECORD_HEAD_SIZE_BYTES,
    )))?;
    let summary = u64::from_le_bytes(read_array(&mut file)?);
    let checksum_at = summary.checked_sub(4).ok_or(ErrorKind::InvalidData)?;
    file.seek(SeekFrom::Start(checksum_at))?;
    let checksum = u32::from_le_bytes(read_array(&mut file)?);
    let data_end = checksum_at.checked_sub(RECORD_HEAD_SIZE_BYTES).ok_or(ErrorKind::InvalidData)?;
    let after = data_end.checked_sub(start + new.len() as u64).ok_or(ErrorKind::InvalidData)?;
    file.seek(SeekFrom::Start(checksum_at))?;
    file.write_all(&(checksum ^ change(&old, &new, after)).to_le_bytes())
}

/// Returns the place of the id in the metadata of the run.
fn find_run_id(file: &mut File, id: &[u8]) -> io::Result<u64> {
    let mut start = MAGIC_SIZE_BYTES;
    loop {
        file.seek(SeekFrom::Start(start))?;
        let [kind] = read_array(file)?;
        let size_bytes = u64::from_le_bytes(read_array(file)?);
        start += RECORD_HEAD_SIZE_BYTES;
        if kind == METADATA {
            let mut metadata = Vec::new();
            file.take(size_bytes).read_to_end(&mut metadata)?;
            let is_run =
                metadata.get(4..).is_some_and(|name| name.starts_with(RUN_METADATA.as_bytes()));
            let key = b"run_id";
            let found = metadata.windows(key.len()).position(|window| window == key);
            // The length of the value stands between them.
            let place = found.map(|place| place + key.len() + 4).filter(|_| is_run);
            if let Some(place) = place
                && metadata[place..].starts_with(id)
            {
                return Ok(start + place as u64);
            }
        }
        start += size_bytes;
    }
}

/// Returns the change of a checksum after which `after` bytes follow. CRC-32 is linear: the change is that of the
/// bytes alone, shifted by zeros.
fn change(old: &[u8], new: &[u8], after: u64) -> u32 {
    let difference = crc32fast::hash(old) ^ crc32fast::hash(new);
    let mut shifted = crc32fast::Hasher::new_with_initial_len(difference, old.len() as u64);
    shifted.combine(&crc32fast::Hasher::new_with_initial_len(0, after));
    shifted.finalize()
}

fn read_array<const N: usize>(file: &mut File) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

#[allow(clippy::cast_possible_wrap, reason = "the size of a footer")]
fn negative(size_bytes: u64) -> i64 {
    size_bytes as i64
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
