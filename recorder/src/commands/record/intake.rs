//! From what arrives in shared memory to what is written: where a recording starts, in which order
//! it goes on, where it ends, and what is missing.

mod started;

use std::mem::take;

use recorder::{AllCounts, Message, RunDescription, TopologyRow};
use sim_contract::{KeyframeHeader, LoadHeader, SnapshotHeader};
use sim_solver::{Scene, SceneError};

use super::accepted::{Accepted, RunHeader};
use super::batch::{Batch, Snapshot};
use super::collider_log::ColliderLog;
use super::queue::Content;
use super::tear_log::TearLog;
use started::Started;

/// Clocks at a batch, in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Now {
    /// Since 1970.
    pub(crate) realtime_ns: u64,
    /// CLOCK_MONOTONIC.
    pub(crate) monotonic_ns: u64,
}

/// Why a run cannot be recorded at all.
#[derive(Debug, thiserror::Error)]
pub(crate) enum IntakeError {
    #[error("the node's scene is not text")]
    NotText,
    #[error("the node's scene cannot be read: {0}")]
    Scene(#[from] SceneError),
}

/// Most outcomes that are kept before the first snapshot; of more, the oldest are forgotten.
const OUTCOMES_KEPT_MAX: usize = 1 << 16;

/// Takes in a run from the first snapshot that is a complete state with its keyframe.
#[derive(Debug, Default)]
pub(crate) struct Intake {
    load: Batch,
    /// The scene of the load, read with all its checks: its name stands nowhere else, and a scene
    /// that cannot be read makes a recording that cannot be verified.
    scene: Option<Scene>,
    /// Steps to record after the first one.
    steps_max: Option<u64>,
    /// The newest snapshot and keyframe, until a pair of one step has come.
    candidate: Option<Snapshot>,
    candidate_keyframe: Option<(KeyframeHeader, Vec<u8>)>,
    /// What tore and where colliders were, until the recording has started.
    tears: TearLog,
    colliders: ColliderLog,
    started: Option<Started>,
    counts: AllCounts,
}

impl Intake {
    /// Takes in a run, up to `steps_max` steps after the first one.
    pub(crate) fn new(steps_max: Option<u64>) -> Self {
        Self { steps_max, ..Self::default() }
    }

    /// Takes in a batch.
    pub(crate) fn accept(&mut self, mut batch: Batch, now: Now) -> Result<Accepted, IntakeError> {
        let mut accepted = Accepted::default();
        self.keep_load(&mut batch)?;
        if self.started.is_none() {
            self.try_start(&mut batch, now, &mut accepted);
        }
        if let Some(started) = &mut self.started {
            started.accept(batch, &mut self.counts, &mut accepted);
        }
        Ok(accepted)
    }

    /// The step that the recording starts with, once it has.
    pub(crate) fn first_step(&self) -> Option<u64> {
        self.started.as_ref().map(|started| started.first_step)
    }

    /// What was received, and what never came.
    pub(crate) fn counts(&self) -> AllCounts {
        let mut counts = self.counts;
        if let Some(started) = &self.started {
            started.add_gaps(&mut counts);
        }
        counts
    }

    fn keep_load(&mut self, batch: &mut Batch) -> Result<(), IntakeError> {
        let load = &mut self.load;
        if let Some((_, text)) = &batch.scene
            && self.started.is_none()
        {
            let text = std::str::from_utf8(text).map_err(|_| IntakeError::NotText)?;
            self.scene = Some(Scene::from_toml(text, "scene.toml")?);
        }
        load.scene = batch.scene.take().or(load.scene.take());
        load.topology = batch.topology.take().or(load.topology.take());
        load.surface = batch.surface.take().or(load.surface.take());
        Ok(())
    }

    /// Starts at the first snapshot of this batch, or the newest before it, that has a keyframe of
    /// its step; what is older is dropped.
    fn try_start(&mut self, batch: &mut Batch, now: Now, accepted: &mut Accepted) {
        self.tears.add(take(&mut batch.tears), take(&mut batch.tear_causes));
        self.colliders.add(take(&mut batch.colliders));
        let snapshots = self.candidate.take().into_iter().chain(batch.snapshots.drain(..));
        let snapshots: Vec<_> = snapshots.collect();
        let keyframes = self.candidate_keyframe.take().into_iter().chain(batch.keyframes.drain(..));
        let keyframes: Vec<_> = keyframes.collect();
        let is_of = |header: &SnapshotHeader, keyframe: &KeyframeHeader| {
            (keyframe.run_id, keyframe.step) == (header.run_id, header.step)
        };
        let start = snapshots
            .iter()
            .position(|one| keyframes.iter().any(|(of, _)| is_of(&one.header, of)))
            .filter(|place| self.has_load_of(&snapshots[*place].header));
        // An outcome may come before the keyframe of the snapshot that it follows.
        batch.outcomes.splice(..0, self.load.outcomes.drain(..));
        let Some(place) = start else {
            self.candidate = snapshots.into_iter().next_back();
            self.candidate_keyframe = keyframes.into_iter().next_back();
            let known = self.candidate.as_ref().map_or(0, |one| one.header.outcome_count);
            self.load.outcomes.extend(batch.outcomes.drain(..).filter(|row| row.index >= known));
            let excess = self.load.outcomes.len().saturating_sub(OUTCOMES_KEPT_MAX);
            self.load.outcomes.drain(..excess);
            return;
        };
        let first = &snapshots[place];
        accepted.header = self.header(&first.header, now);
        let (mut tears, mut colliders) = (take(&mut self.tears), take(&mut self.colliders));
        let torn = tears.begin(&first.header);
        colliders.begin(&first.header);
        self.started = Some(Started::new(&first.header, self.steps_max, tears, colliders));
        for message in self.load_rows(torn) {
            self.counts[message.topic()].received += 1;
            accepted.contents.push(Content::Update(message));
        }
        batch.keyframes = keyframes;
        batch.snapshots = snapshots.into_iter().skip(place).collect();
    }

    fn has_load_of(&self, header: &SnapshotHeader) -> bool {
        let is_of = |load: &LoadHeader| {
            (load.run_id, load.topology_revision) == (header.run_id, header.topology_revision)
        };
        let Batch { scene, topology, surface, .. } = &self.load;
        scene.as_ref().is_some_and(|(load, _)| is_of(load))
            && topology.as_ref().is_some_and(|(load, _)| is_of(load))
            && surface.as_ref().is_some_and(|(load, _)| is_of(load))
            && self.tears.is_known_at(header)
            && self.colliders.is_known_in(header.run_id)
    }

    fn load_rows(&mut self, torn: Vec<u32>) -> Vec<Message> {
        let topology = self.load.topology.take();
        let topology = topology.map(|(_, row)| Message::Topology(TopologyRow { torn, ..row }));
        let surface = self.load.surface.take().map(|(_, row)| Message::Surface(row));
        topology.into_iter().chain(surface).collect()
    }

    fn header(&mut self, header: &SnapshotHeader, now: Now) -> Option<RunHeader> {
        let (load, text) = self.load.scene.take()?;
        let scene = self.scene.take()?;
        let constraint_count = self.load.topology.as_ref().map_or(0, |(load, _)| load.count);
        let mut run = RunDescription {
            run_id: header.run_id,
            epoch_ns: 0,
            scene_name: scene.name,
            origin: load.origin,
            rate_hz: scene.solver.rate_hz,
            method: load.method,
            particle_count: header.particle_count,
            constraint_count,
            solver_version: header.solver_version,
            contract_version: header.contract_version,
            recorder_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        let age_ns = now.monotonic_ns.saturating_sub(header.publish_monotonic_ns);
        let published_ns = now.realtime_ns.saturating_sub(age_ns);
        run.epoch_ns = published_ns.saturating_sub(run.time_of_step_ns(header.step));
        Some(RunHeader { run, scene: text })
    }
}

#[cfg(test)]
mod tests;
