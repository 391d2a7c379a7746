//! Options that several subcommands share.

use std::fs::{self, File};
use std::num::NonZero;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;

use anyhow::bail;
use recording::{Compression, Existing, LogOptions, LogWriter, PartFile};
use sim_contract::{Endpoint, EndpointError, NAME_DEFAULT};
use sim_host::part_path;
use sim_solver::THREADS_MAX;

use super::parse::whole_number_in;

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

/// The name and the domain of a node.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct EndpointArgs {
    /// Name of the node: its services are NAME/particles, NAME/commands, ...
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", allow_hyphen_values = true,
        value_parser = Endpoint::parse_name)]
    name: String,
    /// Domain that separates these services from others on this host [env: `CATENARY_DOMAIN`]
    /// [default: iceoryx2's own domain]
    #[arg(long, value_name = "DOMAIN", allow_hyphen_values = true,
        value_parser = Endpoint::parse_domain)]
    domain: Option<String>,
}

impl EndpointArgs {
    /// Returns the endpoint. Without `--domain`, the variable `CATENARY_DOMAIN` gives the domain.
    pub(crate) fn endpoint(&self) -> Result<Endpoint, EndpointError> {
        Endpoint::from_options(self.domain.as_deref(), Some(&self.name))
    }
}

/// The option of the subcommands that step a solver.
#[derive(Debug, clap::Args)]
pub(crate) struct ThreadArgs {
    /// Number of solver threads, 1 to 64. More threads speed up large scenes and change no bit of
    /// the result
    #[arg(long, value_name = "N", default_value_t = 1, allow_hyphen_values = true,
        value_parser = thread_count)]
    threads: usize,
}

/// The option of the subcommand that simulates the parts of a recording side by side.
#[derive(Debug, clap::Args)]
pub(crate) struct PartArgs {
    /// Number of threads that simulate parts of the recording side by side, 1 to 64. Default: the number of cores
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = thread_count)]
    threads: Option<usize>,
}

impl PartArgs {
    pub(crate) fn count(&self) -> usize {
        let cores = || available_parallelism().map_or(1, NonZero::get).min(THREADS_MAX as usize);
        self.threads.unwrap_or_else(cores)
    }
}

impl ThreadArgs {
    pub(crate) fn count(&self) -> usize {
        self.threads
    }
}

fn thread_count(text: &str) -> Result<usize, String> {
    let count = whole_number_in(text, &(1..=u64::from(THREADS_MAX)))?;
    usize::try_from(count).map_err(|error| error.to_string())
}
