//! Wavefront OBJ: the particles as vertices in their order, and the triangles, or else the constraints.

use std::fmt::Write;
use std::path::Path;

use super::written_files::WrittenFiles;
use crate::export::frame_names::FrameNames;
use crate::export::snapshots::Snapshots;
use recorder::SceneState;

/// Writes a file per snapshot into `folder`.
pub(crate) fn write(
    snapshots: &Snapshots<'_>,
    folder: &Path,
    files: &mut WrittenFiles,
) -> anyhow::Result<()> {
    let names = FrameNames::new(folder, &snapshots.run.scene_name, "obj");
    names.prepare(snapshots.steps, files.existing())?;
    names.remove_older(files.existing())?;
    snapshots
        .for_each(|state| files.add_whole(&names.path(state.row.step), mesh(state)?.as_bytes()))
}

/// Returns the file of a state. A scene without triangles has a line for each untorn constraint. Indices
/// count from 1.
pub(super) fn mesh(state: &SceneState) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    writeln!(text, "# step {}", state.row.step)?;
    for particle in &state.particles {
        let [x, y, z] = particle.position;
        writeln!(text, "v {x:?} {y:?} {z:?}")?;
    }
    for (_, [a, b, c]) in state.intact_triangles() {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1)?;
    }
    if state.triangles.is_empty() {
        for constraint in state.untorn_constraints() {
            writeln!(text, "l {} {}", constraint.a + 1, constraint.b + 1)?;
        }
    }
    Ok(text)
}
