//! Content of the user in each file of a recording: a metadata record and attached files.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recording::{LogWriter, SCENE_ATTACHMENT, open_regular_file};

use crate::cli::output;

/// Name of the metadata record of `--meta`.
const META_METADATA: &str = "meta";
/// Most bytes of all entries of `--meta`: readers of recordings read metadata up to 64 KiB.
const META_SIZE_BYTES_MAX: usize = 32 << 10;
/// Bytes of an entry besides its name and value: the lengths of both.
const META_ENTRY_SIZE_BYTES: usize = 8;
/// Largest attached file. While a file is copied, snapshots wait in memory, and every file of a recording
/// holds a copy.
const ATTACHMENT_SIZE_BYTES_MAX: u64 = 256 << 20;
/// Most attached files: each stays open while the recorder runs.
const ATTACHMENTS_MAX: usize = 64;

/// Options for content of the user.
#[derive(Debug, Clone, Default, clap::Args)]
pub(crate) struct ExtraArgs {
    /// Add an entry to the metadata record 'meta' of each file. Can be repeated; 32 KiB in all,
    /// with 8 bytes more for each entry
    #[arg(long, value_name = "NAME=VALUE", value_parser = meta_entry)]
    meta: Vec<(String, String)>,
    /// Attach a copy of a file to each file of the recording. Can be repeated; 256 MiB per file
    #[arg(long, value_name = "FILE")]
    attach: Vec<PathBuf>,
}

fn meta_entry(text: &str) -> Result<(String, String), String> {
    let entry = text.split_once('=').filter(|(name, _)| !name.is_empty());
    let entry = entry.map(|(name, value)| (name.to_owned(), value.to_owned()));
    entry.ok_or_else(|| "it must be a name and a value, such as operator=Ada".to_owned())
}

/// Content of the user, checked and opened.
#[derive(Debug, Default)]
pub(crate) struct Extras {
    meta: BTreeMap<String, String>,
    attachments: Vec<AttachedFile>,
}

/// A file that stays open, so that every file of a recording gets the same one.
#[derive(Debug)]
struct AttachedFile {
    name: String,
    path: PathBuf,
    file: File,
    size_bytes: u64,
}

impl Extras {
    /// Checks the entries, and opens the files.
    pub(crate) fn open(args: &ExtraArgs) -> anyhow::Result<Self> {
        let mut extras = Self::default();
        for (name, value) in &args.meta {
            if extras.meta.insert(name.clone(), value.clone()).is_some() {
                bail!("--meta: '{name}' is given twice; give each name once");
            }
        }
        let size_bytes: usize = args
            .meta
            .iter()
            .map(|(name, value)| META_ENTRY_SIZE_BYTES + name.len() + value.len())
            .sum();
        if size_bytes > META_SIZE_BYTES_MAX {
            bail!(
                "--meta: {size_bytes} bytes are too many (allowed: {META_SIZE_BYTES_MAX}); use --attach"
            );
        }
        if args.attach.len() > ATTACHMENTS_MAX {
            bail!(
                "--attach: {} files are too many (allowed: {ATTACHMENTS_MAX})",
                args.attach.len()
            );
        }
        for path in &args.attach {
            let attached = AttachedFile::open(path)
                .with_context(|| format!("cannot attach {}", output::path_text(path)))?;
            if extras.attachments.iter().any(|other| other.name == attached.name) {
                bail!("--attach: two files are called '{}'; rename one", attached.name);
            }
            extras.attachments.push(attached);
        }
        Ok(extras)
    }

    /// Writes everything into a file of the recording.
    pub(super) fn write<W: Write>(&mut self, log: &mut LogWriter<W>) -> anyhow::Result<()> {
        if !self.meta.is_empty() {
            log.write_metadata(META_METADATA, self.meta.clone())?;
        }
        for attached in &mut self.attachments {
            attached.file.rewind()?;
            log.attach(&attached.name, attached.size_bytes, &mut attached.file)
                .with_context(|| format!("cannot attach {}", output::path_text(&attached.path)))?;
        }
        Ok(())
    }
}

impl AttachedFile {
    fn open(path: &Path) -> anyhow::Result<Self> {
        let file = open_regular_file(path)?;
        let size_bytes = file.metadata()?.len();
        if size_bytes > ATTACHMENT_SIZE_BYTES_MAX {
            bail!("it has {size_bytes} bytes (allowed: {ATTACHMENT_SIZE_BYTES_MAX})");
        }
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.context("its name is not text; rename it")?.to_owned();
        if name == SCENE_ATTACHMENT {
            bail!("a recording calls its scene '{SCENE_ATTACHMENT}'; rename the file");
        }
        // A file that cannot be read is an error of the start, not of a later file.
        (&file).read_exact(&mut [0; 1][..usize::from(size_bytes > 0)])?;
        Ok(Self { name, path: path.to_owned(), file, size_bytes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(count: usize) -> anyhow::Result<Extras> {
        let entry = |number| (format!("{number:04}"), String::new());
        Extras::open(&ExtraArgs { meta: (0..count).map(entry).collect(), attach: Vec::new() })
    }

    #[test]
    fn many_short_entries_stay_below_the_limit_of_readers() {
        let count_max = META_SIZE_BYTES_MAX / (META_ENTRY_SIZE_BYTES + 4);
        assert!(open(count_max).is_ok());
        let error = open(count_max + 1).unwrap_err().to_string();
        assert_eq!(error, "--meta: 32772 bytes are too many (allowed: 32768); use --attach");
    }
}
