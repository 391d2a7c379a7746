//! The load of a recording.

use recorder::{Message, RunDescription, SurfaceRow, TopologyRow};
use sim_contract::clock::{monotonic_ns, realtime_ns};
use sim_contract::{LoadHeader, LoadedScene, SnapshotHeader};
use sim_solver::{Scene, SceneError};

use super::accepted::RunHeader;

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
    topology: TopologyRow,
    surface: SurfaceRow,
}

impl Load {
    pub(crate) fn new(loaded: &LoadedScene) -> Result<Self, LoadError> {
        let text = std::str::from_utf8(&loaded.scene).map_err(|_| LoadError::NotText)?;
        Ok(Self {
            header: loaded.header,
            scene: Scene::from_toml(text, "scene.toml")?,
            text: loaded.scene.clone(),
            topology: TopologyRow::new(&loaded.header, &loaded.constraints),
            surface: SurfaceRow::new(&loaded.header, &loaded.triangles),
        })
    }

    /// Returns the header of a recording that starts at a snapshot. `torn` are the constraints that
    /// tore in earlier steps.
    pub(crate) fn into_run_header(
        self,
        first: &SnapshotHeader,
        torn: Vec<u32>,
        now: Now,
    ) -> RunHeader {
        let mut run = RunDescription {
            run_id: first.run_id,
            epoch_ns: 0,
            scene_name: self.scene.name,
            origin: self.header.origin,
            rate_hz: self.scene.solver.rate_hz,
            method: self.header.method,
            particle_count: first.particle_count,
            constraint_count: u32::try_from(self.topology.a.len()).unwrap_or(u32::MAX),
            solver_version: first.solver_version,
            contract_version: first.contract_version,
            recorder_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        let age_ns = now.monotonic_ns.saturating_sub(first.publish_monotonic_ns);
        let published_ns = now.realtime_ns.saturating_sub(age_ns);
        run.epoch_ns = published_ns.saturating_sub(run.time_of_step_ns(first.step));
        let topology = TopologyRow { torn, ..self.topology };
        let rows = vec![Message::Topology(topology), Message::Surface(self.surface)];
        RunHeader { run, scene: self.text, rows }
    }
}
