//! Input files, which are opened without blocking and which several readers share.

use std::fs::{self, File, FileType, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom};
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::Path;
use std::sync::Arc;

use rustix::fs::OFlags;
use sim_host::{kind_of_non_file, part_path};

use super::read_error::ReadError;

/// A file that several readers share, each with a position of its own.
#[derive(Debug)]
pub struct FileSource {
    file: Arc<File>,
    position: u64,
}

impl FileSource {
    /// Begins at the start of the file.
    pub fn new(file: Arc<File>) -> Self {
        Self { file, position: 0 }
    }
}

impl Read for FileSource {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read_at(buffer, self.position)?;
        self.position += count as u64;
        Ok(count)
    }
}

impl Seek for FileSource {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset),
            SeekFrom::End(offset) => self.file.metadata()?.len().checked_add_signed(offset),
        };
        self.position = position.ok_or(io::ErrorKind::InvalidInput)?;
        Ok(self.position)
    }
}

/// Opens a recording for readers that share the file, so that all of them read the same one, also if another file
/// gets its name.
///
/// # Errors
/// If the path is not a regular file or the operating system reports an error. Names the unfinished part of a recording
/// that does not exist yet.
pub fn open_recording(path: &Path) -> Result<File, ReadError> {
    open_regular_file(path).map_err(|cause| {
        let part = part_path(path);
        if cause.kind() == io::ErrorKind::NotFound && part.exists() {
            ReadError::Unfinished { part }
        } else {
            cause.into()
        }
    })
}

/// Opens a regular file for reading.
///
/// A FIFO (named pipe) is refused, because opening it would block until another process writes to it.
///
/// # Errors
/// If the path is not a regular file or the operating system reports an error.
pub fn open_regular_file(path: &Path) -> io::Result<File> {
    check_type(fs::metadata(path)?.file_type())?;
    // The file may have been replaced since the check. Without this flag a pipe would block here.
    let flags = OFlags::NONBLOCK.bits().cast_signed();
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    check_type(file.metadata()?.file_type())?;
    Ok(file)
}

fn check_type(file_type: FileType) -> io::Result<()> {
    let Some(kind) = kind_of_non_file(file_type) else { return Ok(()) };
    Err(io::Error::new(io::ErrorKind::InvalidInput, format!("it is {kind}, not a regular file")))
}

#[cfg(test)]
mod tests {
    use std::process;

    use rustix::fs::{CWD, FileType as NodeType, Mode, mknodat};

    use super::*;

    #[test]
    fn a_fifo_a_directory_and_a_device_are_refused_without_blocking() {
        let pipe = std::env::temp_dir().join(format!("open-regular-file-{}", process::id()));
        mknodat(CWD, &pipe, NodeType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        let error_text = |path: &Path| open_regular_file(path).unwrap_err().to_string();
        let pipe_error = error_text(&pipe);
        fs::remove_file(&pipe).unwrap();
        assert_eq!(pipe_error, "it is a named pipe (FIFO), not a regular file");
        let folder = error_text(&std::env::temp_dir());
        assert_eq!(folder, "it is a directory, not a regular file");
        let device = error_text(Path::new("/dev/null"));
        assert_eq!(device, "it is a device, not a regular file");
    }
}
