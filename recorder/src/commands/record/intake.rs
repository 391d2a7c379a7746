//! Selects and orders the messages of a recording: its start, its end, and the missing messages.

mod started;

use std::mem::take;

use recorder::{AllCounts, Message, RunDescription, TopologyRow};
use sim_contract::{KeyframeHeader, LoadHeader, SnapshotHeader};
use sim_solver::{Scene, SceneError};

use super::accepted::{Accepted, RunHeader};
use super::batch::{Batch, Snapshot};
use super::lists::Lists;
use super::queue::Content;
use started::Started;

/// The clocks at the reception of a batch, in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Now {
    /// Since 1970.
    pub(crate) realtime_ns: u64,
    /// CLOCK_MONOTONIC.
    pub(crate) monotonic_ns: u64,
}

/// The reason why a run cannot be recorded.
#[derive(Debug, thiserror::Error)]
pub(crate) enum IntakeError {
    #[error("the scene of the node is not text")]
    NotText,
    #[error("the scene of the node is invalid: {0}")]
    Scene(#[from] SceneError),
}

/// Most outcomes to keep before the first snapshot. Beyond it the oldest are dropped.
const OUTCOMES_PENDING_MAX: usize = 1 << 16;

/// Accepts a run from the first snapshot that has its keyframe.
#[derive(Debug, Default)]
pub(crate) struct Intake {
    load: Batch,
    /// The validated scene of the load. A recording with an invalid scene could not be verified.
    scene: Option<Scene>,
    /// Steps to record after the first one.
    steps_max: Option<u64>,
    /// The newest snapshot and keyframe, until both have the same step.
    candidate: Option<Snapshot>,
    candidate_keyframe: Option<(KeyframeHeader, Vec<u8>)>,
    /// The lists, until the recording has started.
    lists: Lists,
    started: Option<Started>,
    counts: AllCounts,
}

impl Intake {
    /// Accepts up to `steps_max` steps after the first one.
    pub(crate) fn new(steps_max: Option<u64>) -> Self {
        Self { steps_max, ..Self::default() }
    }

    /// Returns the part of a batch that goes into the recording.
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

    /// Returns the first recorded step, once the recording has started.
    pub(crate) fn first_step(&self) -> Option<u64> {
        self.started.as_ref().map(|started| started.first_step)
    }

    /// Returns the numbers of received and missing messages.
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

    /// Starts at the first snapshot of this batch, or at the candidate before it, that has a keyframe
    /// of its step. Drops older messages.
    fn try_start(&mut self, batch: &mut Batch, now: Now, accepted: &mut Accepted) {
        self.lists.add(batch);
        let snapshots = self.candidate.take().into_iter().chain(batch.snapshots.drain(..));
        let snapshots: Vec<_> = snapshots.collect();
        let keyframes = self.candidate_keyframe.take().into_iter().chain(batch.keyframes.drain(..));
        let keyframes: Vec<_> = keyframes.collect();
        let completes = |header: &SnapshotHeader, keyframe: &KeyframeHeader| {
            (keyframe.run_id, keyframe.step) == (header.run_id, header.step)
        };
        let start = snapshots
            .iter()
            .position(|one| keyframes.iter().any(|(keyframe, _)| completes(&one.header, keyframe)))
            .filter(|place| self.is_load_complete(&snapshots[*place].header));
        // An outcome may arrive before the keyframe of the snapshot that precedes it.
        batch.outcomes.splice(..0, self.load.outcomes.drain(..));
        let Some(place) = start else {
            self.candidate = snapshots.into_iter().next_back();
            self.candidate_keyframe = keyframes.into_iter().next_back();
            let known = self.candidate.as_ref().map_or(0, |one| one.header.outcome_count);
            self.load.outcomes.extend(batch.outcomes.drain(..).filter(|row| row.index >= known));
            let excess = self.load.outcomes.len().saturating_sub(OUTCOMES_PENDING_MAX);
            self.load.outcomes.drain(..excess);
            return;
        };
        let first = &snapshots[place];
        accepted.header = self.header(&first.header, now);
        let mut lists = take(&mut self.lists);
        let torn = lists.begin(&first.header);
        self.started = Some(Started::new(&first.header, self.steps_max, lists));
        for message in self.load_rows(torn) {
            self.counts[message.topic()].received += 1;
            accepted.contents.push(Content::Update(message));
        }
        batch.keyframes = keyframes;
        batch.snapshots = snapshots.into_iter().skip(place).collect();
    }

    fn is_load_complete(&self, header: &SnapshotHeader) -> bool {
        let is_current = |load: &LoadHeader| {
            (load.run_id, load.topology_revision) == (header.run_id, header.topology_revision)
        };
        let Batch { scene, topology, surface, .. } = &self.load;
        scene.as_ref().is_some_and(|(load, _)| is_current(load))
            && topology.as_ref().is_some_and(|(load, _)| is_current(load))
            && surface.as_ref().is_some_and(|(load, _)| is_current(load))
            && self.lists.are_known_at(header)
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
