//! Exports states as numbers and meshes.

use std::fmt;
use std::path::Path;

use recording::{Existing, counted};
use serde::Serialize;

use super::files::WrittenFiles;
use super::snapshots::Snapshots;
use super::{foxglove, npz, obj, ros2, tables, usda, vtk};
use crate::cli::output;

/// A format of numbers or meshes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DataFormat {
    Npz,
    Csv,
    Energy,
    Vtk,
    Obj,
    Pc2,
    Usda,
    Foxglove,
    Ros2,
}

impl DataFormat {
    /// Returns `true` if a frame rate can select moments between the snapshots.
    pub(super) fn has_frames(self) -> bool {
        matches!(self, Self::Vtk | Self::Obj | Self::Pc2 | Self::Usda)
    }

    /// Returns the extensions of the file; none for a folder.
    pub(super) fn extensions(self) -> &'static [&'static str] {
        match self {
            Self::Npz => &["npz"],
            Self::Csv | Self::Energy => &["csv"],
            Self::Pc2 => &["pc2"],
            Self::Usda => &["usda", "usd"],
            Self::Foxglove => &["mcap"],
            Self::Vtk | Self::Obj | Self::Ros2 => &[],
        }
    }
}

/// The result, as printed.
#[derive(Debug, Serialize)]
pub(super) struct WrittenExport {
    /// The file or the folder.
    target: String,
    file_count: usize,
    snapshot_count: usize,
    first_step: u64,
    last_step: u64,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    frames: Option<Resampling>,
}

/// The frames of a frame rate.
#[derive(Debug, Serialize)]
struct Resampling {
    frames_per_s: u16,
    frame_count: usize,
    /// Frames that are interpolated between two snapshots.
    interpolated_count: usize,
}

/// Writes the files of a format. After an error, none of them is left.
pub(super) fn write(
    snapshots: &Snapshots<'_>,
    format: DataFormat,
    target: &Path,
    existing: Existing,
) -> anyhow::Result<WrittenExport> {
    let mut files = WrittenFiles::new(existing);
    match write_files(snapshots, format, target, &mut files) {
        Ok(()) => Ok(WrittenExport::new(snapshots, target, files.paths().len())),
        Err(error) => {
            files.remove();
            Err(error)
        }
    }
}

fn write_files(
    snapshots: &Snapshots<'_>,
    format: DataFormat,
    target: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    match format {
        DataFormat::Npz => files.add_streamed(target, |out| npz::write(snapshots, out)),
        DataFormat::Csv => {
            files.add_streamed(target, |out| tables::write_particles(snapshots, out))
        }
        DataFormat::Energy => {
            files.add_streamed(target, |out| tables::write_energy(snapshots, out))
        }
        DataFormat::Vtk => vtk::write(snapshots, target, files),
        DataFormat::Obj => obj::write(snapshots, target, files),
        DataFormat::Pc2 => obj::write_cache(snapshots, target, files),
        DataFormat::Usda => files.add_streamed(target, |out| usda::write(snapshots, out)),
        DataFormat::Foxglove => files.add_streamed(target, |out| foxglove::write(snapshots, out)),
        DataFormat::Ros2 => ros2::write(snapshots, target, files),
    }
}

impl WrittenExport {
    pub(super) fn new(snapshots: &Snapshots<'_>, target: &Path, file_count: usize) -> Self {
        Self {
            target: output::path_text(target),
            file_count,
            snapshot_count: snapshots.steps.len(),
            first_step: snapshots.steps.first().copied().unwrap_or_default(),
            last_step: snapshots.steps.last().copied().unwrap_or_default(),
            frames: snapshots.frames_per_s.map(|frames_per_s| Resampling {
                frames_per_s,
                frame_count: snapshots.frame_numbers().len(),
                interpolated_count: snapshots.interpolated_count(),
            }),
        }
    }
}

impl fmt::Display for WrittenExport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { target, snapshot_count, first_step, last_step, frames, .. } = self;
        let Some(Resampling { frames_per_s, frame_count, interpolated_count }) = frames else {
            let snapshots = counted(*snapshot_count as u64, "snapshot");
            return write!(f, "{target}: {snapshots} (steps {first_step}..={last_step})");
        };
        let frames = counted(*frame_count as u64, "frame");
        let source = match interpolated_count {
            0 => "each shows a snapshot".to_owned(),
            count => format!("{count} interpolated between snapshots"),
        };
        write!(
            f,
            "{target}: {frames} at {frames_per_s} per second (steps {first_step}..={last_step}), {source}"
        )
    }
}
