//! Opens input files without blocking.

use std::fs::{self, File, FileType, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rustix::fs::OFlags;

use sim_contract::kind_of_non_file;

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
