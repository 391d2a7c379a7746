//! Recordings in files, which are opened without blocking.

use std::fs::{self, File, FileType, OpenOptions};
use std::io;
use std::os::unix::fs::{FileExt, OpenOptionsExt};
use std::path::Path;
use std::sync::Arc;

use rustix::fs::OFlags;
use sim_host::{kind_of_non_file, part_path};
use sim_messages::StopFlag;

use super::index::IndexedLog;
use super::read::reader::LogReader;
use super::read_error::ReadError;
use super::source::{FileSource, ReadAt};
use super::tape::{Tape, TapeError};

impl ReadAt for File {
    fn read_at(&self, buffer: &mut [u8], position: u64) -> io::Result<usize> {
        FileExt::read_at(self, buffer, position)
    }

    fn size_bytes(&self) -> io::Result<u64> {
        Ok(self.metadata()?.len())
    }
}

impl LogReader<FileSource> {
    /// Opens a file and reads its header.
    ///
    /// # Errors
    /// If the file is not a recording or has no readable header.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::of_file(Arc::new(open_recording(path)?), None)
    }

    /// Opens a file and reads its header. After a signal, this and every later read ends with
    /// [`ReadError::Interrupted`].
    ///
    /// # Errors
    /// Like [`LogReader::open`], and after a signal.
    pub fn open_until(path: &Path, stop: &StopFlag) -> Result<Self, ReadError> {
        Self::of_file(Arc::new(open_recording(path)?), Some(stop))
    }
}

impl IndexedLog {
    /// Opens a file and reads its header and its index.
    ///
    /// # Errors
    /// If the file is not a recording or has no readable header.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Self::of_file(Arc::new(open_recording(path)?), None, &mut |_, _| {})
    }
}

impl Tape {
    /// Opens a recording, like [`Tape::of_file`].
    ///
    /// # Errors
    /// If the file is not a recording or has no snapshot.
    pub fn open(
        path: &Path,
        stop: Option<&StopFlag>,
        on_progress: &mut dyn FnMut(u64, u64),
    ) -> Result<Self, TapeError> {
        Self::of_file(Arc::new(open_recording(path)?), stop, on_progress)
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
