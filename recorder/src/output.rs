//! What the program says: results on stdout, everything else on stderr.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use indicatif::{ProgressBar, ProgressStyle};
use recorder::{Compression, Existing, LogOptions, LogWriter, PartFile, RunDescription};
use serde::Serialize;

/// Prints a result: the value as one line of JSON, or the text.
pub(crate) fn result<T: Serialize>(as_json: AsJson, value: &T, text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    if as_json.json {
        writeln!(out, "{}", serde_json::to_string(value)?)?;
    } else {
        writeln!(out, "{text}")?;
    }
    Ok(())
}

/// Prints a line on stderr. Who has closed it wants none.
pub(crate) fn note(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// How results are printed.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct AsJson {
    /// Print the result as one line of JSON
    #[arg(long)]
    json: bool,
}

/// A progress bar over steps, on a terminal only.
pub(crate) fn progress_bar(steps: u64) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} steps, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(steps).with_style(style)
}

/// A spinner with a message, on a terminal only.
pub(crate) fn progress_spinner() -> ProgressBar {
    if io::stderr().is_terminal() { ProgressBar::new_spinner() } else { ProgressBar::hidden() }
}

/// How and where a recording is written.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct FileArgs {
    /// Compression of the file: less of it is less work for the processor
    #[arg(long, value_enum, default_value_t = CompressionArg::Zstd)]
    compression: CompressionArg,
    /// Replace the file if it exists [default: refuse]
    #[arg(long)]
    overwrite: bool,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum CompressionArg {
    /// None: 0.2 ms per 10,000 particles
    None,
    /// LZ4: 0.9 ms per 10,000 particles
    Lz4,
    /// Zstandard level 1: 1.4 ms per 10,000 particles
    Zstd,
}

/// A recording on its way into a file.
pub(crate) type LogFile = LogWriter<PartFile>;

impl FileArgs {
    /// Begins the file, under its name with `.part` behind it.
    pub(crate) fn create(&self, path: &Path) -> anyhow::Result<PartFile> {
        let existing = if self.overwrite { Existing::Overwrite } else { Existing::Refuse };
        Ok(PartFile::create(path, existing)?)
    }

    /// Begins the recording in it. `log_time_ns`: wall clock now.
    pub(crate) fn begin(
        &self,
        file: PartFile,
        run: &RunDescription,
        scene: &[u8],
        log_time_ns: u64,
    ) -> anyhow::Result<LogFile> {
        let compression = match self.compression {
            CompressionArg::None => Compression::None,
            CompressionArg::Lz4 => Compression::Lz4,
            CompressionArg::Zstd => Compression::Zstd,
        };
        let options = LogOptions { compression, ..LogOptions::default() };
        Ok(LogWriter::create(file, options, run, scene, log_time_ns)?)
    }
}

/// A path for people.
pub(crate) fn name_of(path: &Path) -> String {
    path.display().to_string()
}

/// The path that a recording gets unless told otherwise.
pub(crate) fn default_path(stem: &str, now_ns: u64) -> PathBuf {
    let now = std::time::UNIX_EPOCH + std::time::Duration::from_nanos(now_ns);
    let time = humantime::format_rfc3339_seconds(now).to_string().replace(':', "-");
    PathBuf::from(format!("{stem}_{time}.mcap"))
}
