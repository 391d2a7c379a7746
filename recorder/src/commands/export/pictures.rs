//! Exports states as pictures.

use std::path::Path;

use recorder::Existing;
use serde::Serialize;

use super::data::Written;
use crate::cli::output;
use crate::export::data::written_files::WrittenFiles;
use crate::export::pictures::apng::Animation;
use crate::export::pictures::camera::{Basis, Camera, View};
use crate::export::pictures::extent::ExtentTracker;
use crate::export::pictures::mesh::Bend;
use crate::export::pictures::renderer::Renderer;
use crate::export::pictures::shape::Size;
use crate::export::pictures::target::Target;
use crate::export::snapshots::Snapshots;

/// The options that control the appearance of the pictures.
#[derive(Debug, Clone, Copy)]
pub(super) struct Style {
    pub(super) size: Size,
    pub(super) view: Option<View>,
    pub(super) bend: Bend,
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
    style: Style,
    target: &Target<'_>,
) -> anyhow::Result<Vec<WrittenPicture>> {
    target.prepare(snapshots.steps)?;
    let renderer = renderer(snapshots, style)?;
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
    style: Style,
    frames_per_s: u16,
    path: &Path,
    existing: Existing,
) -> anyhow::Result<Written> {
    let mut files = WrittenFiles::new(existing);
    files.add_streamed(path, |out| {
        let count = snapshots.steps.len();
        let mut animation = Animation::begin(out, style.size, count, frames_per_s)?;
        let renderer = renderer(snapshots, style)?;
        snapshots.for_each(|state| {
            animation.add(&renderer.draw(state, snapshots.time_s(state.row.step)))
        })?;
        animation.finish()
    })?;
    Ok(Written::new(snapshots, path, files.paths().len()))
}

/// Reads the selected states once, so that one camera shows all of them.
pub(super) fn renderer(snapshots: &Snapshots<'_>, style: Style) -> anyhow::Result<Renderer> {
    let mut tracker = ExtentTracker::default();
    snapshots.for_each(|state| {
        tracker.add(state);
        Ok(())
    })?;
    let extent = tracker.extent();
    let up = snapshots.up;
    let default_view = || if snapshots.is_2d { View::Front } else { View::best_for(&extent, up) };
    let view = style.view.unwrap_or_else(default_view);
    Ok(Renderer {
        camera: Camera::fit(Basis::new(view, up), &extent, style.size),
        extent,
        size: style.size,
        bend: style.bend,
        scene_name: snapshots.run.scene_name.clone(),
    })
}
