//! A file that bears its name only once it is finished.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::io::Errno;

/// Bytes that are gathered before they go to the operating system.
const BUFFER_SIZE_BYTES: usize = 1 << 18;

/// What to do with files that are there already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Leave them and fail.
    Refuse,
    /// Replace them.
    Overwrite,
}

/// Why a file cannot be begun or finished.
#[derive(Debug, thiserror::Error)]
pub enum PartFileError {
    /// The name is taken.
    #[error("{} exists (--overwrite replaces it)", .0.display())]
    Exists(PathBuf),
    /// What a killed recorder left, which may be all that there is of a recording.
    #[error("{} exists: another recorder writes it, or one was killed (--overwrite replaces it)", .0.display())]
    PartExists(PathBuf),
    /// The operating system says no.
    #[error("cannot write {}: {cause}", path.display())]
    Io {
        /// What was being written.
        path: PathBuf,
        /// What it says.
        cause: io::Error,
    },
}

/// `NAME.part`, renamed to `NAME` by [`PartFile::finish`]. Dropped before that, it stays.
#[derive(Debug)]
pub struct PartFile {
    out: BufWriter<File>,
    path: PathBuf,
    part_path: PathBuf,
    existing: Existing,
}

impl PartFile {
    /// Creates `path` with `.part` behind it.
    ///
    /// # Errors
    /// If either exists and is not to be overwritten, or the operating system says no.
    pub fn create(path: &Path, existing: Existing) -> Result<Self, PartFileError> {
        if existing == Existing::Refuse && path.exists() {
            return Err(PartFileError::Exists(path.to_owned()));
        }
        let part_path = part_path(path);
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

    /// Where it is being written.
    pub fn part_path(&self) -> &Path {
        &self.part_path
    }

    /// Hands everything to the disk and gives the file its name.
    ///
    /// # Errors
    /// If the name is taken by now, or the operating system says no.
    pub fn finish(mut self) -> Result<PathBuf, PartFileError> {
        let of_part = |cause| io_error(&self.part_path, cause);
        self.out.flush().map_err(of_part)?;
        self.out.get_ref().sync_all().map_err(of_part)?;
        self.rename()?;
        Ok(self.path)
    }

    /// Removes what has been written.
    ///
    /// # Errors
    /// If the operating system says no.
    pub fn discard(self) -> Result<(), PartFileError> {
        fs::remove_file(&self.part_path).map_err(|cause| io_error(&self.part_path, cause))
    }

    fn rename(&self) -> Result<(), PartFileError> {
        let of_path = |cause| io_error(&self.path, cause);
        if self.existing == Existing::Overwrite {
            return fs::rename(&self.part_path, &self.path).map_err(of_path);
        }
        match renameat_with(CWD, &self.part_path, CWD, &self.path, RenameFlags::NOREPLACE) {
            Ok(()) => Ok(()),
            Err(Errno::EXIST) => Err(PartFileError::Exists(self.path.clone())),
            // Some file systems cannot exclude; then the name is looked at once more.
            Err(Errno::INVAL | Errno::NOSYS) if self.path.exists() => {
                Err(PartFileError::Exists(self.path.clone()))
            }
            Err(Errno::INVAL | Errno::NOSYS) => {
                fs::rename(&self.part_path, &self.path).map_err(of_path)
            }
            Err(error) => Err(of_path(error.into())),
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

fn part_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(".part");
    PathBuf::from(name)
}

fn io_error(path: &Path, cause: io::Error) -> PartFileError {
    PartFileError::Io { path: path.to_owned(), cause }
}
