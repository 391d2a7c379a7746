//! Options of the subcommands that write files.

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use anyhow::bail;
use recording::{Compression, Existing, LogOptions, LogWriter, PartFile};
use sim_contract::part_path;

/// The option to replace existing files.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(crate) struct OverwriteArgs {
    /// Replace files that exist [default: refuse, and write nothing]
    #[arg(long)]
    overwrite: bool,
}

impl OverwriteArgs {
    pub(crate) fn existing(self) -> Existing {
        if self.overwrite { Existing::Overwrite } else { Existing::Refuse }
    }
}

/// The format of a recording and the handling of an existing file.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct FileArgs {
    /// Compression of the file: less compression takes less processor time [default: zstd]
    #[arg(long, value_enum, conflicts_with = "preset")]
    compression: Option<CompressionArg>,
    /// Compression and size of the chunks in one word [default: default]
    #[arg(long, value_enum)]
    preset: Option<Preset>,
    #[command(flatten)]
    overwrite: OverwriteArgs,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum CompressionArg {
    /// No compression: 0.2 ms per 10,000 particles
    None,
    /// LZ4: 0.9 ms per 10,000 particles
    Lz4,
    /// Zstandard level 1: 1.4 ms per 10,000 particles
    Zstd,
}

/// A choice of compression and chunks, named as in rosbag2.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Preset {
    /// No compression, chunks of 1 MiB: for 100,000 particles at 60 Hz
    Fast,
    /// Zstandard level 1, chunks of 1 MiB
    Default,
    /// Zstandard level 19, chunks of 4 MiB: about 100 ms per 10,000 particles, so for `simulate` and
    /// small scenes
    Small,
}

impl Preset {
    fn options(self) -> LogOptions {
        let chunks = |compression, chunk_size_bytes| LogOptions {
            compression,
            chunk_size_bytes,
            ..LogOptions::default()
        };
        match self {
            Self::Fast => chunks(Compression::None, 1 << 20),
            Self::Default => LogOptions::default(),
            Self::Small => chunks(Compression::ZstdSmallest, 4 << 20),
        }
    }
}

/// A recording that is being written into a file.
pub(crate) type LogFile = LogWriter<PartFile>;

impl FileArgs {
    /// Returns the handling of files that exist.
    pub(crate) fn existing(&self) -> Existing {
        self.overwrite.existing()
    }

    /// Creates the file, with the suffix `.part`.
    pub(crate) fn create(&self, path: &Path) -> anyhow::Result<PartFile> {
        Ok(PartFile::create(path, self.overwrite.existing())?)
    }

    /// Returns the format of the file.
    pub(crate) fn options(&self) -> LogOptions {
        let compression = match self.compression {
            None => return self.preset.unwrap_or(Preset::Default).options(),
            Some(CompressionArg::None) => Compression::None,
            Some(CompressionArg::Lz4) => Compression::Lz4,
            Some(CompressionArg::Zstd) => Compression::Zstd,
        };
        LogOptions { compression, ..LogOptions::default() }
    }
}

/// Returns the path of a recording without `--output`: `STEM_<UTC time>.mcap`.
pub(crate) fn default_path(stem: &str, now_ns: u64) -> PathBuf {
    let now = std::time::UNIX_EPOCH + std::time::Duration::from_nanos(now_ns);
    let time = humantime::format_rfc3339_seconds(now).to_string().replace(':', "-");
    PathBuf::from(format!("{stem}_{time}.mcap"))
}

/// Refuses an output that would replace the input: its own name, or its name without `.part`, whose
/// `.part` file it is.
pub(crate) fn refuse_own_input(input: &File, output: &Path) -> anyhow::Result<()> {
    let input = input.metadata()?;
    for path in [output.to_owned(), part_path(output)] {
        let Ok(existing) = fs::metadata(&path) else { continue };
        if (existing.dev(), existing.ino()) == (input.dev(), input.ino()) {
            bail!(
                "{}: this is the input, or the name under which the output is written; choose another name",
                path.display()
            );
        }
    }
    Ok(())
}
