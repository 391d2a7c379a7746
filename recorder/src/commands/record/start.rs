//! The start of a file: the load of the run, and the first state with its keyframe.

use std::sync::Arc;

use recording::{EnergyRow, Message, RunDescription, SceneColliders, SurfaceRow, TopologyRow};
use sim_contract::{
    Change, KeyframeHeader, LoadHeader, LoadedScene, ParticleState, SnapshotHeader, State,
    TearsHeader,
};
use sim_host::clock::{monotonic_ns, realtime_ns};
use sim_solver::{EnergyMeter, Scene, SceneError};

/// The start of a file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RunHeader {
    pub(crate) run: RunDescription,
    /// The scene as TOML.
    pub(crate) scene: Vec<u8>,
    pub(crate) colliders: Arc<SceneColliders>,
    /// The rows of the load.
    pub(crate) rows: Vec<Message>,
}

/// The clocks at the reception of a state, in nanoseconds.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Now {
    /// Since 1970.
    pub(crate) realtime_ns: u64,
    /// CLOCK_MONOTONIC.
    pub(crate) monotonic_ns: u64,
}

impl Now {
    /// Reads both clocks.
    pub(crate) fn read() -> Self {
        Self { realtime_ns: realtime_ns(), monotonic_ns: monotonic_ns() }
    }
}

/// The reason why a run cannot be recorded.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LoadError {
    #[error("the scene of the node is not text")]
    NotText,
    #[error("the scene of the node is invalid: {0}")]
    Scene(#[from] SceneError),
}

/// A load with a valid scene. A recording with an invalid scene could not be verified.
#[derive(Debug)]
pub(crate) struct Load {
    header: LoadHeader,
    scene: Scene,
    text: Vec<u8>,
    colliders: Arc<SceneColliders>,
    topology: TopologyRow,
    surface: SurfaceRow,
    /// Wall clock of step 0, in nanoseconds since 1970.
    epoch_ns: u64,
}

impl Load {
    pub(crate) fn new(loaded: &LoadedScene) -> Result<Self, LoadError> {
        let text = std::str::from_utf8(&loaded.scene).map_err(|_| LoadError::NotText)?;
        let scene = Scene::from_toml(text, "scene.toml")?;
        Ok(Self {
            header: loaded.header,
            colliders: SceneColliders::new(&scene).into(),
            scene,
            text: loaded.scene.clone(),
            topology: TopologyRow::new(&loaded.header, &loaded.constraints, &loaded.bends),
            surface: SurfaceRow::new(&loaded.header, &loaded.triangles),
            epoch_ns: 0,
        })
    }

    /// Sets the wall clock of step 0: that of an earlier file of the run, or the one that follows from the
    /// time of a snapshot.
    pub(crate) fn set_epoch(&mut self, first: &SnapshotHeader, epoch_ns: Option<u64>, now: Now) {
        let age_ns = now.monotonic_ns.saturating_sub(first.publish_monotonic_ns);
        let published_ns = now.realtime_ns.saturating_sub(age_ns);
        let rate_hz = self.scene.solver.rate_hz;
        let since_ns = RunDescription::duration_ns(first.step, rate_hz);
        self.epoch_ns = epoch_ns.unwrap_or(published_ns.saturating_sub(since_ns));
    }

    /// Returns the measurement of the energy of its states.
    pub(crate) fn energy_meter(&self) -> EnergyMeter {
        EnergyMeter::new(&self.scene)
    }

    /// Returns the wall clock of step 0, in nanoseconds since 1970.
    pub(crate) fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// Returns the header of a file that starts at a snapshot. `torn` are the constraints that tore in
    /// earlier steps.
    pub(crate) fn run_header(&self, first: &SnapshotHeader, torn: Vec<u32>) -> RunHeader {
        let run = RunDescription {
            run_id: first.run_id,
            epoch_ns: self.epoch_ns,
            scene_name: self.scene.name.clone(),
            origin: self.header.origin,
            up: self.scene.up,
            rate_hz: self.scene.solver.rate_hz,
            method: self.header.method,
            particle_count: first.particle_count,
            constraint_count: u32::try_from(self.topology.a.len()).unwrap_or(u32::MAX),
            bend_count: u32::try_from(self.topology.bends.shape.len()).unwrap_or(u32::MAX),
            solver_version: first.solver_version,
            contract_version: first.contract_version,
            recorder_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        let topology = TopologyRow { torn, ..self.topology.clone() };
        let rows = vec![Message::Topology(topology), Message::Surface(self.surface.clone())];
        let colliders = Arc::clone(&self.colliders);
        RunHeader { run, scene: self.text.clone(), colliders, rows }
    }
}

/// A copy of a state, with the changes that a recording from this state on begins with.
#[derive(Debug)]
pub(crate) struct FirstState {
    pub(crate) header: SnapshotHeader,
    /// Its energy, if it was asked for.
    pub(crate) energy: Option<EnergyRow>,
    pub(crate) particles: Vec<ParticleState>,
    /// Constraints that tore in earlier steps.
    pub(crate) torn_before: Vec<u32>,
    /// The colliders, the tears of its own step, the parameters, and its keyframe if it has arrived.
    pub(crate) changes: Vec<Change>,
}

impl FirstState {
    /// Copies a state. Returns `None` if a part of it has not arrived, as right after attaching.
    pub(crate) fn new(state: &State<'_>) -> Option<Self> {
        let State { header, torn, colliders, parameters, .. } = *state;
        if !has_all_parts(state) {
            return None;
        }
        let own_count = own_tear_count(header, &torn.header);
        let (before, own) =
            torn.constraints.split_at(torn.constraints.len().saturating_sub(own_count));
        let mut changes = vec![
            Change::Colliders(colliders.header, colliders.colliders.clone()),
            Change::Tears(torn.header, own.to_vec()),
        ];
        // Parameters of the next step follow with its state.
        if parameters.header.step <= header.step {
            changes.push(Change::Parameters(parameters.header, parameters.values.clone()));
        }
        let mut first = Self {
            header: *header,
            energy: None,
            particles: state.particles.to_vec(),
            torn_before: before.iter().map(|torn| torn.constraint).collect(),
            changes,
        };
        for change in state.changes {
            if let Change::Keyframe(keyframe, bytes) = change {
                first.add_keyframe(keyframe, bytes);
            }
        }
        Some(first)
    }

    /// Returns `true` if a state has arrived with all its parts and its keyframe.
    pub(crate) fn is_complete(state: &State<'_>) -> bool {
        has_all_parts(state)
            && state.changes.iter().any(|change| is_keyframe_of(change, state.header))
    }

    /// Returns `true` if the keyframe has arrived.
    pub(crate) fn has_keyframe(&self) -> bool {
        self.changes.iter().any(|change| is_keyframe_of(change, &self.header))
    }

    /// Adds the keyframe of this state, and counts the outcomes since that have not changed it: they are not published
    /// again. Ignores keyframes of other states, and those that have come after outcomes that this recording lacks.
    pub(crate) fn add_keyframe(&mut self, keyframe: &KeyframeHeader, bytes: &[u8]) {
        let change = Change::Keyframe(*keyframe, bytes.to_vec());
        if !is_keyframe_of(&change, &self.header) {
            return;
        }
        self.header.outcome_count = self.header.outcome_count.max(keyframe.outcome_count);
        if !self.has_keyframe() {
            self.changes.push(change);
        }
    }
}

/// Returns `true` if everything that belongs to a state, except its keyframe, has arrived.
fn has_all_parts(state: &State<'_>) -> bool {
    let State { header, torn, colliders, parameters, .. } = *state;
    torn.constraints.len() == header.torn_count as usize
        && torn.header.run_id == header.run_id
        && colliders.header.run_id == header.run_id
        && parameters.header.run_id == header.run_id
}

/// Returns the number of constraints that tore in the step of a snapshot.
fn own_tear_count(snapshot: &SnapshotHeader, tears: &TearsHeader) -> usize {
    if tears.step == snapshot.step { tears.new_count as usize } else { 0 }
}

/// Returns `true` for a keyframe of a snapshot from which a recording has all outcomes.
fn is_keyframe_of(change: &Change, snapshot: &SnapshotHeader) -> bool {
    matches!(change, Change::Keyframe(keyframe, _)
        if (keyframe.run_id, keyframe.step) == (snapshot.run_id, snapshot.step)
            && keyframe.precedes_outcomes())
}
