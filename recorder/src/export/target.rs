//! Where pictures go: files of a folder, named after the scene and the step.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recorder::{Existing, PartFile};

use super::shape::Picture;
use super::{png, svg};

/// Where pictures go.
#[derive(Debug)]
pub(crate) struct Target<'a> {
    folder: &'a Path,
    format: Format,
    existing: Existing,
    /// The name of the scene, as a part of file names.
    stem: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Png,
    Svg,
}

impl<'a> Target<'a> {
    pub(crate) fn new(
        folder: &'a Path,
        format: Format,
        existing: Existing,
        scene_name: &str,
    ) -> Self {
        Self { folder, format, existing, stem: stem(scene_name) }
    }

    pub(crate) fn path(&self, step: u64) -> PathBuf {
        let extension = match self.format {
            Format::Png => "png",
            Format::Svg => "svg",
        };
        self.folder.join(format!("{}_{step:08}.{extension}", self.stem))
    }

    /// Makes the folder, unless a file is there already that must not be.
    pub(crate) fn prepare(&self, steps: &[u64]) -> anyhow::Result<()> {
        if self.existing == Existing::Refuse {
            let taken = steps.iter().map(|step| self.path(*step)).find(|path| path.exists());
            if let Some(path) = taken {
                bail!("{} exists (--overwrite replaces it)", path.display());
            }
        }
        let folder = self.folder;
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot create the folder {}", folder.display()))
    }

    /// Draws the picture into its file, which bears its name only once it is whole.
    pub(crate) fn write(&self, step: u64, picture: &Picture) -> anyhow::Result<PathBuf> {
        let bytes = match self.format {
            Format::Png => png::bytes(picture)?,
            Format::Svg => svg::text(picture).into_bytes(),
        };
        let path = self.path(step);
        let mut file = PartFile::create(&path, self.existing)?;
        file.write_all(&bytes).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(file.finish()?)
    }
}

/// A scene's name as a part of a file name.
fn stem(name: &str) -> String {
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_.".contains(letter);
    let stem: String =
        name.chars().map(|letter| if is_plain(letter) { letter } else { '_' }).collect();
    if stem.trim_matches('.').is_empty() { "scene".to_owned() } else { stem }
}
