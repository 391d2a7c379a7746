//! A file that gets its name only when it is finished.

mod disk;
pub(crate) mod error;

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, ErrorKind, IoSlice, Write};
use std::path::{Path, PathBuf};

use rustix::fs::{Access, CWD, RenameFlags, access, renameat_with};
use rustix::io::Errno;

use crate::file_lock::{Lock, holder, is_locked, kind_of_non_file, lock};
use disk::{Allocation, DiskFile};
use error::{PartFileError, io_error};

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
        if self == Self::Refuse && is_taken(path) {
            return Err(PartFileError::Exists(path.to_owned()));
        }
        Ok(())
    }
}

/// `NAME.part`, which [`PartFile::finish`] renames to `NAME`. It is locked, so no other program that
/// uses this type writes it. If it is dropped earlier, the file `NAME.part` stays.
#[derive(Debug)]
pub struct PartFile<F: DiskFile = File> {
    out: BufWriter<F>,
    allocation: Allocation,
    sync_on_flush: SyncOnFlush,
    path: PathBuf,
    part_path: PathBuf,
    existing: Existing,
}

/// The part of a file that the next flush syncs to disk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SyncOnFlush {
    Nothing,
    Data,
    /// The data, and the name of a file that is new.
    DataAndName,
}

impl PartFile {
    /// Creates the file `path` with the suffix `.part`.
    ///
    /// # Errors
    /// If either file exists and may not be replaced, if either name belongs to something that is
    /// not a file, if another program is writing either, or if the operating system reports an error.
    pub fn create(path: &Path, existing: Existing) -> Result<Self, PartFileError> {
        check_unused(path)?;
        existing.check(path)?;
        let part_path = part_path(path);
        check_kind(&part_path)?;
        let file = open_locked(&part_path, existing)?;
        // Only now, because the file may have belonged to another program until it was locked.
        file.set_len(0).map_err(|cause| io_error(&part_path, cause))?;
        Ok(Self::begin(file, path, existing))
    }

    /// Checks that [`PartFile::create`] would create the file now, and changes nothing.
    ///
    /// # Errors
    /// Same as [`PartFile::create`].
    pub fn check(path: &Path, existing: Existing) -> Result<(), PartFileError> {
        check_unused(path)?;
        existing.check(path)?;
        let part_path = part_path(path);
        check_unused(&part_path)?;
        if existing == Existing::Refuse && is_taken(&part_path) {
            return Err(PartFileError::PartExists(part_path));
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        access(folder, Access::WRITE_OK | Access::EXEC_OK)
            .map_err(|cause| io_error(&part_path, cause.into()))
    }

    /// Writes a whole file. An existing file keeps its contents until the new ones are complete.
    ///
    /// # Errors
    /// Same as [`PartFile::create`] and [`PartFile::finish`]. After an error, nothing is left, except
    /// after [`PartFileError::NameNotSynced`], which leaves the complete file.
    pub fn write_whole(path: &Path, existing: Existing, bytes: &[u8]) -> Result<(), PartFileError> {
        Self::create(path, existing)?.finish_with(bytes)
    }
}

impl<F: DiskFile> PartFile<F> {
    /// Begins with an empty file that has the suffix `.part`.
    fn begin(file: F, path: &Path, existing: Existing) -> Self {
        let out = BufWriter::with_capacity(BUFFER_SIZE_BYTES, file);
        let (path, part_path) = (path.to_owned(), part_path(path));
        let (allocation, sync_on_flush) = (Allocation::new(), SyncOnFlush::Nothing);
        Self { out, allocation, sync_on_flush, path, part_path, existing }
    }

    /// Makes every flush wait until the data is on disk, so that a power cut loses only what was
    /// written after the last flush. The caller of [`PartFile::create`] does not wait for the disk.
    #[must_use]
    pub fn with_sync_on_flush(mut self) -> Self {
        self.sync_on_flush = SyncOnFlush::DataAndName;
        self
    }

    /// Returns the path with the suffix `.part`.
    pub fn part_path(&self) -> &Path {
        &self.part_path
    }

    /// Syncs the file to disk, renames it to its final name, and syncs the name to disk.
    ///
    /// # Errors
    /// If a file with that name exists by now, or the operating system reports an error. The error
    /// states which file is complete, if one is.
    pub fn finish(mut self) -> Result<PathBuf, PartFileError> {
        self.sync()?;
        self.rename().map_err(|error| match error {
            PartFileError::Moved(_) => error,
            error => PartFileError::NotRenamed {
                part_path: self.part_path.clone(),
                error: Box::new(error),
            },
        })?;
        self.sync_name()?;
        Ok(self.path.clone())
    }

    /// Writes the whole contents and finishes the file, or leaves nothing.
    fn finish_with(mut self, bytes: &[u8]) -> Result<(), PartFileError> {
        let written = self.write_all(bytes).map_err(|cause| io_error(&self.part_path, cause));
        match written.and_then(|()| self.sync()).and_then(|()| self.rename()) {
            Ok(()) => self.sync_name(),
            Err(error) => {
                self.discard()?;
                Err(error)
            }
        }
    }

    fn sync(&mut self) -> Result<(), PartFileError> {
        let whole = self.write_buffer().and_then(|()| self.out.get_ref().sync_all());
        whole.map_err(|cause| io_error(&self.part_path, cause))
    }

    /// Writes what is buffered, and frees the space behind it.
    fn write_buffer(&mut self) -> io::Result<()> {
        let written = self.out.flush();
        written.and(self.allocation.free_unused(self.out.get_ref()))
    }

    fn sync_name(&self) -> Result<(), PartFileError> {
        let synced = self.out.get_ref().sync_folder_of(&self.path);
        synced.map_err(|cause| PartFileError::NameNotSynced { path: self.path.clone(), cause })
    }

    /// Deletes the unfinished file.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn discard(self) -> Result<(), PartFileError> {
        fs::remove_file(&self.part_path).map_err(|cause| io_error(&self.part_path, cause))
    }

    fn rename(&self) -> Result<(), PartFileError> {
        if !self.out.get_ref().is_in_place(&self.part_path) {
            return Err(PartFileError::Moved(self.part_path.clone()));
        }
        // It may be the unfinished file of another program by now.
        check_unused(&self.path)?;
        let path_error = |cause| io_error(&self.path, cause);
        if self.existing == Existing::Overwrite {
            return fs::rename(&self.part_path, &self.path).map_err(path_error);
        }
        match renameat_with(CWD, &self.part_path, CWD, &self.path, RenameFlags::NOREPLACE) {
            Ok(()) => Ok(()),
            Err(Errno::EXIST) => Err(PartFileError::Exists(self.path.clone())),
            // Some file systems do not support NOREPLACE. Test for the file once more instead.
            Err(Errno::INVAL | Errno::NOSYS) if is_taken(&self.path) => {
                Err(PartFileError::Exists(self.path.clone()))
            }
            Err(Errno::INVAL | Errno::NOSYS) => {
                fs::rename(&self.part_path, &self.path).map_err(path_error)
            }
            Err(error) => Err(path_error(error.into())),
        }
    }
}

impl<F: DiskFile> Write for PartFile<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.allocation.make_room(bytes.len(), self.out.get_ref());
        self.allocation.count(self.out.write(bytes))
    }

    fn write_vectored(&mut self, parts: &[IoSlice<'_>]) -> io::Result<usize> {
        let count = parts.iter().map(|part| part.len()).sum();
        self.allocation.make_room(count, self.out.get_ref());
        self.allocation.count(self.out.write_vectored(parts))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()?;
        let file = self.out.get_ref();
        match self.sync_on_flush {
            SyncOnFlush::Nothing => {}
            SyncOnFlush::Data => file.sync_data()?,
            SyncOnFlush::DataAndName => {
                file.sync_data()?;
                file.sync_folder_of(&self.part_path)?;
                self.sync_on_flush = SyncOnFlush::Data;
            }
        }
        Ok(())
    }
}

impl<F: DiskFile> Drop for PartFile<F> {
    fn drop(&mut self) {
        // Nobody is left to be told of an error, and the file stays as it is.
        let _written = self.write_buffer();
    }
}

/// Most attempts to open a file that other programs finish in the meantime.
const ATTEMPTS_MAX: u32 = 100;

/// Opens and locks a file with its old contents.
fn open_locked(path: &Path, existing: Existing) -> Result<File, PartFileError> {
    let io_error = |cause| io_error(path, cause);
    let mut options = OpenOptions::new();
    options.write(true);
    for _ in 0..ATTEMPTS_MAX {
        let (file, is_new) = match options.clone().create_new(true).open(path) {
            Ok(file) => (file, true),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => match options.open(path) {
                Ok(file) => (file, false),
                // Finished or removed in the meantime.
                Err(error) if error.kind() == ErrorKind::NotFound => continue,
                Err(error) => return Err(io_error(error)),
            },
            Err(error) => return Err(io_error(error)),
        };
        match lock(&file, path) {
            Lock::Taken { process_id } => {
                return Err(PartFileError::InUse { path: path.to_owned(), process_id });
            }
            Lock::Held if is_new || existing == Existing::Overwrite => return Ok(file),
            Lock::Held => return Err(PartFileError::PartExists(path.to_owned())),
            Lock::Moved => {}
        }
    }
    Err(PartFileError::InUse { path: path.to_owned(), process_id: None })
}

/// Refuses a file that another program is writing, as its `.part` file.
fn check_unused(path: &Path) -> Result<(), PartFileError> {
    // Opening a named pipe would wait for its writer.
    check_kind(path)?;
    match File::open(path) {
        Ok(file) if is_locked(&file) => {
            let process_id = holder(&file);
            Err(PartFileError::InUse { path: path.to_owned(), process_id })
        }
        // Later errors report a file that cannot be opened.
        _ => Ok(()),
    }
}

/// Returns `true` if a file has this name, or a link, also one to nothing: the finished file cannot take its place.
fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
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
pub fn part_path(path: &Path) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(".part");
    PathBuf::from(name)
}

#[cfg(test)]
mod tests;
