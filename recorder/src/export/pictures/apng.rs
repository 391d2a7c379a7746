//! Encodes pictures as an animated PNG.

use std::io::Write;
use std::time::Duration;

use anyhow::{Context, bail};

use super::png::rasterize;
use super::shape::{Picture, Size};

/// Most frames of an animation. A higher number is probably a mistake.
const FRAMES_MAX: usize = 10_000;

/// The unit of the times in the file.
const MILLISECONDS_PER_S: u16 = 1000;

/// An animation that is being written. It repeats forever.
pub(crate) struct Animation<'a> {
    writer: png::Writer<&'a mut dyn Write>,
    /// The colors of a picture, which has no transparent pixel.
    rgb: Vec<u8>,
    /// Times of the next frames, in milliseconds.
    delays_ms: std::vec::IntoIter<u16>,
}

impl<'a> Animation<'a> {
    /// Begins an animation whose frames are shown for these times.
    pub(crate) fn begin(
        out: &'a mut dyn Write,
        size: Size,
        delays: &[Duration],
    ) -> anyhow::Result<Self> {
        let frame_count = delays.len();
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
        let delays_ms = whole_milliseconds(delays).into_iter();
        Ok(Self { writer: encoder.write_header()?, rgb: Vec::new(), delays_ms })
    }

    /// Adds a frame.
    pub(crate) fn add(&mut self, picture: &Picture) -> anyhow::Result<()> {
        self.rgb.clear();
        for pixel in rasterize(picture)?.pixels() {
            self.rgb.extend_from_slice(&[pixel.red(), pixel.green(), pixel.blue()]);
        }
        let delay_ms = self.delays_ms.next().context("more frames than times")?;
        self.writer.set_frame_delay(delay_ms, MILLISECONDS_PER_S)?;
        Ok(self.writer.write_image_data(&self.rgb)?)
    }

    pub(crate) fn finish(self) -> anyhow::Result<()> {
        Ok(self.writer.finish()?)
    }
}

/// Rounds the ends of the frames to milliseconds, so that the errors do not add up. A frame is shown for at
/// most 65 s, which the format can state.
fn whole_milliseconds(delays: &[Duration]) -> Vec<u16> {
    let (mut end, mut end_ms) = (Duration::ZERO, 0);
    let delay_ms = |delay: &Duration| {
        end += *delay;
        let before_ms = std::mem::replace(&mut end_ms, (end.as_nanos() + 500_000) / 1_000_000);
        u16::try_from(end_ms - before_ms).unwrap_or(u16::MAX)
    };
    delays.iter().map(delay_ms).collect()
}
