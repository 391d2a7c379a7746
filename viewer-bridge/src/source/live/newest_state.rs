//! The newest state of a node, and the load to which it belongs.

use sim_contract::{
    Change, Forces, LoadHeader, LoadedScene, ParticleState, SnapshotHeader, State as NodeState,
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
