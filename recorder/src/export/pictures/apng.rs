//! Encodes pictures as an animated PNG.

use std::io::Write;

use anyhow::{Context, bail};

use super::png::rasterize;
use super::shape::{Picture, Size};

/// Most frames of an animation. A higher number is probably a mistake.
const FRAMES_MAX: usize = 10_000;

/// An animation that is being written. It repeats forever.
pub(crate) struct Animation<'a> {
    writer: png::Writer<&'a mut dyn Write>,
    /// The colors of a picture, which has no transparent pixel.
    rgb: Vec<u8>,
}

impl<'a> Animation<'a> {
    /// Begins an animation with this number of frames.
    pub(crate) fn begin(
        out: &'a mut dyn Write,
        size: Size,
        frame_count: usize,
        frames_per_s: u16,
    ) -> anyhow::Result<Self> {
        if frame_count > FRAMES_MAX {
            bail!(
                "the options select {frame_count} snapshots, one frame each (allowed: up to \
                 {FRAMES_MAX}). Select fewer, such as with --to or --every"
            );
        }
        let frame_count = u32::try_from(frame_count).context("too many frames")?;
        let mut encoder = png::Encoder::new(out, size.width, size.height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_animated(frame_count, 0)?;
        encoder.set_frame_delay(1, frames_per_s)?;
        Ok(Self { writer: encoder.write_header()?, rgb: Vec::new() })
    }

    /// Adds a frame.
    pub(crate) fn add(&mut self, picture: &Picture) -> anyhow::Result<()> {
        self.rgb.clear();
        for pixel in rasterize(picture)?.pixels() {
            self.rgb.extend_from_slice(&[pixel.red(), pixel.green(), pixel.blue()]);
        }
        Ok(self.writer.write_image_data(&self.rgb)?)
    }

    pub(crate) fn finish(self) -> anyhow::Result<()> {
        Ok(self.writer.finish()?)
    }
}
