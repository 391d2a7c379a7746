//! The files of an export, which all get their names or are all removed.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use recording::{Existing, PartFile};
use sim_contract::{console, explain_write_error};

/// A file that keeps the first error of writing, which a format may wrap or take for one of its input.
struct ObservedFile<'a> {
    file: &'a mut PartFile,
    failure: Option<String>,
}

impl ObservedFile<'_> {
    fn observe<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        if let Err(error) = &result
            && error.kind() != io::ErrorKind::Interrupted
        {
            self.failure.get_or_insert_with(|| explain_write_error(error));
        }
        result
    }
}

impl Write for ObservedFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.file.write(bytes);
        self.observe(result)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.file.flush();
        self.observe(result)
    }
}

/// Returns `true` for the path `-`, which is stdout.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

/// Stdout, which notes that its reader wants no more.
struct ResultStream<'a> {
    is_closed: &'a mut bool,
}

impl Write for ResultStream<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        *self.is_closed |= !console::write_part(bytes)?;
        if *self.is_closed { Err(io::ErrorKind::BrokenPipe.into()) } else { Ok(bytes.len()) }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes a file to stdout. A pipe whose reader has gone ends it quietly.
fn write_to_stdout(write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>) -> anyhow::Result<()> {
    let mut is_closed = false;
    let mut out = BufWriter::with_capacity(1 << 16, ResultStream { is_closed: &mut is_closed });
    let result = write(&mut out).and_then(|()| out.flush().context("cannot write to stdout"));
    // What is left in the buffer after an error is dropped.
    let (_stream, _rest) = out.into_parts();
    if is_closed { Ok(()) } else { result }
}

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

    /// Writes a file piece by piece. It gets its name only when it is complete. The path `-` is stdout.
    pub(crate) fn add_streamed(
        &mut self,
        path: &Path,
        write: impl FnOnce(&mut dyn Write) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        if is_stdout(path) {
            self.paths.push(path.to_owned());
            return write_to_stdout(write);
        }
        let mut file = PartFile::create(path, self.existing)?;
        let mut observed = ObservedFile { file: &mut file, failure: None };
        if let Err(error) = write(&mut observed) {
            let failure = observed.failure.map(|text| {
                let part_path = file.part_path().display();
                anyhow!("cannot write {part_path}: {text}")
            });
            file.discard()?;
            return Err(failure.unwrap_or(error));
        }
        self.paths.push(file.finish()?);
        Ok(())
    }

    /// Removes the files, so that nothing of an incomplete export is left.
    pub(crate) fn remove(self) {
        for path in self.paths.iter().filter(|path| !is_stdout(path)) {
            // An error of the export is reported already, and is more important.
            _ = fs::remove_file(path);
        }
    }
}
