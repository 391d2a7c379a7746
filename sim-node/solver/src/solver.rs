//! The running state of a scene.

use sim_types::{ParameterValues, TearCause};

use crate::anchors::Anchors;
use crate::bodies::{Bodies, Extras};
use crate::colliders::{Collider, PlacedCollider};
use crate::constraints::{Constraint, Recipe, Setup};
use crate::contact::{OBSTACLES_PER_COLLIDER, Obstacle};
use crate::drive::Grab;
use crate::hash::state_hash;
use crate::kernels::Kernels;
use crate::order::Order;
use crate::parameters::Parameters;
use crate::particles::{Particle, Particles};
use crate::scene::{Model, Scene, SceneAnchor, SolverSettings, substep_length};
use crate::tear::Torn;
use crate::tethers::Tethers;
use crate::wind::Air;

/// A scene that runs. Made once per load; [`Self::step`] allocates nothing afterwards, except where
/// a command before it has changed parameters or, with tethers, what is held.
#[derive(Debug, Clone)]
pub struct Solver {
    /// Immutable from load to load: particles as loaded, constraints by index, triangles.
    pub(crate) model: Model,
    /// What does not change: rate, method, order, whether there are tethers.
    pub(crate) settings: SolverSettings,
    /// What a client can change, and its values at load.
    pub(crate) parameters: Parameters,
    initial_parameters: Parameters,
    /// z is 0 bit for bit.
    pub(crate) is_planar: bool,
    /// Between two steps.
    pub(crate) particles: Particles,
    /// Within a step.
    pub(crate) bodies: Bodies,
    pub(crate) torn: Torn,
    pub(crate) tethers: Tethers,
    /// In the order of the scene, which is that of contacts.
    pub(crate) colliders: Vec<Collider>,
    /// The colliders as the running substep meets them.
    pub(crate) obstacles: Vec<Obstacle>,
    pub(crate) anchors: Anchors,
    scene_anchors: Vec<SceneAnchor>,
    pub(crate) air: Air,
    /// Ascending by particle.
    pub(crate) grabs: Vec<Grab>,
    pub(crate) scene_step: u64,
    /// What commands of this boundary have left to be worked out before the step.
    pub(crate) due: Due,
    /// The state was put in place since the last step: the next step shows it, and integrates
    /// nothing.
    pub(crate) is_restored: bool,
    /// Particles frozen since this solver was made: for messages, not part of the state.
    pub(crate) frozen_count: u64,
    pub(crate) state_hash: u64,
}

/// What follows from the parameters or from what is held, and has to be worked out again: once for
/// a boundary, however many commands ask for it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Due {
    pub(crate) constraints: bool,
    pub(crate) tethers: bool,
}

impl Solver {
    /// Makes the state at step 0: the particles as given, nothing projected.
    pub fn new(scene: &Scene) -> Self {
        Self::with_kernels(scene, Kernels::best())
    }

    /// As [`Self::new`], with other kernels than the best ones: for tests and comparisons. All give
    /// the same bits.
    pub fn with_kernels(scene: &Scene, kernels: Kernels) -> Self {
        let model = scene.model();
        let settings = scene.solver;
        let order = Order::new(&model, settings.order);
        let particles = new_particles(&model, &scene.anchors);
        let (particle_count, constraint_count) = (model.particles.len(), model.constraints.len());
        let parameters = Parameters::new(scene);
        let mut solver = Self {
            state_hash: state_hash(&particles.states, 0),
            bodies: Bodies::new(&model, &order, kernels),
            torn: Torn::new(constraint_count),
            tethers: Tethers::default(),
            colliders: scene.colliders.iter().map(Collider::new).collect(),
            obstacles: Vec::with_capacity(OBSTACLES_PER_COLLIDER * scene.colliders.len()),
            anchors: Anchors::new(&scene.anchors, &model.particles),
            scene_anchors: scene.anchors.clone(),
            air: Air::new(scene.wind, settings.rate_hz, particle_count, &model.triangles),
            is_planar: scene.dimensions == 2,
            settings,
            parameters,
            initial_parameters: parameters,
            particles,
            // Room for every particle, so that a grab allocates nothing.
            grabs: Vec::with_capacity(particle_count),
            scene_step: 0,
            due: Due { constraints: true, tethers: true },
            is_restored: false,
            frozen_count: 0,
            model,
        };
        solver.finish_boundary();
        solver
    }

    /// As [`Self::new`], in a run that goes on: the next step shows the initial state, as after a
    /// reset.
    pub fn new_in_run(scene: &Scene) -> Self {
        Self { is_restored: true, ..Self::new(scene) }
    }

    /// Steps with so many threads from now on, this one included; 1 is how it begins, [`THREADS_MAX`](crate::THREADS_MAX) the most.
    /// They change no bit. Small scenes are stepped by one, whatever is set. Threads that the system
    /// does not give are not there: see [`Self::threads`].
    pub fn set_threads(&mut self, threads: usize) {
        if threads != self.bodies.threads() {
            self.bodies.set_threads(threads);
        }
    }

    /// Threads that step it, this one included.
    pub fn threads(&self) -> usize {
        self.bodies.threads()
    }

    /// Makes the next step's state the initial one: particles, parameters, colliders and anchors
    /// as loaded, nothing grabbed, nothing torn.
    pub fn reset(&mut self) {
        self.particles = new_particles(&self.model, &self.scene_anchors);
        self.parameters = self.initial_parameters;
        self.torn.clear();
        self.grabs.clear();
        self.anchors.reset();
        for collider in &mut self.colliders {
            collider.moved = None;
            collider.place(0.0);
        }
        self.due = Due { constraints: true, tethers: true };
        self.is_restored = true;
    }

    /// Works out what the commands of a boundary have changed: once, however many they were. Whoever
    /// steps in real time calls it after them; else the next step does, and then may allocate.
    pub fn finish_boundary(&mut self) {
        let Due { constraints, tethers } = std::mem::take(&mut self.due);
        if constraints {
            self.configure();
        }
        if tethers {
            self.work_out_tethers();
        }
    }

    /// Works out what constraints derive from the parameters, and makes room for it.
    pub(crate) fn configure(&mut self) {
        let recipe = Recipe::new(&self.model, &self.parameters, self.setup());
        let extras = Extras {
            colliders: !self.colliders.is_empty(),
            wind: self.air.has_surface() && self.parameters.wind_drag > 0.0,
            tethers: self.settings.tethers,
        };
        self.bodies.configure(&recipe, extras, self.torn.all());
        if extras.wind {
            self.air.find_corners(&self.bodies);
        }
        self.tethers.tie(&mut self.bodies, &self.particles);
    }

    pub(crate) fn setup(&self) -> Setup {
        Setup { method: self.settings.method, h: self.h() }
    }

    /// Works out the tethers of the state as it is, where the scene has any.
    fn work_out_tethers(&mut self) {
        if !self.settings.tethers {
            return;
        }
        self.tethers.untie(&mut self.bodies);
        let (model, parameters) = (&self.model, &self.parameters);
        self.tethers = Tethers::of_state(model, parameters, &self.particles, self.torn.order());
        self.tethers.tie(&mut self.bodies, &self.particles);
    }

    /// Takes a constraint out for good, unless it is torn already.
    pub(crate) fn tear(&mut self, constraint: u32, cause: TearCause) {
        self.torn.tear(constraint, cause);
        self.bodies.tear(constraint);
    }

    /// Length of a substep in seconds.
    pub(crate) fn h(&self) -> f32 {
        substep_length(self.settings.rate_hz, self.parameters.substeps)
    }

    /// Length of a step in seconds.
    pub(crate) fn step_length(&self) -> f32 {
        substep_length(self.settings.rate_hz, 1)
    }

    /// Seconds of the scene after `scene_step`.
    pub(crate) fn scene_time_s(&self) -> f64 {
        self.scene_step as f64 / f64::from(self.settings.rate_hz)
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
        self.particles.states.len()
    }

    /// The particles after the last step, as they are published and hashed.
    pub fn particles(&self) -> &[Particle] {
        &self.particles.states
    }

    /// One particle after the last step.
    ///
    /// # Panics
    /// If there is no particle `index`.
    pub fn particle(&self, index: usize) -> Particle {
        self.particles.states[index]
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

    /// The constraints torn since the load, by step and then by index.
    pub fn torn(&self) -> &[u32] {
        self.torn.order()
    }

    /// Why each of [`Self::torn`] tore.
    pub fn tear_causes(&self) -> &[TearCause] {
        self.torn.causes()
    }

    /// How many at the end of [`Self::torn`] are new in the last step.
    pub fn new_torn_count(&self) -> usize {
        self.torn.new_count()
    }

    /// The parameters as they are now. The time scale is that of a node at real time: the pace
    /// belongs to the node.
    pub fn parameter_values(&self) -> ParameterValues {
        self.parameters.values(self.settings.method)
    }

    /// Number of colliders.
    pub fn collider_count(&self) -> usize {
        self.colliders.len()
    }

    /// Number of anchors.
    pub fn anchor_count(&self) -> usize {
        self.anchors.moved.len()
    }

    /// The colliders where they are after the last step, in the order of the scene.
    pub fn colliders(&self) -> impl Iterator<Item = PlacedCollider> + '_ {
        self.colliders.iter().map(Collider::placed)
    }

    /// Whether a collider is anywhere else than before the last step.
    pub fn has_moving_colliders(&self) -> bool {
        self.colliders.iter().any(Collider::is_moving)
    }
}

fn new_particles(model: &Model, anchors: &[SceneAnchor]) -> Particles {
    let anchored = anchors.iter().flat_map(|anchor| anchor.particles.iter().copied());
    Particles::new(&model.particles, anchored)
}
