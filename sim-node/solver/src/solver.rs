//! The running state of a scene.

use crate::constraints::{Constraint, Constraints};
use crate::drive::Grab;
use crate::hash::state_hash;
use crate::order::Order;
use crate::particles::{Particle, Particles};
use crate::scene::{Model, Scene, SolverSettings};

/// A scene that runs. Made once per load; nothing is allocated afterwards in [`Self::step`].
#[derive(Debug, Clone)]
pub struct Solver {
    /// Immutable from load to load: particles as loaded, constraints by index, triangles.
    model: Model,
    pub(crate) settings: SolverSettings,
    pub(crate) gravity: [f32; 3],
    /// z is 0 bit for bit.
    pub(crate) is_planar: bool,
    pub(crate) particles: Particles,
    pub(crate) constraints: Constraints,
    /// Ascending by particle.
    pub(crate) grabs: Vec<Grab>,
    pub(crate) scene_step: u64,
    /// The state was put in place since the last step: the next step shows it, and integrates
    /// nothing.
    pub(crate) is_restored: bool,
    /// Particles frozen since this solver was made: for messages, not part of the state.
    pub(crate) frozen_count: u64,
    pub(crate) state_hash: u64,
}

impl Solver {
    /// Makes the state at step 0: the particles as given, nothing projected.
    pub fn new(scene: &Scene) -> Self {
        let model = scene.model();
        let settings = scene.solver;
        let order = Order::new(&model, settings.order);
        let particles = Particles::new(&model.particles);
        Self {
            state_hash: state_hash(&particles, &[]),
            constraints: Constraints::new(&model, &order, &settings),
            gravity: scene.gravity,
            is_planar: scene.dimensions == 2,
            settings,
            particles,
            // Room for every particle, so that a grab allocates nothing.
            grabs: Vec::with_capacity(model.particles.len()),
            scene_step: 0,
            is_restored: false,
            frozen_count: 0,
            model,
        }
    }

    /// Makes the next step's state the initial one: particles as loaded, nothing grabbed.
    pub fn reset(&mut self) {
        self.particles = Particles::new(&self.model.particles);
        self.grabs.clear();
        self.is_restored = true;
    }

    /// Steps since the scene was loaded or reset.
    pub fn scene_step(&self) -> u64 {
        self.scene_step
    }

    /// Hash of the state after the last step; the same state has the same hash on every machine.
    pub fn state_hash(&self) -> u64 {
        self.state_hash
    }

    /// Particles that were frozen since this solver was made, because their state was no longer
    /// finite. Such a particle stands for good, until a reset.
    pub fn frozen_count(&self) -> u64 {
        self.frozen_count
    }

    /// Number of particles.
    pub fn particle_count(&self) -> usize {
        self.particles.count()
    }

    /// One particle after the last step.
    ///
    /// # Panics
    /// If there is no particle `index`.
    pub fn particle(&self, index: usize) -> Particle {
        self.particles.get(index)
    }

    /// Number of constraints.
    pub fn constraint_count(&self) -> usize {
        self.model.constraints.len()
    }

    /// The constraints by index, as loaded.
    pub fn constraints(&self) -> impl Iterator<Item = Constraint> + '_ {
        self.model.constraints.iter().copied()
    }

    /// The triangles of the surface, three particle indices each.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.model.triangles
    }

    /// The constraints torn since the load, in the order of tearing.
    #[allow(clippy::unused_self, reason = "nothing tears in this version; its readers are ready")]
    pub fn torn(&self) -> &[u32] {
        &[]
    }
}
