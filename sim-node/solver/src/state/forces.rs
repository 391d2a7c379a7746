//! Forces on what particles cannot move: colliders, anchors and fixed particles.

use glam::{DVec3, Vec3};
use sim_scene::model::Model;
use sim_types::ParticleFlags;

use crate::constraints::tethers::Tethers;
use crate::contacts::contact::reaction::Reaction;
use crate::state::particles::Particle;
use crate::step::anchors::Anchors;
use crate::store::ParticleStore;

/// The impulses of a step. A force is an impulse times the rate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Forces {
    /// By collider.
    pub colliders: Vec<ColliderImpulse>,
    /// By anchor: the sum of its particles.
    pub anchors: Vec<FrameImpulse>,
    /// The pinned, grabbed and anchored particles, ascending.
    pub particles: Vec<ParticleImpulse>,
}

/// Impulse of the particles in contact with a collider.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ColliderImpulse {
    /// The impulse, and the angular impulse about the center of the collider. A plane has its center at the
    /// point nearest to the origin of the scene, bounds in the middle.
    pub impulse: FrameImpulse,
    /// Largest number of particles in contact in one substep.
    pub contacts: u32,
}

/// Impulse on a rigid frame.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FrameImpulse {
    /// In N s.
    pub linear: [f32; 3],
    /// In N m s, about the center of the frame.
    pub angular: [f32; 3],
}

/// Impulse of the constraints, bends and tethers of a fixed particle.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ParticleImpulse {
    /// Index of the particle.
    pub particle: u32,
    /// In N s.
    pub impulse: [f32; 3],
}

/// The measurement of the forces of each step.
#[derive(Debug, Clone)]
pub(crate) struct Measurement {
    /// Those of the last step.
    pub(crate) forces: Forces,
    /// By collider: sums over the step.
    reactions: Vec<Reaction>,
    /// By collider: contacts in a substep.
    contacts: Vec<u32>,
    /// By fixed particle: impulse times the length of a substep.
    pulls: Vec<DVec3>,
    /// True while the store measures where fixed particles, their constraints and their tethers are.
    pub(crate) is_located: bool,
}

/// The values on which a measurement depends.
pub(crate) struct Measured<'a> {
    pub(crate) model: &'a Model,
    pub(crate) states: &'a [Particle],
    pub(crate) tethers: &'a Tethers,
}

impl Measurement {
    pub(crate) fn new(collider_count: usize, anchor_count: usize) -> Self {
        let colliders = vec![ColliderImpulse::default(); collider_count];
        let anchors = vec![FrameImpulse::default(); anchor_count];
        Self {
            forces: Forces { colliders, anchors, particles: Vec::new() },
            reactions: vec![Reaction::default(); collider_count],
            contacts: vec![0; collider_count],
            pulls: Vec::new(),
            is_located: false,
        }
    }

    /// Prepares the store, unless it is prepared.
    pub(crate) fn locate(&mut self, store: &mut ParticleStore, measured: &Measured<'_>) {
        if self.is_located {
            return;
        }
        let states = (0_u32..).zip(measured.states);
        let fixed = states.filter(|(_, one)| is_fixed(one.flags)).map(|(particle, _)| particle);
        let fixed: Vec<_> = fixed.collect();
        let impulse = |particle: &u32| ParticleImpulse { particle: *particle, impulse: [0.0; 3] };
        self.forces.particles.clear();
        self.forces.particles.extend(fixed.iter().map(impulse));
        self.pulls.clear();
        self.pulls.resize(fixed.len(), DVec3::ZERO);
        let tethers = measured.tethers.ends();
        store.measure_forces(measured.model, measured.states, &fixed, tethers);
        self.is_located = true;
    }

    /// Forgets the last step.
    pub(crate) fn begin_step(&mut self) {
        self.pulls.fill(DVec3::ZERO);
        self.reactions.fill(Reaction::default());
    }

    /// Counts the contacts of a substep.
    pub(crate) fn end_substep(&mut self, store: &mut ParticleStore) {
        self.contacts.fill(0);
        store.take_contacts(&mut self.contacts);
        for (reaction, contacts) in self.reactions.iter_mut().zip(&self.contacts) {
            reaction.contacts = reaction.contacts.max(*contacts);
        }
    }

    /// Adds the reaction of a substep to one collider.
    pub(crate) fn add(&mut self, collider: usize, reaction: &Reaction) {
        self.reactions[collider].add_substep(reaction);
    }

    /// Computes the impulses of a step with substeps of `h` seconds.
    pub(crate) fn end_step(
        &mut self,
        store: &mut ParticleStore,
        (anchors, states): (&Anchors, &[Particle]),
        h: f32,
    ) {
        store.take_pulls(&mut self.pulls);
        store.take_reactions(&mut self.reactions);
        let rate = 1.0 / f64::from(h);
        let forces = &mut self.forces;
        for (impulse, reaction) in forces.colliders.iter_mut().zip(&self.reactions) {
            impulse.impulse = frame_impulse(reaction.linear * rate, reaction.angular * rate);
            impulse.contacts = reaction.contacts;
        }
        for (one, pull) in forces.particles.iter_mut().zip(&self.pulls) {
            one.impulse = (*pull * rate).as_vec3().to_array();
        }
        forces.anchors.fill(FrameImpulse::default());
        for (anchor, impulse) in forces.anchors.iter_mut().enumerate() {
            let center = anchors.center(anchor).as_dvec3();
            let (mut linear, mut angular) = (DVec3::ZERO, DVec3::ZERO);
            for particle in anchors.driven_particles(anchor, states) {
                let found = forces.particles.binary_search_by_key(&particle, |one| one.particle);
                let Ok(place) = found else { continue };
                let pull = self.pulls[place] * rate;
                let position = Vec3::from_array(states[particle as usize].position).as_dvec3();
                linear += pull;
                angular += (position - center).cross(pull);
            }
            *impulse = frame_impulse(linear, angular);
        }
    }

    /// The forces of a step that put a state in place: none.
    pub(crate) fn clear(&mut self) {
        self.forces.colliders.fill(ColliderImpulse::default());
        self.forces.anchors.fill(FrameImpulse::default());
        for one in &mut self.forces.particles {
            one.impulse = [0.0; 3];
        }
    }
}

/// True for the flags of a particle that forces act on: pinned, grabbed or anchored.
fn is_fixed(flags: u32) -> bool {
    flags & (ParticleFlags::PINNED | ParticleFlags::GRABBED | ParticleFlags::ANCHORED) != 0
}

fn frame_impulse(linear: DVec3, angular: DVec3) -> FrameImpulse {
    FrameImpulse { linear: linear.as_vec3().to_array(), angular: angular.as_vec3().to_array() }
}
