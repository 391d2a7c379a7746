//! A recording for Foxglove viewers: a copy with `/scene`, the drawing that the viewer's server sends.

use std::io::Write;

use recording::{
    AllCounts, DrawnMesh, GapCounter, LogReader, SCENE_TOPIC, SceneDrawing, SceneState,
    scene_format,
};
use sim_contract::TornConstraint;

use super::recording_copy::RecordingCopy;
use crate::export::snapshots::Snapshots;

/// Copies the whole recording, with a drawing after each selected snapshot.
pub(crate) fn write(snapshots: &Snapshots<'_>, out: &mut dyn Write) -> anyhow::Result<()> {
    let mut source = (snapshots.open_bytes)()?;
    let mut copy = RecordingCopy::begin(&mut source, out)?;
    let mut drawing: Option<(u16, SceneDrawing)> = None;
    snapshots.for_each(|state| {
        copy.copy_through(state.row.step)?;
        let (channel, drawing) = match &mut drawing {
            Some(drawing) => drawing,
            unset => {
                // Only now, because numbers of channels are those of the source.
                let channel = copy.add_channel(SCENE_TOPIC, &scene_format())?;
                unset.insert((channel, SceneDrawing::new(mesh(state))))
            }
        };
        drawing.set_colliders(&state.collider_states());
        drawing.set_torn(&torn(state));
        let time_ns = snapshots.run.time_of_step_ns(state.row.step);
        copy.insert(*channel, &drawing.encode(time_ns, &state.particles))
    })?;
    copy.finish(|| count_gaps(snapshots))
}

/// Counts the messages that are missing in the recording, as their numbers show.
fn count_gaps(snapshots: &Snapshots<'_>) -> anyhow::Result<AllCounts> {
    let mut log = LogReader::new((snapshots.open_bytes)()?)?;
    let mut gaps = GapCounter::for_selection(log.selection());
    while let Some(logged) = log.next_message()? {
        gaps.add(&logged.message);
    }
    Ok(gaps.counts())
}

fn mesh(state: &SceneState) -> DrawnMesh {
    let constraints = &state.constraints;
    DrawnMesh {
        ends: constraints.iter().map(|one| [one.a, one.b]).collect(),
        triangles: state.triangles.iter().map(|one| one.corners).collect(),
        collider_meshes: state.collider_meshes.as_deref().cloned().unwrap_or_default(),
        bounds: bounds(state),
    }
}

/// Returns the least and the greatest coordinates.
fn bounds(state: &SceneState) -> [[f32; 3]; 2] {
    let points = state.particles.iter().map(|one| glam::Vec3::from_array(one.position));
    let boxes = points.filter(|point| point.is_finite()).map(|point| [point, point]);
    let around = boxes.reduce(|[min, max], [low, high]| [min.min(low), max.max(high)]);
    around.unwrap_or_default().map(|corner| corner.to_array())
}

fn torn(state: &SceneState) -> Vec<TornConstraint> {
    state.torn_constraints().map(|index| TornConstraint::new(index, None)).collect()
}
