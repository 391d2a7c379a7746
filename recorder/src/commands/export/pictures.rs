//! Exports states as pictures.

use std::io::Write;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, bail};
use recording::Existing;
use recording::pictures::{
    ExtentTracker, Picture, PictureOptions, Renderer, Size, View, rasterize,
};
use serde::Serialize;

use super::data::WrittenExport;
use super::files::{Target, WrittenFiles};
use super::snapshots::Snapshots;
use crate::cli::output;

/// The times of the frames of an animation.
#[derive(Debug, Clone, Copy)]
pub(super) struct FramePace {
    /// Wall-clock time of a frame.
    pub(super) frame_time: Duration,
    /// Simulated time that passes within it. `None` shows each frame for this time, whenever it was recorded.
    pub(super) period: Option<Duration>,
}

impl FramePace {
    /// Returns how long each frame is shown, from the simulated times of the frames in s. Frames that are
    /// missing in the recording leave the one before them standing.
    pub(super) fn delays(self, times_s: &[f64]) -> Vec<Duration> {
        let last = times_s.last().map(|_| self.frame_time);
        let Some(period) = self.period else { return vec![self.frame_time; times_s.len()] };
        let rate = self.frame_time.as_secs_f64() / period.as_secs_f64();
        let between = times_s.windows(2).map(|pair| (pair[1] - pair[0]) * rate);
        between.map(Duration::from_secs_f64).chain(last).collect()
    }
}

/// A written picture, as printed.
#[derive(Debug, Serialize)]
pub(super) struct WrittenPicture {
    pub(super) file: String,
    step: u64,
    /// Simulated time since the first snapshot.
    time_s: f64,
}

/// Draws the snapshots. A picture gets its name when it is complete, and stays if a later one fails.
pub(super) fn draw(
    snapshots: &Snapshots<'_>,
    options: PictureOptions,
    target: &Target<'_>,
) -> anyhow::Result<Vec<WrittenPicture>> {
    target.prepare(snapshots.steps)?;
    let renderer = renderer(snapshots, options)?;
    let mut written = Vec::new();
    snapshots.for_each(|state| {
        let step = state.row.step;
        let time_s = snapshots.time_s(step);
        let file = target.write(step, &renderer.draw(state, time_s))?;
        written.push(WrittenPicture { file: output::path_text(&file), step, time_s });
        Ok(())
    })?;
    Ok(written)
}

/// Draws the snapshots as the frames of one animated PNG file.
pub(super) fn animate(
    snapshots: &Snapshots<'_>,
    options: PictureOptions,
    pace: FramePace,
    path: &Path,
    existing: Existing,
) -> anyhow::Result<WrittenExport> {
    let mut files = WrittenFiles::new(existing);
    files.add_streamed(path, |out| {
        let times_s: Vec<_> = snapshots.steps.iter().map(|step| snapshots.time_s(*step)).collect();
        let mut animation = Animation::begin(out, options.size, &pace.delays(&times_s))?;
        let renderer = renderer(snapshots, options)?;
        snapshots.for_each(|state| {
            animation.add(&renderer.draw(state, snapshots.time_s(state.row.step)))
        })?;
        animation.finish()
    })?;
    Ok(WrittenExport::new(snapshots, path, files.paths().len()))
}

/// Reads the selected states once, so that one camera shows all of them.
pub(super) fn renderer(
    snapshots: &Snapshots<'_>,
    options: PictureOptions,
) -> anyhow::Result<Renderer> {
    let mut tracker = ExtentTracker::default();
    snapshots.for_each(|state| {
        tracker.add(state);
        Ok(())
    })?;
    let view = options.view.or(snapshots.is_2d.then_some(View::Front));
    let options = PictureOptions { view, ..options };
    let name = snapshots.run.scene_name.clone();
    Ok(Renderer::new(options, tracker.extent(), snapshots.up, name))
}

/// Most frames of an animation. A higher number is probably a mistake.
const FRAMES_MAX: usize = 10_000;

/// The unit of the times in the file.
const MILLISECONDS_PER_S: u16 = 1000;

/// Bytes of a pixel: red, green and blue. No pixel of a picture is transparent.
const PIXEL_BYTES: usize = 3;

/// Colors are rounded to multiples of this. Nobody sees it, and it halves the file.
const COLOR_STEP: u8 = 8;

/// An animation that is being written. It repeats forever.
pub(crate) struct Animation<'a> {
    writer: png::Writer<&'a mut dyn Write>,
    size: Size,
    /// Pixels of the frame before; empty before the first one.
    shown: Vec<u8>,
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
        encoder.set_compression(png::Compression::High);
        encoder.set_animated(frame_count, 0)?;
        let delays_ms = whole_milliseconds(delays).into_iter();
        Ok(Self { writer: encoder.write_header()?, size, shown: Vec::new(), delays_ms })
    }

    /// Adds a frame. Only the rectangle that changes is written, which makes most files several times
    /// smaller.
    pub(crate) fn add(&mut self, picture: &Picture) -> anyhow::Result<()> {
        let rgb: Vec<u8> = rasterize(picture)?.into_iter().map(rounded).collect();
        let changed = self.changed(&rgb);
        let delay_ms = self.delays_ms.next().context("more frames than times")?;
        self.writer.set_frame_delay(delay_ms, MILLISECONDS_PER_S)?;
        self.writer.reset_frame_position()?;
        self.writer.set_frame_dimension(changed.width, changed.height)?;
        self.writer.set_frame_position(changed.x, changed.y)?;
        self.writer.write_image_data(&changed.cut_out(&rgb, self.size))?;
        self.shown = rgb;
        Ok(())
    }

    /// Returns the smallest rectangle that contains every pixel that changes: all of them in the first
    /// frame, and one, because a frame has at least one, if nothing changes.
    fn changed(&self, rgb: &[u8]) -> Rectangle {
        let Size { width, height } = self.size;
        if self.shown.is_empty() {
            return Rectangle { x: 0, y: 0, width, height };
        }
        let [mut left, mut top, mut right, mut bottom] = [width - 1, height - 1, 0, 0];
        let pixels = rgb.chunks_exact(PIXEL_BYTES).zip(self.shown.chunks_exact(PIXEL_BYTES));
        for (index, _) in (0_u32..).zip(pixels).filter(|(_, (new, old))| new != old) {
            let (x, y) = (index % width, index / width);
            (left, right) = (left.min(x), right.max(x));
            (top, bottom) = (top.min(y), bottom.max(y));
        }
        if left > right {
            return Rectangle { x: 0, y: 0, width: 1, height: 1 };
        }
        Rectangle { x: left, y: top, width: right - left + 1, height: bottom - top + 1 }
    }

    pub(crate) fn finish(self) -> anyhow::Result<()> {
        Ok(self.writer.finish()?)
    }
}

fn rounded(color: u8) -> u8 {
    (color.saturating_add(COLOR_STEP / 2) / COLOR_STEP).saturating_mul(COLOR_STEP)
}

/// A part of a picture, in pixels. x points right, y down.
struct Rectangle {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

impl Rectangle {
    /// Returns the pixels of this part of a picture.
    fn cut_out(&self, rgb: &[u8], size: Size) -> Vec<u8> {
        let row_bytes = size.width as usize * PIXEL_BYTES;
        let (start, length) = (self.x as usize * PIXEL_BYTES, self.width as usize * PIXEL_BYTES);
        let rows = rgb.chunks_exact(row_bytes).skip(self.y as usize).take(self.height as usize);
        rows.flat_map(|row| &row[start..start + length]).copied().collect()
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
