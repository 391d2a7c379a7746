//! The files of the pictures, named after the scene and the step.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use recorder::{Existing, PartFile};

use super::shape::Picture;
use super::{png, svg};

/// The folder and the format of the pictures.
#[derive(Debug)]
pub(crate) struct Target<'a> {
    folder: &'a Path,
    format: Format,
    existing: Existing,
    /// The name of the scene, reduced to characters that are safe in a file name.
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

    /// Creates the folder. Fails if one of the files may not be created.
    pub(crate) fn prepare(&self, steps: &[u64]) -> anyhow::Result<()> {
        let folder = self.folder;
        if folder.exists() && !folder.is_dir() {
            bail!("{} is not a folder; name a folder for the pictures", folder.display());
        }
        steps.iter().try_for_each(|step| self.existing.check(&self.path(*step)))?;
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot create the folder {}", folder.display()))
    }

    /// Writes the picture of a step. The file gets its name only when it is complete.
    pub(crate) fn write(&self, step: u64, picture: &Picture) -> anyhow::Result<PathBuf> {
        let bytes = match self.format {
            Format::Png => png::encode(picture)?,
            Format::Svg => svg::encode(picture).into_bytes(),
        };
        let path = self.path(step);
        PartFile::write_whole(&path, self.existing, &bytes)?;
        Ok(path)
    }
}

/// Returns the name of a scene with every character that is not safe in a file name replaced.
fn stem(name: &str) -> String {
    let is_safe = |letter: char| letter.is_alphanumeric() || "-_.".contains(letter);
    let stem: String =
        name.chars().map(|letter| if is_safe(letter) { letter } else { '_' }).collect();
    if stem.trim_matches('.').is_empty() { "scene".to_owned() } else { stem }
}
