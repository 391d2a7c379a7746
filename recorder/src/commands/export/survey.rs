//! The properties of a recording that an export needs before it begins.

use std::collections::BTreeSet;
use std::io::Read;

use anyhow::{Context, bail};
use recording::{
    FrameReader, LogEnd, LogReader, Message, RunDescription, ShapeRow, StepRow, recorded_scene,
};
use sim_solver::Scene;
use sim_solver::scene::Up;

use super::snapshots::{OpenBytes, Snapshots, VisitStates};

/// Most snapshots of a recording to export: 19 hours at 240 Hz. Their steps take 128 MiB of memory.
const SNAPSHOTS_MAX: usize = 1 << 24;
/// Snapshots between two updates of the progress bar.
const SNAPSHOTS_PER_UPDATE: usize = 64;

/// The properties of a recording.
#[derive(Debug)]
pub(super) struct Survey {
    pub(super) run: RunDescription,
    /// The scene, which gives the up axis, or the reason why there is none.
    pub(super) scene: Result<Scene, String>,
    /// Steps of all snapshots, ascending.
    pub(super) steps: Vec<u64>,
    /// Steps at which a command put a state in place.
    replaced_at: BTreeSet<u64>,
    /// A collider is a mesh, whose triangles are in the scene.
    has_mesh: bool,
    /// Number of particles of the first snapshot.
    pub(super) particle_count: usize,
    pub(super) end: LogEnd,
    /// Number of bytes of the file that are readable.
    pub(super) intact_count: u64,
}

impl Survey {
    /// Reads the whole recording for its steps and its end. Calls `on_progress` periodically, with the
    /// number of bytes that are read.
    pub(super) fn read<R: Read>(
        log: LogReader<R>,
        path: &str,
        mut on_progress: impl FnMut(u64),
    ) -> anyhow::Result<Self> {
        let scene = recorded_scene(&log).map_err(|error| format!("{path}: {error:#}"));
        let run = log.run().clone();
        let mut frames = FrameReader::new(log);
        let (mut steps, mut particle_count, mut has_mesh) = (Vec::new(), 0, false);
        let (mut replaced_at, mut previous) = (BTreeSet::new(), None);
        while let Some(frame) = frames.next_frame().with_context(|| path.to_owned())? {
            if steps.len() == SNAPSHOTS_MAX {
                bail!("{path}: has more than {SNAPSHOTS_MAX} snapshots");
            }
            if steps.is_empty() {
                particle_count = frame.payload().len();
            }
            steps.push(frame.row.step);
            replaced_at.extend(frame.updates.iter().filter_map(replaced_step));
            // A recording without outcomes shows it by the steps of its scene.
            let StepRow { step, scene_step, .. } = frame.row;
            let offset = step.checked_sub(scene_step);
            if previous.replace(offset).is_some_and(|previous| previous != offset) {
                replaced_at.insert(step);
            }
            has_mesh |= frame.updates.iter().any(has_mesh_collider);
            if steps.len().is_multiple_of(SNAPSHOTS_PER_UPDATE) {
                on_progress(frames.log().intact_count());
            }
        }
        let end = frames.end().cloned().unwrap_or(LogEnd::Complete);
        let intact_count = frames.log().intact_count();
        let survey =
            Self { run, scene, steps, replaced_at, has_mesh, particle_count, end, intact_count };
        Ok(survey)
    }

    /// Returns a warning of what an export lacks without a readable scene.
    pub(super) fn warning(&self) -> Option<String> {
        let reason = self.scene.as_ref().err()?;
        let meshes = if self.has_mesh { ", and without the colliders that are meshes" } else { "" };
        Some(format!("warning: {reason}; exported with y up{meshes}"))
    }

    /// Returns the snapshots of `steps`, which `visit` visits, of a file that `open_bytes` opens. Without a
    /// scene, y is up.
    pub(super) fn snapshots<'a>(
        &'a self,
        steps: &'a [u64],
        visit: &'a VisitStates<'a>,
        open_bytes: &'a OpenBytes<'a>,
    ) -> Snapshots<'a> {
        let scene = self.scene.as_ref().ok();
        Snapshots {
            run: &self.run,
            scene,
            up: scene.map_or(Up::Y, |scene| scene.up),
            is_2d: scene.is_some_and(|scene| scene.dimensions == 2),
            first_step: self.steps.first().copied().unwrap_or_default(),
            steps,
            replaced_at: &self.replaced_at,
            particle_count: self.particle_count,
            frames_per_s: None,
            visit,
            open_bytes,
        }
    }
}

/// Returns the step of a state that a command put in place.
fn replaced_step(message: &Message) -> Option<u64> {
    let Message::Outcome(row) = message else { return None };
    let is_replaced = row.replaces_state() || row.puts_state_in_place();
    (is_replaced && row.is_applied()).then_some(row.step)
}

fn has_mesh_collider(message: &Message) -> bool {
    let Message::Colliders(row) = message else { return false };
    row.colliders.iter().any(|one| matches!(one.shape, ShapeRow::Mesh { .. }))
}
