//! A file that gets its name only when it is finished.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;

use super::file_kind::kind_of_non_file;

/// Bytes to buffer before a write to the operating system.
const BUFFER_SIZE_BYTES: usize = 1 << 18;

/// The handling of files that exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Fail and leave the files unchanged.
    Refuse,
    /// Replace the files.
    Overwrite,
}

impl Existing {
    /// Checks that a file with this name may be created.
    ///
    /// # Errors
    /// If the name belongs to a file that may not be replaced, or to something that is not a file.
    pub fn check(self, path: &Path) -> Result<(), PartFileError> {
        check_kind(path)?;
        if self == Self::Refuse && path.exists() {
            return Err(PartFileError::Exists(path.to_owned()));
        }
        Ok(())
    }
}

/// The reason why a file cannot be created or finished.
#[derive(Debug, thiserror::Error)]
pub enum PartFileError {
    /// A file with this name exists.
    #[error("{} exists (use --overwrite to replace it)", .0.display())]
    Exists(PathBuf),
    /// A `.part` file exists. It may be the only trace of a recording whose recorder was killed.
    #[error(
        "{} exists: another recorder is writing it, or one was killed (use --overwrite to replace it)",
        .0.display()
    )]
    PartExists(PathBuf),
    /// The name belongs to a directory or a device, for example. It is never replaced.
    #[error("{} is {kind}; name a file", path.display())]
    NotAFile {
        /// The name.
        path: PathBuf,
        /// The kind of the thing with this name, with its article.
        kind: &'static str,
    },
    /// The operating system reports an error.
    #[error("cannot write {}: {cause}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error.
        cause: io::Error,
    },
}

/// `NAME.part`, which [`PartFile::finish`] renames to `NAME`. If it is dropped earlier, the file
/// `NAME.part` stays.
#[derive(Debug)]
pub struct PartFile {
    out: BufWriter<File>,
    path: PathBuf,
    part_path: PathBuf,
    existing: Existing,
}

impl PartFile {
    /// Creates the file `path` with the suffix `.part`.
    ///
    /// # Errors
    /// If either file exists and may not be replaced, if either name belongs to something that is
    /// not a file, or if the operating system reports an error.
    pub fn create(path: &Path, existing: Existing) -> Result<Self, PartFileError> {
        existing.check(path)?;
        let part_path = part_path(path);
        check_kind(&part_path)?;
        let mut options = OpenOptions::new();
        match existing {
            Existing::Refuse => options.write(true).create_new(true),
            Existing::Overwrite => options.write(true).create(true).truncate(true),
        };
        let file = options.open(&part_path).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => PartFileError::PartExists(part_path.clone()),
            _ => io_error(&part_path, error),
        })?;
        let out = BufWriter::with_capacity(BUFFER_SIZE_BYTES, file);
        Ok(Self { out, path: path.to_owned(), part_path, existing })
    }

    /// Returns the path with the suffix `.part`.
    pub fn part_path(&self) -> &Path {
        &self.part_path
    }

    /// Syncs the file to disk and renames it to its final name.
    ///
    /// # Errors
    /// If a file with that name exists by now, or the operating system reports an error.
    pub fn finish(mut self) -> Result<PathBuf, PartFileError> {
        let part_error = |cause| io_error(&self.part_path, cause);
        self.out.flush().map_err(part_error)?;
        self.out.get_ref().sync_all().map_err(part_error)?;
        self.rename()?;
        Ok(self.path)
    }

    /// Deletes the unfinished file.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn discard(self) -> Result<(), PartFileError> {
        fs::remove_file(&self.part_path).map_err(|cause| io_error(&self.part_path, cause))
    }

    fn rename(&self) -> Result<(), PartFileError> {
        let path_error = |cause| io_error(&self.path, cause);
        if self.existing == Existing::Overwrite {
            return fs::rename(&self.part_path, &self.path).map_err(path_error);
        }
        match renameat_with(CWD, &self.part_path, CWD, &self.path, RenameFlags::NOREPLACE) {
            Ok(()) => Ok(()),
            Err(Errno::EXIST) => Err(PartFileError::Exists(self.path.clone())),
            // Some file systems do not support NOREPLACE. Test for the file once more instead.
            Err(Errno::INVAL | Errno::NOSYS) if self.path.exists() => {
                Err(PartFileError::Exists(self.path.clone()))
            }
            Err(Errno::INVAL | Errno::NOSYS) => {
                fs::rename(&self.part_path, &self.path).map_err(path_error)
            }
            Err(error) => Err(path_error(error.into())),
        }
    }
}

impl Write for PartFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Refuses a name that belongs to something other than a regular file or a link to one. Later errors
/// report a name that cannot be looked up.
fn check_kind(path: &Path) -> Result<(), PartFileError> {
    match fs::metadata(path).ok().and_then(|metadata| kind_of_non_file(metadata.file_type())) {
        Some(kind) => Err(PartFileError::NotAFile { path: path.to_owned(), kind }),
        None => Ok(()),
    }
}

/// Returns the path with the suffix `.part`.
pub(super) fn part_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(".part");
    PathBuf::from(name)
}

fn io_error(path: &Path, cause: io::Error) -> PartFileError {
    PartFileError::Io { path: path.to_owned(), cause }
}
