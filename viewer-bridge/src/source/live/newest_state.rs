//! The newest state of a node with its load, and the messages that take effect before their state: a paused node answers
//! commands as well.

use sim_contract::{
    Change, Forces, LoadHeader, LoadedScene, NodeStatus, Outcome, ParameterValues, ParticleState,
    SnapshotHeader, State as NodeState, Update as NodeUpdate,
};

use crate::scene::load::{Load, LoadError};
use crate::scene::summary::SceneSummary;
use crate::sink::{Sinks, Update};
use crate::source::shown_state::ShownState;

/// The newest state of a node. It is a copy: commands and new clients need it until the next one, and
/// the tap keeps a state only until the next read.
#[derive(Debug, Default)]
pub(super) struct NewestState {
    /// The load on show; `None` if it contradicts itself.
    load: Option<Load>,
    /// The load that was read last.
    load_header: Option<LoadHeader>,
    header: SnapshotHeader,
    particles: Vec<ParticleState>,
    /// The forces of the step, if they were read.
    forces: Option<Forces>,
}

/// A state with its load.
#[derive(Debug, Clone, Copy)]
pub(super) struct LoadedState<'a> {
    pub(super) load: &'a Load,
    pub(super) header: &'a SnapshotHeader,
    pub(super) particles: &'a [ParticleState],
    pub(super) forces: Option<&'a Forces>,
}

impl NewestState {
    /// Copies a state and shows its load, tears, colliders and pins.
    pub(super) fn update(&mut self, state: &NodeState<'_>, shown: &mut ShownState, sinks: &Sinks) {
        // Any process of the user can publish a state of another size.
        if state.particles.len() != state.load.header.particle_count as usize {
            return;
        }
        if self.load_header != Some(state.load.header) {
            self.load_header = Some(state.load.header);
            self.begin_load(state, shown, sinks);
        }
        self.header = *state.header;
        self.particles.clear();
        self.particles.extend_from_slice(state.particles);
        self.forces = forces_of(state);
        let Some(load) = &self.load else { return };
        let (step, constraint_count) = (state.header.step, load.constraints.len());
        shown.set_pins(sinks, step, state.particles);
        if state.torn.indices().all(|constraint| (constraint as usize) < constraint_count) {
            shown.set_torn(sinks, step, &state.torn.constraints);
        }
        shown.set_colliders(sinks, step, &state.colliders.colliders);
    }

    fn begin_load(&mut self, state: &NodeState<'_>, shown: &mut ShownState, sinks: &Sinks) {
        match read_load(state.load) {
            Ok(load) => {
                shown.begin_load(sinks, load.to_scene(state.header.step, state.particles));
                sinks.publish(&Update::Topology(load.topology()));
                self.load = Some(load);
            }
            Err(error) => {
                self.load = None;
                sinks.publish(&Update::LoadRefused { text: &error.to_string() });
            }
        }
    }

    /// The state, once there is one.
    pub(super) fn get(&self) -> Option<LoadedState<'_>> {
        let load = self.load.as_ref()?;
        let (header, particles, forces) = (&self.header, &self.particles, self.forces.as_ref());
        Some(LoadedState { load, header, particles, forces })
    }
}

/// Returns the forces of the step of a state.
fn forces_of(state: &NodeState<'_>) -> Option<Forces> {
    let own = state.changes.iter().rev().find_map(|change| match change {
        Change::Forces(header, rows) if header.step == state.header.step => Some((header, rows)),
        _ => None,
    });
    own.map(|(header, rows)| Forces { header: *header, rows: rows.clone() })
}

fn read_load(loaded: &LoadedScene) -> Result<Load, LoadError> {
    let text = String::from_utf8_lossy(&loaded.scene);
    let load = Load {
        header: loaded.header,
        summary: SceneSummary::from_toml(&text).unwrap_or_default(),
        constraints: loaded.constraints.clone(),
        bends: loaded.bends.clone(),
        triangles: loaded.triangles.clone(),
    };
    load.checked(loaded.header.particle_count)
}

/// Messages since the last read.
#[derive(Debug, Default)]
pub(super) struct Updates {
    /// The run of the link; `None` before its first message.
    known_run: Option<u64>,
    /// Outcomes of every run, in order: a command can reach the run after the one it was sent to.
    pub(super) outcomes: Vec<Outcome>,
    /// The newest parameters.
    pub(super) parameters: Option<ParameterValues>,
    /// The newest status of the known run.
    pub(super) status: Option<NodeStatus>,
    /// Steps and bytes of the keyframes of the known run.
    pub(super) keyframes: Vec<(u64, Vec<u8>)>,
    /// Run of the newest load or status.
    pub(super) run_id: Option<u64>,
}

impl Updates {
    pub(super) fn for_run(known_run: Option<u64>) -> Self {
        Self { known_run, ..Self::default() }
    }

    pub(super) fn add(&mut self, update: &NodeUpdate<'_>) {
        match *update {
            NodeUpdate::Topology(header, _) => self.run_id = Some(header.run_id),
            NodeUpdate::Parameters(_, values) => self.parameters = Some(values.clone()),
            NodeUpdate::Outcome(outcome) => self.outcomes.push(*outcome),
            NodeUpdate::Status(status) => {
                self.run_id = Some(status.run_id);
                if self.known_run.is_none_or(|known| known == status.run_id) {
                    self.status = Some(*status);
                }
            }
            NodeUpdate::Keyframe(header, bytes) => {
                if self.known_run.is_none_or(|known| known == header.run_id) {
                    self.keyframes.push((header.step, bytes.to_vec()));
                }
            }
            // The tap returns these with their state.
            NodeUpdate::Scene(..)
            | NodeUpdate::Bends(..)
            | NodeUpdate::Surface(..)
            | NodeUpdate::Colliders(..)
            | NodeUpdate::Tears(..)
            | NodeUpdate::Forces(..) => {}
        }
    }
}
