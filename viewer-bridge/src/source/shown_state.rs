//! The state on show: one load at a time, and what has changed in it. A live node and a recording
//! both show their states here. It numbers the loads and publishes only changes.

use sim_contract::{ColliderState, ParticleState, TornConstraint};

use crate::sink::{Demand, Sinks, State, Torn, Update};
use crate::wire::{Colliders, Pins, Scene, Stamp};

/// The state on show.
#[derive(Debug, Default)]
pub struct ShownState {
    epoch: u32,
    torn: Vec<TornConstraint>,
    pins: Pins,
    colliders: Vec<ColliderState>,
}

impl ShownState {
    /// Number of the load; 0 before the first one.
    pub fn epoch(&self) -> u32 {
        self.epoch
    }

    /// The torn constraints, in the order of tearing.
    pub fn torn(&self) -> &[TornConstraint] {
        &self.torn
    }

    /// The colliders.
    pub fn colliders(&self) -> &[ColliderState] {
        &self.colliders
    }

    /// Shows a new load. Nothing of it is torn, held or moved yet.
    pub fn begin_load(&mut self, sinks: &Sinks, mut scene: Scene) {
        *self = Self { epoch: self.epoch.wrapping_add(1), ..Self::default() };
        scene.stamp.epoch = self.epoch;
        sinks.publish(&Update::Load(&scene));
    }

    /// Replaces the list of torn constraints.
    pub fn set_torn(&mut self, sinks: &Sinks, step: u64, torn: &[TornConstraint]) {
        if torn == self.torn {
            return;
        }
        let known_count = if torn.starts_with(&self.torn) { self.torn.len() } else { 0 };
        self.torn = torn.to_vec();
        let stamp = self.stamp(step);
        sinks.publish(&Update::Torn(Torn { stamp, all: torn, known_count }));
    }

    /// Replaces the colliders.
    pub fn set_colliders(&mut self, sinks: &Sinks, step: u64, colliders: &[ColliderState]) {
        if colliders != self.colliders {
            self.colliders = colliders.to_vec();
            let colliders = Colliders { stamp: self.stamp(step), colliders: colliders.to_vec() };
            sinks.publish(&Update::Colliders(&colliders));
        }
    }

    /// Takes the particles that are not free from a state.
    pub fn set_pins(&mut self, sinks: &Sinks, step: u64, particles: &[ParticleState]) {
        let pins = Pins::from_particles(self.stamp(step), particles);
        if pins.particles != self.pins.particles {
            sinks.publish(&Update::Pins(&pins));
            self.pins = pins;
        }
    }

    /// Shows a state, if a client waits for one. Fills in the number of the load.
    pub fn show(&self, sinks: &Sinks, state: State<'_>) {
        if sinks.has_demand(Demand::State) {
            sinks.publish(&Update::State(State { epoch: self.epoch, ..state }));
        }
    }

    fn stamp(&self, step: u64) -> Stamp {
        Stamp { epoch: self.epoch, step }
    }
}
