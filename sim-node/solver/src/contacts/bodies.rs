//! Contacts of particles with the bodies of other programs.
//!
//! In a step with its command, a body is a copy with mass and inertia. In every substep its contacts are
//! resolved one after the other, in an order that a hash of particle and collider gives, and the body moves
//! with each of them. They run between the constraints and the contacts with other colliders.

mod body_contact;
pub(crate) mod driven_body;

use body_contact::{BodyContact, BodyResponse, BodySurface, hold, resolve};
use glam::Vec3;

use super::colliders::Collider;
use super::contact::reaction::Reaction;
use super::contact_substep::{ContactSubstep, Interval};
use super::hit::Hit;
use super::mesh::near::NearMeshes;
use super::mesh::{PUSHES_MAX, PlacedMesh, Stop};
use super::obstacle::rounding;
use super::pairs::order::{order_by_key, order_key};
use super::path::{LanePath, SubstepPath};
use super::solid::{Solid, solids};
use crate::kernels::lanes::PackedParticle;
use crate::state::forces::Measurement;
use crate::store::{Location, ParticleStore};

/// Finds and resolves the contacts of particles with driven bodies. Empty in scenes without bodies.
#[derive(Debug, Clone, Default)]
pub(crate) struct BodyContacts {
    are_on: bool,
    /// By particle: where it is in the store.
    locations: Vec<Location>,
    /// The particles near a body in the running substep.
    candidates: Vec<u32>,
    /// The candidates in the order of contact.
    ordered: Vec<u32>,
    near_meshes: NearMeshes,
}

impl BodyContacts {
    /// Those of a scene with bodies and this number of particles.
    pub(crate) fn new(particle_count: usize) -> Self {
        Self {
            are_on: true,
            locations: vec![Location::default(); particle_count],
            candidates: Vec::with_capacity(particle_count),
            ordered: Vec::with_capacity(particle_count),
            near_meshes: NearMeshes::new(particle_count),
        }
    }

    /// True in a scene with bodies.
    pub(crate) fn are_on(&self) -> bool {
        self.are_on
    }

    /// Updates the locations of the particles.
    pub(crate) fn locate(&mut self, store: &ParticleStore) {
        for (particle, location) in (0..).zip(&mut self.locations) {
            *location = store.location(particle);
        }
    }

    /// Moves the driven bodies through a substep, and resolves their contacts.
    pub(crate) fn push(
        &mut self,
        store: &mut ParticleStore,
        colliders: &mut [Collider],
        substep: &ContactSubstep,
        mut measurement: Option<&mut Measurement>,
    ) {
        for (index, collider) in colliders.iter_mut().enumerate() {
            if collider.begin_body_substep(substep) {
                let reaction = self.push_off(store, (index, collider), substep);
                if let Some(measurement) = &mut measurement {
                    measurement.add(index, &reaction);
                }
            }
        }
    }

    /// Pushes the particles off one body.
    fn push_off(
        &mut self,
        store: &mut ParticleStore,
        (index, collider): (usize, &mut Collider),
        substep: &ContactSubstep,
    ) -> Reaction {
        let surface = BodySurface {
            restitution: collider.surface.restitution,
            friction: collider.surface.friction,
            rest_distance: substep.rest_speed * substep.h,
        };
        // Its pose is that at the end of the substep.
        let substep = ContactSubstep { interval: Interval { start: 0.0, end: 1.0 }, ..*substep };
        let mut reaction = Reaction::default();
        let Some(mut solid) = solid(collider, &substep) else { return reaction };
        self.find_candidates(store, index, &solid);
        for particle in &self.ordered {
            let location = self.locations[*particle as usize];
            let mut meeting = Meeting { store, collider, location, reaction: &mut reaction };
            match &solid {
                Solid::Mesh(mesh) => {
                    let lists = &mut self.near_meshes;
                    meeting.push_off_mesh(&surface, (mesh, lists), *particle as usize);
                }
                convex => {
                    if meeting.push_out(&surface, convex) {
                        collider.follow_body();
                        solid = self::solid(collider, &substep).unwrap_or(solid);
                    }
                }
            }
        }
        collider.follow_body();
        reaction
    }

    /// Finds the particles whose paths may meet the solid, and orders them.
    fn find_candidates(&mut self, store: &ParticleStore, collider: usize, solid: &Solid) {
        let zone = solid.zone();
        self.candidates.clear();
        for (particle, location) in (0_u32..).zip(&self.locations) {
            let PackedParticle([x, y, z, _, dx, dy, dz, _]) = store.particles().packed(*location);
            if zone.may_meet([x, y, z], [dx, dy, dz]) {
                self.candidates.push(particle);
            }
        }
        #[allow(clippy::cast_possible_truncation, reason = "at most 2^16 colliders")]
        let key = |particle: &u32| order_key(*particle, collider as u32);
        order_by_key(&self.candidates, &mut self.ordered, key);
    }
}

/// The solid of a body. Planes and bounds, which have several or none, are no bodies.
fn solid(collider: &Collider, substep: &ContactSubstep) -> Option<Solid> {
    let [solid, ..] = solids(collider, substep);
    solid
}

/// The path from the start of the first one to the end of the last one. Between them, a push has changed the start, so that
/// the displacement can hold the bounce, which the particle makes in the next substep.
fn path_to_end(first: &SubstepPath, last: &SubstepPath) -> SubstepPath {
    let end = last.start + last.displacement;
    SubstepPath { start: first.start, displacement: end - first.start }
}

/// A particle and a body near it.
struct Meeting<'a> {
    store: &'a mut ParticleStore,
    collider: &'a mut Collider,
    location: Location,
    reaction: &'a mut Reaction,
}

impl Meeting<'_> {
    fn path(&self) -> (SubstepPath, f32) {
        let PackedParticle([x, y, z, inverse_mass, dx, dy, dz, _]) =
            self.store.particles().packed(self.location);
        let path = SubstepPath { start: Vec3::new(x, y, z), displacement: Vec3::new(dx, dy, dz) };
        (path, inverse_mass)
    }

    /// Pushes the particle out of a convex body. Returns true if it was inside.
    fn push_out(&mut self, surface: &BodySurface, solid: &Solid) -> bool {
        let (path, inverse_mass) = self.path();
        let Some(hit) = solid.hit(&path) else { return false };
        let rounding = rounding(&LanePath::from(&path), solid.reach());
        self.respond(surface, &self.contact(&path, inverse_mass, (hit, rounding)));
        self.reaction.contacts += 1;
        true
    }

    /// Pushes the particle off the triangles of a body, on the side on which it is.
    fn push_off_mesh(
        &mut self,
        surface: &BodySurface,
        (mesh, lists): (&PlacedMesh, &mut NearMeshes),
        number: usize,
    ) {
        let (first, _) = self.path();
        let mut around = mesh.surroundings(lists, number, &mesh.path(&first));
        if around.are_free() {
            return;
        }
        let mut surface = *surface;
        for push_count in 0..=PUSHES_MAX {
            let (path, inverse_mass) = self.path();
            let made = if push_count == 0 { path } else { path_to_end(&first, &path) };
            let made = mesh.path(&made);
            if !around.contain_end(&made) {
                around = mesh.surroundings(lists, number, &made);
            }
            let stop = mesh.stop(&made, &around, push_count);
            if stop.is_some() && push_count == 0 {
                self.reaction.contacts += 1;
            }
            match stop {
                None => break,
                Some(Stop::Hold) => {
                    let held = mesh.held_displacement(first.start);
                    let hit = Hit { normal: Vec3::ZERO, depth: 0.0 };
                    let path = SubstepPath { start: first.start, ..path };
                    let contact = self.contact(&path, inverse_mass, (hit, 0.0));
                    if let Some(body) = &mut self.collider.driven {
                        let response = hold(body, &contact, held);
                        self.apply(&response, inverse_mass);
                    }
                    break;
                }
                Some(Stop::Push(hit)) => {
                    let contact = self.contact(&path, inverse_mass, (hit, mesh.rounding()));
                    self.respond(&surface, &contact);
                    // The body alone moves, and its mesh follows in the next substep.
                    if inverse_mass == 0.0 {
                        break;
                    }
                    surface.restitution = 0.0;
                }
            }
        }
    }

    fn contact(
        &self,
        path: &SubstepPath,
        inverse_mass: f32,
        (hit, rounding): (Hit, f32),
    ) -> BodyContact {
        BodyContact {
            start: path.start,
            displacement: path.displacement,
            predicted: if inverse_mass > 0.0 {
                Vec3::from_array(self.store.predicted(self.location))
            } else {
                path.displacement
            },
            inverse_mass,
            hit,
            rounding,
        }
    }

    fn respond(&mut self, surface: &BodySurface, contact: &BodyContact) {
        if let Some(body) = &mut self.collider.driven {
            let response = resolve(body, surface, contact);
            self.apply(&response, contact.inverse_mass);
        }
    }

    /// Lets the particle end where the contact pushes it, and continue with its displacement. The difference
    /// moves its position.
    fn apply(&mut self, response: &BodyResponse, inverse_mass: f32) {
        let BodyResponse { end, displacement, impulse, arm } = *response;
        self.reaction.add_impulse(impulse, arm);
        if inverse_mass > 0.0 {
            let start = end - displacement;
            self.store.set_path(self.location, start.to_array(), displacement.to_array());
        }
    }
}
