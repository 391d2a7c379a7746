//! Exports states as pictures.

use std::path::Path;
use std::time::Duration;

use recording::Existing;
use recording::pictures::{ExtentTracker, PictureOptions, Renderer, View};
use serde::Serialize;

use super::data::Written;
use crate::cli::output;
use crate::export::data::written_files::WrittenFiles;
use crate::export::pictures::apng::Animation;
use crate::export::pictures::target::Target;
use crate::export::snapshots::Snapshots;

/// The times of the frames of an animation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    /// Wall-clock time of a frame.
    pub(super) frame_time: Duration,
    /// Simulated time that passes within it. `None` shows each frame for this time, whenever it was recorded.
    pub(super) period: Option<Duration>,
}

impl Pace {
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
    pace: Pace,
    path: &Path,
    existing: Existing,
) -> anyhow::Result<Written> {
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
    Ok(Written::new(snapshots, path, files.paths().len()))
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
