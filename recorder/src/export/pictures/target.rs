//! The files of the pictures.

use std::path::{Path, PathBuf};

use recording::pictures::{Picture, encode_png, encode_svg};
use recording::{Existing, PartFile};

use crate::export::frame_names::FrameNames;

/// The folder and the format of the pictures.
#[derive(Debug)]
pub(crate) struct Target<'a> {
    names: FrameNames<'a>,
    format: PictureFormat,
    existing: Existing,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PictureFormat {
    Png,
    Svg,
}

impl<'a> Target<'a> {
    pub(crate) fn new(
        folder: &'a Path,
        format: PictureFormat,
        existing: Existing,
        scene_name: &str,
    ) -> Self {
        let extension = match format {
            PictureFormat::Png => "png",
            PictureFormat::Svg => "svg",
        };
        Self { names: FrameNames::new(folder, scene_name, extension), format, existing }
    }

    /// Creates the folder, or empties it of older pictures. Fails if one of the files may not be created.
    pub(crate) fn prepare(&self, steps: &[u64]) -> anyhow::Result<()> {
        self.names.prepare(steps, self.existing)?;
        self.names.remove_older(self.existing)
    }

    /// Writes the picture of a step. The file gets its name only when it is complete.
    pub(crate) fn write(&self, step: u64, picture: &Picture) -> anyhow::Result<PathBuf> {
        let bytes = match self.format {
            PictureFormat::Png => encode_png(picture)?,
            PictureFormat::Svg => encode_svg(picture).into_bytes(),
        };
        let path = self.names.path(step);
        PartFile::write_whole(&path, self.existing, &bytes)?;
        Ok(path)
    }
}
