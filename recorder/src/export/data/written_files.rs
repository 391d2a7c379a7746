//! The files of an export, which all get their names or are all removed.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use recorder::{Existing, PartFile};

/// The files that an export has written so far.
#[derive(Debug)]
pub(crate) struct WrittenFiles {
    existing: Existing,
    paths: Vec<PathBuf>,
}

impl WrittenFiles {
    pub(crate) fn new(existing: Existing) -> Self {
        Self { existing, paths: Vec::new() }
    }

    pub(crate) fn existing(&self) -> Existing {
        self.existing
    }

    pub(crate) fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Writes a file from its whole content.
    pub(crate) fn add_whole(&mut self, path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
        PartFile::write_whole(path, self.existing, bytes)?;
        self.paths.push(path.to_owned());
        Ok(())
    }

    /// Writes a file piece by piece. It gets its name only when it is complete.
    pub(crate) fn add_streamed(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut file = PartFile::create(path, self.existing)?;
        if let Err(error) = write(&mut file) {
            file.discard()?;
            return Err(error);
        }
        self.paths.push(file.finish()?);
        Ok(())
    }

    /// Removes the files, so that nothing of an incomplete export is left.
    pub(crate) fn remove(self) {
        for path in self.paths {
            // An error of the export is reported already, and is more important.
            _ = fs::remove_file(path);
        }
    }
}
