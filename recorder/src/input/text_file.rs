//! Reads text files of bounded size.

use std::io::{self, ErrorKind, Read};
use std::path::Path;

use recording::open_regular_file;
use sim_contract::to_text;

/// Reads a regular file of at most `size_bytes_max` bytes.
pub(crate) fn read_text_file(path: &Path, size_bytes_max: u64) -> io::Result<String> {
    let file = open_regular_file(path)?;
    let mut bytes = Vec::new();
    let size_bytes = file.take(size_bytes_max + 1).read_to_end(&mut bytes)? as u64;
    if size_bytes > size_bytes_max {
        let problem = format!("it is longer than {size_bytes_max} bytes");
        return Err(io::Error::new(ErrorKind::FileTooLarge, problem));
    }
    to_text(bytes).map_err(io::Error::other)
}
