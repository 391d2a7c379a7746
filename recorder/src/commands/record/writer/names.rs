//! The names of the files of a recording.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::bail;
use recording::{Existing, LogReader, PartFileError, ReadError, counted};
use sim_host::is_being_written;

use crate::cli::output;

/// Largest number of a file: a file each second for 31 years. Names with larger numbers are not ours.
const NUMBER_MAX: u64 = 1_000_000_000;
/// Largest distance between the numbers of two files that follow each other, because other programs move files
/// away: a file each second for 11 days.
const NUMBER_DISTANCE_MAX: u64 = 1_000_000;

/// The names of the files of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum FileNames {
    /// The one file of a recording.
    Single(PathBuf),
    /// `NAME_0000.mcap`, `NAME_0001.mcap` and so on: numbered from 0 after an underscore, as rosbag2 does,
    /// but with zeros before the number, so that the names sort.
    Numbered {
        /// The path without a number.
        path: PathBuf,
        /// Number in the name of the first file.
        first: u64,
    },
}

impl FileNames {
    /// Returns the names of several files, numbered from 0.
    pub(crate) fn numbered(path: PathBuf) -> Self {
        Self::Numbered { path, first: 0 }
    }

    /// Returns `true` for the name of a single file.
    pub(crate) fn is_single(&self) -> bool {
        matches!(self, Self::Single(_))
    }

    /// Numbers the files after the numbered files in the folder. Returns those files, oldest first.
    ///
    /// # Errors
    /// If the numbers of the files in the folder are too far apart for one series of files.
    pub(crate) fn after_earlier_files(mut self) -> anyhow::Result<(Self, Vec<PathBuf>)> {
        let earlier = self.earlier_files();
        for pair in earlier.windows(2) {
            let [(before, _), (after, path)] = pair else { continue };
            if after - before > NUMBER_DISTANCE_MAX {
                let path = output::path_text(path);
                bail!(
                    "{path}: its number is too far from {before}, the one before it; move this file, or choose \
                     another name with -o"
                );
            }
        }
        if let (Self::Numbered { first, .. }, Some((last, _))) = (&mut self, earlier.last()) {
            *first = last + 1;
        }
        Ok((self, earlier.into_iter().map(|(_, path)| path).collect()))
    }

    /// Numbers the files of a ring after the numbered files in the folder. Returns the recordings among those
    /// files, oldest first: the ring removes them.
    ///
    /// # Errors
    /// If another recorder is writing one of the files, or if their numbers are too far apart.
    pub(crate) fn after_ring(self) -> anyhow::Result<(Self, Vec<PathBuf>)> {
        let (names, earlier) = self.after_earlier_files()?;
        if let Some(path) = earlier.iter().find(|path| is_being_written(path)) {
            let path = path.display();
            bail!(
                "{path} is being written by another recorder; end it, or choose another name with -o"
            );
        }
        let (ring, others): (Vec<_>, Vec<_>) =
            earlier.into_iter().partition(|path| is_recording(path));
        for path in others {
            let path = output::path_text(&path);
            output::note(&format!("warning: {path} is not a recording, so the ring keeps it"));
        }
        if let Some(last) = ring.last() {
            let (files, last) = (counted(ring.len() as u64, "earlier file"), last.display());
            output::note(&format!("the ring goes on after {last}, with {files}"));
        }
        Ok((names, ring))
    }

    /// Returns the path of a file, counted from 0.
    pub(crate) fn path(&self, number: u64) -> PathBuf {
        match self {
            Self::Single(path) => path.clone(),
            Self::Numbered { path, first } => numbered_path(path, first + number),
        }
    }

    /// Checks that the first file may be created, and that the folder has no numbered file of an earlier
    /// recording, which would be taken for a file of this one, unless `existing` allows it. Returns the number
    /// of such files.
    pub(crate) fn check(&self, existing: Existing) -> Result<usize, PartFileError> {
        existing.check(&self.path(0))?;
        let earlier = self.earlier_files();
        match earlier.first() {
            Some((_, path)) if existing == Existing::Refuse => {
                Err(PartFileError::Exists(path.to_owned()))
            }
            _ => Ok(earlier.len()),
        }
    }

    /// Returns the numbered files in the folder, finished or not, in the order of their numbers. A folder that
    /// cannot be read is reported when a file is created.
    fn earlier_files(&self) -> Vec<(u64, PathBuf)> {
        let Self::Numbered { path, .. } = self else { return Vec::new() };
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let entries = fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten();
        let names = entries.flatten().map(|entry| path.with_file_name(entry.file_name()));
        let mut files: Vec<_> =
            names.filter_map(|path| Some((self.number_of(&path)?, path))).collect();
        files.sort_unstable();
        files
    }

    /// Returns the number of a file of this recording, finished or not. Its name must be spelled exactly as
    /// [`FileNames::path`] does.
    fn number_of(&self, file: &Path) -> Option<u64> {
        let Self::Numbered { path, .. } = self else { return None };
        let is_part = file.extension().is_some_and(|extension| extension == "part");
        let name = if is_part { file.file_stem() } else { file.file_name() }?;
        let (_, extension) = split_name(path);
        let text = name.to_string_lossy();
        let (_, digits) = text.strip_suffix(extension)?.rsplit_once('_')?;
        let number = digits.parse().ok().filter(|number| *number <= NUMBER_MAX)?;
        (numbered_path(path, number).file_name() == Some(name)).then_some(number)
    }
}

/// Returns the path of the file with a number in its name.
fn numbered_path(path: &Path, number: u64) -> PathBuf {
    let (mut name, extension) = split_name(path);
    name.push(format!("_{number:04}{extension}"));
    path.with_file_name(name)
}

/// Returns `true` for a recording, finished or not, of any format, and for the file of a recorder that was killed
/// within its first second: it is empty, or ends in its header.
fn is_recording(path: &Path) -> bool {
    let is_unfinished = path.extension().is_some_and(|extension| extension == "part");
    match LogReader::open(path) {
        Ok(_) | Err(ReadError::Version { .. } | ReadError::Empty) => true,
        Err(ReadError::NoHeader(_)) => is_unfinished,
        Err(_) => false,
    }
}

/// Splits a name before `.mcap`. Any other ending belongs to the name.
fn split_name(path: &Path) -> (OsString, &'static str) {
    let is_mcap = path.extension().is_some_and(|extension| extension == "mcap");
    let (stem, extension) =
        if is_mcap { (path.file_stem(), ".mcap") } else { (path.file_name(), "") };
    (stem.map_or_else(OsString::new, OsString::from), extension)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_numbered_before_their_extension() {
        let path = |name: &str, number| FileNames::numbered(PathBuf::from(name)).path(number);
        assert_eq!(path("logs/run.mcap", 0), Path::new("logs/run_0000.mcap"));
        assert_eq!(path("logs/run.mcap", 12_345), Path::new("logs/run_12345.mcap"));
        assert_eq!(path("run.v2", 7), Path::new("run.v2_0007"));
        assert_eq!(FileNames::Single(PathBuf::from("run.mcap")).path(3), Path::new("run.mcap"));
    }

    #[test]
    fn only_numbered_files_of_the_same_name_belong_to_a_recording() {
        let names = FileNames::numbered(PathBuf::from("logs/run.mcap"));
        for (name, number) in
            [("run_0000.mcap", 0), ("run_12345.mcap", 12345), ("run_0003.mcap.part", 3)]
        {
            assert_eq!(names.number_of(Path::new(name)), Some(number), "{name}");
        }
        for name in [
            "run.mcap",
            "run_1.mcap",
            "run_00012.mcap",
            "run_+001.mcap",
            "run_00a0.mcap",
            "run_0000.txt",
            "run_0000.mcap.part.part",
            "rerun_0000.mcap",
            "run_4000000000.mcap",
        ] {
            assert_eq!(names.number_of(Path::new(name)), None, "{name}");
        }
    }
}
