//! The names of the files of a recording.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::bail;
use recorder::{Existing, PartFileError, counted};
use sim_contract::is_being_written;

use crate::cli::output;

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

    /// Numbers the files after those that are in the folder. Returns those, oldest first.
    pub(crate) fn after_earlier_files(mut self) -> (Self, Vec<PathBuf>) {
        let earlier = self.earlier_files();
        let last = earlier.last().and_then(|path| self.number_of(path));
        if let Self::Numbered { first, .. } = &mut self {
            *first = last.map_or(0, |last| last.saturating_add(1));
        }
        (self, earlier)
    }

    /// Numbers the files of a ring after those of earlier recordings, and returns these.
    pub(crate) fn after_ring(self) -> anyhow::Result<(Self, Vec<PathBuf>)> {
        let (names, earlier) = self.after_earlier_files();
        if let Some(path) = earlier.iter().find(|path| is_being_written(path)) {
            let path = path.display();
            bail!(
                "{path} is being written by another recorder; end it, or choose another name with -o"
            );
        }
        if let Some(last) = earlier.last() {
            let (files, last) = (counted(earlier.len() as u64, "earlier file"), last.display());
            output::note(&format!("the ring goes on after {last}, with {files}"));
        }
        Ok((names, earlier))
    }

    /// Returns the path of a file, counted from 0.
    pub(crate) fn path(&self, number: u64) -> PathBuf {
        match self {
            Self::Single(path) => path.clone(),
            Self::Numbered { path, first } => {
                let (stem, extension) = split_name(path);
                let mut name = stem;
                name.push(format!("_{:04}{extension}", first + number));
                path.with_file_name(name)
            }
        }
    }

    /// Checks that the first file may be created, and that no numbered file of an earlier recording is
    /// there: its files would be taken for those of this one. Returns the number of those that `existing`
    /// allows.
    pub(crate) fn check(&self, existing: Existing) -> Result<usize, PartFileError> {
        existing.check(&self.path(0))?;
        let earlier = self.earlier_files();
        match earlier.first() {
            Some(path) if existing == Existing::Refuse => {
                Err(PartFileError::Exists(path.to_owned()))
            }
            _ => Ok(earlier.len()),
        }
    }

    /// Returns the numbered files, finished or not, that are in the folder, by their numbers. A folder that cannot be
    /// read is reported when a file is created.
    fn earlier_files(&self) -> Vec<PathBuf> {
        let Self::Numbered { path, .. } = self else { return Vec::new() };
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let entries = fs::read_dir(folder.unwrap_or(Path::new("."))).into_iter().flatten();
        let names = entries.flatten().map(|entry| path.with_file_name(entry.file_name()));
        let numbered = names.filter_map(|path| Some((self.number_of(&path)?, path)));
        let mut files: Vec<_> = numbered.collect();
        files.sort_unstable();
        files.into_iter().map(|(_, path)| path).collect()
    }

    /// Returns the number in the name of a file of this recording, finished or not.
    fn number_of(&self, file: &Path) -> Option<u64> {
        let Self::Numbered { path, .. } = self else { return None };
        let (stem, extension) = split_name(path);
        let (name, stem) = (file.file_name()?.to_str()?, stem.to_str()?);
        let name = name.strip_suffix(".part").unwrap_or(name);
        let number = name.strip_suffix(extension)?.strip_prefix(stem)?.strip_prefix('_')?;
        let is_number = number.len() >= 4 && number.bytes().all(|byte| byte.is_ascii_digit());
        number.parse().ok().filter(|_| is_number)
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
        for name in ["run.mcap", "run_1.mcap", "run_00a0.mcap", "run_0000.txt", "rerun_0000.mcap"] {
            assert_eq!(names.number_of(Path::new(name)), None, "{name}");
        }
    }
}
