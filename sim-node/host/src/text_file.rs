//! Reading of text files that a user names, such as scenes and meshes. Size and time are bounded.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rustix::fs::OFlags;
use thiserror::Error;

use sim_types::SCENE_SIZE_BYTES_MAX;

use crate::file_lock::kind_of_non_file;
use crate::mesh_format::other_format;

/// Error of reading a text file.
#[derive(Debug, Error)]
pub enum TextFileError {
    /// The system refused to open or read the file.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The path names a directory, FIFO, socket or device. Reading it could wait or never end.
    #[error("it is {0}, not a regular file")]
    NotRegular(&'static str),
    /// The file is a mesh or a scene in another format than the ones that are read.
    #[error("it is {0}; only Wavefront OBJ is read: export the mesh in that format")]
    OtherFormat(&'static str),
    /// The file is longer than a scene may be.
    #[error("it is longer than {SCENE_SIZE_BYTES_MAX} bytes")]
    TooLong,
    /// The file is not UTF-8.
    #[error("line {line} is not text in UTF-8; save the file in this encoding")]
    NotText {
        /// The first such line, from 1.
        line: usize,
    },
}

/// Reads a scene, or a mesh that a scene names. Never waits, because it refuses FIFOs and devices.
/// Reads at most [`SCENE_SIZE_BYTES_MAX`] bytes.
///
/// # Errors
/// The file cannot be opened or read, is not a regular file, has another format, is too long or is not text.
pub fn read_scene_file(path: impl AsRef<Path>) -> Result<String, TextFileError> {
    let path = path.as_ref();
    // Opening a device can have side effects, so the type is checked first.
    check_regular(&std::fs::metadata(path)?)?;
    // The path may name another file now, so the type is checked again below. With this flag, opening
    // a FIFO does not wait.
    let flags = OFlags::NONBLOCK.bits().cast_signed();
    let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
    check_regular(&file.metadata()?)?;
    read_bounded(file)
}

fn check_regular(metadata: &Metadata) -> Result<(), TextFileError> {
    kind_of_non_file(metadata.file_type())
        .map_or(Ok(()), |kind| Err(TextFileError::NotRegular(kind)))
}

fn read_bounded(file: File) -> Result<String, TextFileError> {
    let size_bytes = file.metadata()?.len();
    let mut bytes = Vec::new();
    let length = file.take(SCENE_SIZE_BYTES_MAX as u64 + 1).read_to_end(&mut bytes)?;
    if let Some(format) = other_format(&bytes, size_bytes) {
        return Err(TextFileError::OtherFormat(format));
    }
    if length > SCENE_SIZE_BYTES_MAX {
        return Err(TextFileError::TooLong);
    }
    to_text(bytes)
}

/// Returns the text in the bytes of a file.
///
/// # Errors
/// The bytes are not UTF-8.
pub fn to_text(bytes: Vec<u8>) -> Result<String, TextFileError> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = valid.split(|byte| *byte == b'\n').count();
        TextFileError::NotText { line }
    })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use rustix::fs::{CWD, FileType, Mode, mknodat};

    use super::*;

    /// A path for a temporary file. Removes the file when it is dropped.
    struct TemporaryPath(PathBuf);

    impl TemporaryPath {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("{}-{name}", std::process::id()));
            Self(path)
        }
    }

    impl Drop for TemporaryPath {
        fn drop(&mut self) {
            let _missing = std::fs::remove_file(&self.0);
        }
    }

    fn error(path: &Path) -> String {
        read_scene_file(path).unwrap_err().to_string()
    }

    #[test]
    fn a_regular_file_is_read() {
        let file = TemporaryPath::new("regular.toml");
        std::fs::write(&file.0, "version = 1\n").unwrap();
        assert_eq!(read_scene_file(&file.0).unwrap(), "version = 1\n");
    }

    #[test]
    fn a_fifo_is_refused_without_waiting_for_a_writer() {
        let fifo = TemporaryPath::new("fifo.toml");
        mknodat(CWD, &fifo.0, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        assert_eq!(error(&fifo.0), "it is a named pipe (FIFO), not a regular file");
    }

    #[test]
    fn directories_and_devices_are_refused() {
        assert_eq!(error(&std::env::temp_dir()), "it is a directory, not a regular file");
        assert_eq!(error(Path::new("/dev/zero")), "it is a device, not a regular file");
    }

    #[test]
    fn a_file_that_is_too_long_or_not_text_is_refused() {
        let file = TemporaryPath::new("long.toml");
        let handle = File::create(&file.0).unwrap();
        handle.set_len(SCENE_SIZE_BYTES_MAX as u64 + 1).unwrap();
        assert_eq!(error(&file.0), "it is longer than 16777216 bytes");
        handle.set_len(SCENE_SIZE_BYTES_MAX as u64).unwrap();
        assert_eq!(read_scene_file(&file.0).unwrap().len(), SCENE_SIZE_BYTES_MAX);
        std::fs::write(&file.0, b"version = 1\nname = 'caf\xe9'\n").unwrap();
        let text = "line 2 is not text in UTF-8; save the file in this encoding";
        assert_eq!(error(&file.0), text);
    }

    #[test]
    fn a_mesh_in_another_format_is_told_by_its_content_whatever_its_size() {
        let file = TemporaryPath::new("model.obj");
        std::fs::write(&file.0, b"glTF\x02\0\0\0\xff\xff\0\0").unwrap();
        let handle = OpenOptions::new().write(true).open(&file.0).unwrap();
        handle.set_len(SCENE_SIZE_BYTES_MAX as u64 + 9).unwrap();
        let text = "it is a glTF file (binary); only Wavefront OBJ is read: export the mesh in that format";
        assert_eq!(error(&file.0), text);
    }

    #[test]
    fn a_missing_file_has_the_error_of_the_system() {
        assert_eq!(error(Path::new("/no/such.toml")), "No such file or directory (os error 2)");
    }
}
