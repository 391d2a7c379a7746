//! The running state of a scene.

use std::sync::Arc;

use sim_scene::checks::StepSize;
use sim_scene::constraints::Constraint;
use sim_scene::constraints::bends::Bend;
use sim_scene::memory::{ThreadedScene, check_memory, thread_bytes};
use sim_scene::model::Model;
use sim_scene::scene::{ContactMode, Scene, SceneAnchor, SolverSettings};
use sim_types::{Parameter, ParameterValues, TearCause};

use crate::checks::Context;
use crate::commands::preparation::Prepared;
use crate::constraints::builder::{ConstraintBuilder, Setup};
use crate::constraints::order::ProjectionOrders;
use crate::constraints::tethers::{TetherBasis, Tethers};
use crate::contacts::bodies::BodyContacts;
use crate::contacts::colliders::{Collider, PlacedCollider};
use crate::contacts::contact::reaction::ReactionRoom;
use crate::contacts::obstacle::{OBSTACLES_PER_COLLIDER, Obstacle};
use crate::contacts::pairs::ParticleContacts;
use crate::kernels::Kernels;
use crate::parameters::Parameters;
use crate::state::forces::{Forces, Measured, Measurement};
use crate::state::hash::state_hash;
use crate::state::particles::{Particle, Particles};
use crate::state::tear::Torn;
use crate::step::air::Air;
use crate::step::anchors::Anchors;
use crate::step::drive::ActiveGrab;
use crate::store::{Configured, ParticleStore, SceneFields};

/// A running scene.
///
/// [`Self::step`] allocates nothing, except after commands that change parameters or, in scenes with
/// tethers, what holds a particle.
#[derive(Debug, Clone)]
#[allow(clippy::struct_excessive_bools, reason = "independent facts, not the states of a machine")]
pub struct Solver {
    /// Particles as loaded, constraints by index, triangles. Immutable until the next load.
    pub(crate) model: Arc<Model>,
    /// Rate, method, order and tethers, which never change.
    pub(crate) settings: SolverSettings,
    /// Values that clients can change.
    pub(crate) parameters: Parameters,
    pub(crate) initial_parameters: Parameters,
    /// True in a scene of 2 dimensions, where z is exactly 0.
    pub(crate) is_planar: bool,
    /// The state between two steps.
    pub(crate) particles: Particles,
    /// The state within a step.
    pub(crate) store: ParticleStore,
    pub(crate) torn: Torn,
    pub(crate) tethers: Tethers,
    /// In the order of the scene, which is the order of contacts.
    pub(crate) colliders: Vec<Collider>,
    /// The colliders in the running substep.
    pub(crate) obstacles: Vec<Obstacle>,
    pub(crate) contact_mode: ContactMode,
    pub(crate) particle_contacts: ParticleContacts,
    pub(crate) body_contacts: BodyContacts,
    pub(crate) anchors: Anchors,
    scene_anchors: Vec<SceneAnchor>,
    pub(crate) air: Air,
    /// Ascending by particle.
    pub(crate) grabs: Vec<ActiveGrab>,
    pub(crate) scene_step: u64,
    /// Derived state that commands of this boundary have made out of date.
    pub(crate) due: Due,
    /// True if the tethers were derived since the last step. They then follow further tears, so that they
    /// depend on the commands of a boundary, and not on when these arrive.
    pub(crate) has_new_tethers: bool,
    /// Constraints that a command of this boundary may take over.
    pub(crate) offered: Option<Box<Prepared>>,
    /// True if a state was put in place since the last step. The next step publishes it, and
    /// integrates nothing.
    pub(crate) is_put_in_place: bool,
    /// A step panicked, so the state is neither that before it nor that after it.
    pub(crate) is_poisoned: bool,
    /// Number of frozen particles, which their flags tell as well.
    pub(crate) frozen_count: u64,
    pub(crate) standing_body_steps: u64,
    pub(crate) state_hash: u64,
    /// None while nobody asks for forces.
    pub(crate) measurement: Option<Box<Measurement>>,
}

/// Derived state that is out of date. It is updated once per boundary, however many commands
/// require it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Due {
    pub(crate) constraints: bool,
    pub(crate) tethers: bool,
}

/// Error of a contact distance with too many neighbours at load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Overfull;

impl Due {
    const ALL: Self = Self { constraints: true, tethers: true };
}

impl Solver {
    /// Makes the state at step 0: the particles of the scene, before any projection.
    pub fn new(scene: &Scene) -> Self {
        Self::with_kernels(scene, Kernels::best())
    }

    /// Like [`Self::new`], with the given kernels, for tests and comparisons. All kernels produce the
    /// same bits.
    pub fn with_kernels(scene: &Scene, kernels: Kernels) -> Self {
        let model = scene.model();
        let settings = scene.solver;
        let orders = ProjectionOrders::new(&model, settings.order);
        let particles = new_particles(&model, &scene.anchors);
        let (particle_count, constraint_count) = (model.particles.len(), model.constraints.len());
        let parameters = Parameters::new(scene);
        let mut solver = Self {
            state_hash: state_hash(&particles.states, 0),
            store: ParticleStore::new(&model, &orders, kernels),
            torn: Torn::new(constraint_count),
            tethers: Tethers::default(),
            colliders: (0..)
                .zip(&scene.colliders)
                .map(|(at, one)| Collider::new(at, one).for_steps())
                .collect(),
            obstacles: Vec::with_capacity(OBSTACLES_PER_COLLIDER * scene.colliders.len()),
            contact_mode: scene.contact.mode,
            particle_contacts: ParticleContacts::default(),
            body_contacts: BodyContacts::default(),
            anchors: Anchors::new(&scene.anchors, &model.particles),
            scene_anchors: scene.anchors.clone(),
            air: Air::new(scene.wind, settings.rate_hz),
            is_planar: scene.dimensions == 2,
            settings,
            parameters: parameters.clone(),
            initial_parameters: parameters,
            particles,
            // Room for every particle, so that a grab does not allocate.
            grabs: Vec::with_capacity(particle_count),
            scene_step: 0,
            due: Due::ALL,
            has_new_tethers: false,
            is_put_in_place: false,
            is_poisoned: false,
            frozen_count: 0,
            standing_body_steps: 0,
            measurement: None,
            offered: None,
            model: Arc::new(model),
        };
        if solver.colliders.iter().any(|collider| collider.mesh.is_some()) {
            solver.store.reserve_mesh_contacts(particle_count);
        }
        if solver.has_bodies() {
            solver.body_contacts = BodyContacts::new(particle_count);
        }
        solver.finish_boundary();
        solver.has_new_tethers = false;
        solver
    }

    /// Like [`Self::new`], for a run that continues: the next step publishes the initial state, as
    /// after a reset.
    pub fn new_in_run(scene: &Scene) -> Self {
        Self { is_put_in_place: true, ..Self::new(scene) }
    }

    /// Sets the number of threads that step the scene, the calling one included: 1 initially, at most
    /// [`THREADS_MAX`](crate::kernels::worker_pool::THREADS_MAX).
    ///
    /// The number changes no bit. A small scene without contacts uses a single thread. The system may grant fewer
    /// threads, and without the memory for several there is one; see [`Self::threads`].
    pub fn set_threads(&mut self, threads: usize) {
        let threads = if self.have_threads_memory(threads) { threads } else { 1 };
        if threads != self.store.thread_count() {
            self.store.set_threads(threads);
            self.particle_contacts.set_worker_count(self.store.thread_count());
        }
    }

    /// Returns `true` if the process can get the memory with which several threads find contacts.
    fn have_threads_memory(&self, threads: usize) -> bool {
        let contact_mode = match (self.parameters.contact_thickness(), self.contact_mode) {
            (None, _) => ContactMode::Off,
            (Some(_), ContactMode::Surfaces) => ContactMode::Surfaces,
            (Some(_), _) => ContactMode::Particles,
        };
        let scene = ThreadedScene {
            particle_count: self.model.particles.len(),
            contact_mode,
            has_meshes: self.colliders.iter().any(|collider| collider.mesh.is_some()),
        };
        threads == 1 || check_memory(thread_bytes(scene, threads)).is_ok()
    }

    /// Returns the number of threads, the calling one included.
    pub fn threads(&self) -> usize {
        self.store.thread_count()
    }

    /// Makes the next step publish the initial state: particles, parameters, colliders and anchors as
    /// loaded, nothing grabbed, nothing torn.
    pub fn reset(&mut self) {
        self.assert_whole();
        self.particles = new_particles(&self.model, &self.scene_anchors);
        self.parameters.clone_from(&self.initial_parameters);
        self.torn.clear();
        self.grabs.clear();
        self.anchors.reset();
        for collider in &mut self.colliders {
            collider.reset();
        }
        self.follow_surfaces();
        self.due = Due::ALL;
        self.scene_step = 0;
        self.is_put_in_place = true;
        self.frozen_count = 0;
        self.locate_forces();
    }

    /// Updates derived state after the commands of a boundary, once for all of them. A caller that
    /// steps in real time calls it after the commands; otherwise the next step does, and then may
    /// allocate.
    pub fn finish_boundary(&mut self) {
        self.assert_whole();
        self.is_poisoned = true;
        self.update_derived();
        self.is_poisoned = false;
    }

    fn update_derived(&mut self) {
        let Due { constraints, tethers } = std::mem::take(&mut self.due);
        if constraints {
            self.configure();
        }
        self.derive_particle_contacts();
        if tethers {
            self.derive_tethers();
            self.has_new_tethers = true;
        }
        if let Some(measurement) = &mut self.measurement {
            measurement.is_located &= !tethers;
            let states = &self.particles.states;
            let measured = Measured { model: &self.model, states, tethers: &self.tethers };
            measurement.locate(&mut self.store, &measured);
        }
    }

    /// Refuses to go on with an incomplete state. Whatever the solver computed from it would be wrong.
    #[track_caller]
    pub(crate) fn assert_whole(&self) {
        assert!(
            !self.is_poisoned,
            "a step of this solver panicked, so its state is incomplete: make another solver from the scene"
        );
    }

    /// Derives the constraints from the parameters.
    pub(crate) fn configure(&mut self) {
        let is_exchanged = self.accept_constraints();
        let (setup, fields) = (self.setup(&self.parameters), self.scene_fields(&self.parameters));
        let builder = ConstraintBuilder::new(&self.model, &self.parameters, setup);
        let configured = self.store.configure(&builder, fields, self.torn.all());
        if is_exchanged || configured == Configured::Moved {
            self.follow_particles();
        }
    }

    pub(crate) fn scene_fields(&self, parameters: &Parameters) -> SceneFields {
        SceneFields {
            colliders: !self.colliders.is_empty(),
            bounces: parameters.surfaces.have_bounces(),
            wind: !self.model.triangles.is_empty()
                && parameters.values.number(Parameter::WindDrag) > 0.0,
            bend_multipliers: !self.model.bends.is_empty()
                && parameters.values.count(Parameter::Iterations) > 1,
            tethers: self.settings.tethers as usize,
            divided_sweep: parameters.contact_thickness().is_some() || self.has_bodies(),
        }
    }

    /// Gives each collider the friction and the restitution of the parameters.
    pub(crate) fn follow_surfaces(&mut self) {
        for (collider, surface) in self.colliders.iter_mut().zip(self.parameters.surfaces.all()) {
            collider.surface = *surface;
        }
    }

    /// Lets the next boundary find again where forces are measured: other particles are fixed, or something has
    /// moved in memory.
    pub(crate) fn locate_forces(&mut self) {
        if let Some(measurement) = &mut self.measurement {
            measurement.is_located = false;
        }
    }

    /// Derives the contacts of particles with each other, if their distance has changed.
    pub(crate) fn derive_particle_contacts(&mut self) {
        if let Some(contacts) = self.contacts_at(self.parameters.contact_thickness()) {
            self.replace_particle_contacts(contacts);
        }
    }

    /// Returns the contacts for a distance: the offered ones, or else new ones. `None` if the current contacts have this
    /// distance.
    pub(crate) fn contacts_at(&mut self, thickness: Option<f32>) -> Option<ParticleContacts> {
        if self.particle_contacts.are_derived_from(thickness) {
            return None;
        }
        let offered = self.take_offered_contacts(thickness);
        Some(offered.unwrap_or_else(|| {
            let kernels = self.store.kernels();
            ParticleContacts::new(&self.model, self.contact_mode, thickness, kernels)
        }))
    }

    /// Like [`Self::contacts_at`], for a distance that a client sets. The scene's own distance is always allowed, even with
    /// too many neighbours: returns `None` for it.
    ///
    /// # Errors
    /// More neighbours are near each other at load than the lists of pairs that never touch have room for.
    pub(crate) fn contacts_of_client(
        &mut self,
        thickness: Option<f32>,
    ) -> Result<Option<ParticleContacts>, Overfull> {
        if thickness == self.initial_parameters.contact_thickness() {
            return Ok(None);
        }
        match self.contacts_at(thickness) {
            Some(contacts) if contacts.are_overfull() => {
                self.give_away(contacts);
                Err(Overfull)
            }
            contacts => Ok(contacts),
        }
    }

    /// Puts contacts in the place of the current ones.
    pub(crate) fn replace_particle_contacts(&mut self, mut contacts: ParticleContacts) {
        contacts.overflow_count = self.particle_contacts.overflow_count;
        contacts.locate(&self.store);
        let replaced = std::mem::replace(&mut self.particle_contacts, contacts);
        self.give_away(replaced);
    }

    /// Updates the locations of particles after a change of the layout.
    fn follow_particles(&mut self) {
        self.locate_forces();
        self.particle_contacts.locate(&self.store);
        self.body_contacts.locate(&self.store);
        self.tethers.attach(&mut self.store, &self.particles);
    }

    pub(crate) fn setup(&self, parameters: &Parameters) -> Setup {
        let substeps = parameters.values.count(Parameter::Substeps);
        let settings = SolverSettings { substeps, ..self.settings };
        Setup { method: settings.method, h: settings.h() }
    }

    /// Derives the tethers from the current state, if the scene has any.
    fn derive_tethers(&mut self) {
        if self.settings.has_tethers() {
            self.replace_tethers(self.tether_basis());
            self.tethers.attach(&mut self.store, &self.particles);
        }
    }

    /// Replaces the tethers. They are not attached yet.
    pub(crate) fn replace_tethers(&mut self, basis: TetherBasis) {
        self.tethers.detach(&mut self.store);
        if self.tethers.are_derived_from(&self.parameters, &basis) {
            self.tethers.restore_dropped();
        } else if !self.accept_tethers(&basis) {
            self.tethers =
                Tethers::new(&self.model, &self.parameters, basis, self.settings.tethers as usize);
        }
    }

    /// Basis of the tethers in the current state.
    pub(crate) fn tether_basis(&self) -> TetherBasis {
        TetherBasis::new(&self.particles, self.torn.order())
    }

    /// Basis of the tethers in the initial state.
    pub(crate) fn initial_tether_basis(&self) -> TetherBasis {
        TetherBasis::new(&new_particles(&self.model, &self.scene_anchors), &[])
    }

    /// Tears a constraint, unless it is torn already.
    pub(crate) fn tear(&mut self, constraint: u32, cause: TearCause) {
        self.torn.tear(constraint, cause);
        self.store.tear(constraint);
        self.due.tethers |= self.has_new_tethers;
    }

    /// Length of a substep in seconds.
    pub(crate) fn h(&self) -> f32 {
        self.setup(&self.parameters).h
    }

    /// Properties against which parameters and poses are checked.
    pub(crate) fn context(&self) -> Context<'_> {
        self.assert_whole();
        let size = StepSize {
            particles: self.particle_count() as u64,
            constraints: (self.constraint_count() + self.bend_count()) as u64,
            colliders: self.collider_count() as u64,
        };
        Context {
            method: self.settings.method,
            is_planar: self.is_planar,
            has_bends: self.bend_count() > 0,
            bent_blocks: &self.model.bent_blocks,
            size,
        }
    }

    /// Number of steps that a motion of `over_s` seconds takes, rounded up, at least one. A time that
    /// differs from whole steps only by its rounding to f32 counts as those: 1/60 s at 240 Hz is 4
    /// steps, not 5.
    pub(crate) fn grab_steps(&self, over_s: f32) -> u32 {
        let steps = f64::from(over_s) * f64::from(self.settings.rate_hz) * (1.0 - 1e-7);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "0 <= over_s <= 3600 and rate <= 1e5: at most 3.6e8"
        )]
        let steps = steps.ceil() as u32;
        steps.max(1)
    }

    /// Length of a step in seconds.
    pub(crate) fn step_length(&self) -> f32 {
        SolverSettings { substeps: 1, ..self.settings }.h()
    }

    /// Time of the scene at `scene_step`, in seconds.
    pub(crate) fn scene_time_s(&self) -> f64 {
        self.scene_step as f64 / f64::from(self.settings.rate_hz)
    }

    /// Returns the number of steps since the scene was loaded or reset.
    pub fn scene_step(&self) -> u64 {
        self.assert_whole();
        self.scene_step
    }

    /// Returns the hash of the state after the last step. Equal states have equal hashes on every
    /// machine.
    pub fn state_hash(&self) -> u64 {
        self.assert_whole();
        self.state_hash
    }

    /// Returns the number of frozen particles, whose state was not finite. A frozen particle stays in
    /// place until a reset, or a restore of a state in which it is not frozen.
    pub fn frozen_count(&self) -> u64 {
        self.assert_whole();
        self.frozen_count
    }

    /// Returns the number of times that a search for contacts of particles was given up because there were
    /// too many of them: 8 for each particle, on average. Further contacts are ignored then.
    pub fn contact_overflow_count(&self) -> u64 {
        self.assert_whole();
        self.particle_contacts.overflow_count
    }

    /// Returns the number of particles.
    pub fn particle_count(&self) -> usize {
        self.particles.states.len()
    }

    /// Returns the particles after the last step, as they are published and hashed.
    pub fn particles(&self) -> &[Particle] {
        self.assert_whole();
        &self.particles.states
    }

    /// Returns a particle after the last step.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn particle(&self, index: usize) -> Particle {
        self.assert_whole();
        self.particles.states[index]
    }

    /// Returns the number of constraints.
    pub fn constraint_count(&self) -> usize {
        self.model.constraints.len()
    }

    /// Returns the constraints by index, as loaded.
    pub fn constraints(&self) -> impl Iterator<Item = Constraint> + '_ {
        self.model.constraints.iter().copied()
    }

    /// Returns the number of bends.
    pub fn bend_count(&self) -> usize {
        self.model.bends.len()
    }

    /// Returns the bends by index, as loaded. Bends have indices of their own, and never tear.
    pub fn bends(&self) -> impl Iterator<Item = Bend> + '_ {
        self.model.bends.iter().copied()
    }

    /// Returns the triangles of the surface, three particle indices each.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.model.triangles
    }

    /// Returns the torn constraints, by step and then by index.
    pub fn torn(&self) -> &[u32] {
        self.assert_whole();
        self.torn.order()
    }

    /// Returns the cause of each tear in [`Self::torn`].
    pub fn tear_causes(&self) -> &[TearCause] {
        self.assert_whole();
        self.torn.causes()
    }

    /// Returns the number of entries at the end of [`Self::torn`] that the last step added.
    pub fn new_torn_count(&self) -> usize {
        self.assert_whole();
        self.torn.new_count()
    }

    /// Returns the current parameters. The pace belongs to the node, so the time scale is always that
    /// of real time.
    pub fn parameter_values(&self) -> &ParameterValues {
        self.assert_whole();
        &self.parameters.values
    }

    /// Returns the grabbed particles in ascending order, each with the client that holds it.
    pub fn grabs(&self) -> impl ExactSizeIterator<Item = (u32, u64)> + '_ {
        self.assert_whole();
        self.grabs.iter().map(|grab| (grab.particle, grab.client_id))
    }

    /// Returns the number of colliders.
    pub fn collider_count(&self) -> usize {
        self.colliders.len()
    }

    /// Returns the number of anchors.
    pub fn anchor_count(&self) -> usize {
        self.anchors.moved.len()
    }

    /// Returns the colliders at their poses after the last step, in the order of the scene.
    pub fn colliders(&self) -> impl Iterator<Item = PlacedCollider> + '_ {
        self.assert_whole();
        self.colliders.iter().map(Collider::placed)
    }

    /// Computes the forces of each further step, or no longer. They are no part of the state, and change no bit
    /// of it.
    pub fn compute_forces(&mut self, is_on: bool) {
        if !is_on {
            self.store.forget_forces();
            self.measurement = None;
        } else if self.measurement.is_none() {
            let collider_count = self.collider_count();
            let measurement = Measurement::new(collider_count, self.anchor_count());
            let masses = self.model.particles.iter().map(|one| f64::from(one.mass));
            let mass_max = masses.fold(f64::MIN_POSITIVE, f64::max);
            self.store.measure_reactions(ReactionRoom { collider_count, mass_max });
            self.measurement = Some(Box::new(measurement));
        }
    }

    /// Returns the forces of the last step, if they are computed: all 0 in a step that put a state in place.
    pub fn forces(&self) -> Option<&Forces> {
        self.assert_whole();
        self.measurement.as_ref().map(|measurement| &measurement.forces)
    }

    /// Returns true if the scene has bodies.
    pub(crate) fn has_bodies(&self) -> bool {
        self.colliders.iter().any(|collider| collider.body.is_some())
    }

    /// Returns the number of steps in which a body stood because it had no command, after its first one, summed
    /// over the bodies.
    pub fn standing_body_steps(&self) -> u64 {
        self.assert_whole();
        self.standing_body_steps
    }

    /// Returns true if the last step moved a collider.
    pub fn has_moving_colliders(&self) -> bool {
        self.assert_whole();
        self.colliders.iter().any(Collider::is_moving)
    }
}

fn new_particles(model: &Model, anchors: &[SceneAnchor]) -> Particles {
    let anchored = anchors.iter().flat_map(|anchor| anchor.particles.iter().copied());
    Particles::new(&model.particles, anchored)
}
