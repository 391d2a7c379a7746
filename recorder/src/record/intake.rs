//! From what arrives in shared memory to what is written: where a recording starts, in which order
//! it goes on, where it ends, and what is missing.

mod started;

use std::mem::take;

use recorder::{AllCounts, Message, RunDescription, TopologyRow};
use sim_contract::{KeyframeHeader, LoadHeader, SnapshotHeader};
use sim_solver::{Scene, SceneError};

use super::collider_log::ColliderLog;
use super::queue::Content;
use super::round::{Round, Snapshot};
use super::tear_log::TearLog;
use started::Started;

/// The head of a recording.
#[derive(Debug)]
pub(crate) struct Head {
    pub(crate) run: RunDescription,
    pub(crate) scene: Vec<u8>,
}

/// Clocks at a round, in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Now {
    /// Since 1970.
    pub(crate) realtime_ns: u64,
    /// CLOCK_MONOTONIC.
    pub(crate) monotonic_ns: u64,
}

/// Why a run that goes on cannot be recorded any further in this file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RunEnd {
    /// The owner has begun another run.
    NewRun,
    /// Another scene was loaded.
    NewLoad,
    /// The last step that is wanted is behind it.
    EndStep,
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
    load: Round,
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

/// What came of a round.
#[derive(Debug, Default)]
pub(crate) struct Taken {
    /// The head, in the round in which the recording starts.
    pub(crate) head: Option<Head>,
    /// In the order of publication.
    pub(crate) contents: Vec<Content>,
    pub(crate) end: Option<RunEnd>,
}

impl Intake {
    /// Takes in a run, up to `steps_max` steps after the first one.
    pub(crate) fn new(steps_max: Option<u64>) -> Self {
        Self { steps_max, ..Self::default() }
    }

    /// Takes in a round.
    pub(crate) fn take(&mut self, mut round: Round, now: Now) -> Result<Taken, IntakeError> {
        let mut taken = Taken::default();
        self.keep_load(&mut round)?;
        if self.started.is_none() {
            self.try_start(&mut round, now, &mut taken);
        }
        if let Some(started) = &mut self.started {
            started.take(round, &mut self.counts, &mut taken);
        }
        Ok(taken)
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

    fn keep_load(&mut self, round: &mut Round) -> Result<(), IntakeError> {
        let load = &mut self.load;
        if let Some((_, text)) = &round.scene
            && self.started.is_none()
        {
            let text = std::str::from_utf8(text).map_err(|_| IntakeError::NotText)?;
            self.scene = Some(Scene::from_toml(text, "scene.toml")?);
        }
        load.scene = round.scene.take().or(load.scene.take());
        load.topology = round.topology.take().or(load.topology.take());
        load.surface = round.surface.take().or(load.surface.take());
        Ok(())
    }

    /// Starts at the first snapshot of this round, or the newest before it, that has a keyframe of
    /// its step; what is older is dropped.
    fn try_start(&mut self, round: &mut Round, now: Now, taken: &mut Taken) {
        self.tears.add(take(&mut round.tears), take(&mut round.tear_causes));
        self.colliders.add(take(&mut round.colliders));
        let snapshots = self.candidate.take().into_iter().chain(round.snapshots.drain(..));
        let snapshots: Vec<_> = snapshots.collect();
        let keyframes = self.candidate_keyframe.take().into_iter().chain(round.keyframes.drain(..));
        let keyframes: Vec<_> = keyframes.collect();
        let is_of = |header: &SnapshotHeader, keyframe: &KeyframeHeader| {
            (keyframe.run_id, keyframe.step) == (header.run_id, header.step)
        };
        let start = snapshots
            .iter()
            .position(|one| keyframes.iter().any(|(of, _)| is_of(&one.header, of)))
            .filter(|place| self.has_load_of(&snapshots[*place].header));
        // An outcome may come before the keyframe of the snapshot that it follows.
        round.outcomes.splice(..0, self.load.outcomes.drain(..));
        let Some(place) = start else {
            self.candidate = snapshots.into_iter().next_back();
            self.candidate_keyframe = keyframes.into_iter().next_back();
            let known = self.candidate.as_ref().map_or(0, |one| one.header.outcome_count);
            self.load.outcomes.extend(round.outcomes.drain(..).filter(|row| row.index >= known));
            let excess = self.load.outcomes.len().saturating_sub(OUTCOMES_KEPT_MAX);
            self.load.outcomes.drain(..excess);
            return;
        };
        let first = &snapshots[place];
        taken.head = self.head(&first.header, now);
        let (mut tears, mut colliders) = (take(&mut self.tears), take(&mut self.colliders));
        let torn = tears.begin(&first.header);
        colliders.begin(&first.header);
        self.started = Some(Started::new(&first.header, self.steps_max, tears, colliders));
        for message in self.load_rows(torn) {
            self.counts.of_mut(message.topic()).received += 1;
            taken.contents.push(Content::Update(message));
        }
        round.keyframes = keyframes;
        round.snapshots = snapshots.into_iter().skip(place).collect();
    }

    fn has_load_of(&self, header: &SnapshotHeader) -> bool {
        let is_of = |load: &LoadHeader| {
            (load.run_id, load.topology_revision) == (header.run_id, header.topology_revision)
        };
        let Round { scene, topology, surface, .. } = &self.load;
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

    fn head(&mut self, header: &SnapshotHeader, now: Now) -> Option<Head> {
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
        Some(Head { run, scene: text })
    }
}

#[cfg(test)]
mod tests;
