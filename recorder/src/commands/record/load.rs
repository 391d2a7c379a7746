//! The load of a recording.

use std::sync::Arc;

use recording::{Message, RunDescription, SceneColliders, SurfaceRow, TopologyRow};
use sim_contract::clock::{monotonic_ns, realtime_ns};
use sim_contract::{LoadHeader, LoadedScene, SnapshotHeader};
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
