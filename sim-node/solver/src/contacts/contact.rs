//! Contacts: particles inside an obstacle are pushed out, slowed by friction, and bounced.

use std::ops::Range;

use glam::Vec3;

use super::hit::Hit;
use super::mesh::near::NearMeshes;
use super::mesh::{PUSHES_MAX, PlacedMesh, Stop};
use super::obstacle::{Obstacle, Surface, rounding};
use super::path::SubstepPath;
use super::solid::Solid;
use crate::kernels::lanes::Wide;
use crate::step::particle_block::ParticleBlock;
use crate::step::substep::SubstepInputs;

/// Contacts of a block of particles in one substep.
#[derive(Debug, Clone, Default)]
pub(crate) struct Contacts {
    /// Particles in contact, in the order of their first contact.
    touched: Vec<u32>,
    is_touched: Vec<bool>,
    /// By particle: the displacement that its contacts leave it, without bounces.
    displacements: Vec<Vec3>,
    /// By particle: the displacement that its bounces add. Friction ignores it, because the particle
    /// does not make it in this substep.
    bounces: Vec<Vec3>,
    near_meshes: NearMeshes,
}

/// Memory that the contacts of a worker need.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ContactRoom {
    /// Largest number of particles in a block; 0 in a scene without colliders.
    pub(crate) block_length: usize,
    /// Number of particles that can be near a mesh; 0 in a scene without meshes.
    pub(crate) near_mesh_count: usize,
}

/// A particle inside an obstacle.
struct Contact<'a> {
    index: usize,
    path: SubstepPath,
    hit: Hit,
    /// Bound on the rounding of the depth.
    rounding: f32,
    surface: &'a Surface,
    /// Part of the bounce along the normal that earlier contacts with the same mesh give.
    bounced: f32,
}

impl Contacts {
    pub(crate) fn new(room: ContactRoom) -> Self {
        let count = room.block_length;
        Self {
            touched: Vec::with_capacity(count),
            is_touched: vec![false; count],
            displacements: vec![Vec3::ZERO; count],
            bounces: vec![Vec3::ZERO; count],
            near_meshes: NearMeshes::new(room.near_mesh_count),
        }
    }

    /// Pushes free particles out of every obstacle, in order.
    #[inline(always)]
    pub(crate) fn push_out<W: Wide>(
        &mut self,
        particles: &mut impl ParticleBlock,
        inputs: &SubstepInputs<'_>,
    ) {
        for obstacle in inputs.obstacles {
            if inputs.is_given_up() {
                return;
            }
            for group in 0..particles.count().div_ceil(8) {
                if particles.may_touch::<W>(group, &obstacle.zone) {
                    let last = particles.count().min(8 * group + 8);
                    let range = 8 * group..last;
                    match &obstacle.solid {
                        // A long path through a large mesh takes milliseconds.
                        Solid::Mesh(_) if inputs.is_given_up() => return,
                        Solid::Mesh(mesh) => self.push_off(particles, range, obstacle, mesh),
                        _ => self.push_out_of(particles, range, obstacle),
                    }
                }
            }
        }
    }

    #[inline(never)]
    fn push_out_of(
        &mut self,
        particles: &mut impl ParticleBlock,
        range: Range<usize>,
        obstacle: &Obstacle,
    ) {
        for index in range {
            if particles.inverse_mass(index) == 0.0 {
                continue;
            }
            let path = particles.path(index);
            let (start, displacement) = (path.start.to_array(), path.displacement.to_array());
            // Very far away, the rounding of a path can be larger than the margin of the zone. So each
            // particle is tested alone, or the result would depend on the others of its group.
            if obstacle.zone.may_meet(start, displacement)
                && let Some(hit) = obstacle.solid.hit(&path)
            {
                let rounding = rounding(&path, &obstacle.solid);
                let surface = &obstacle.surface;
                let bounced = 0.0;
                self.resolve(particles, &Contact { index, path, hit, rounding, surface, bounced });
            }
        }
    }

    /// Pushes a group of particles off the triangles of a mesh, on the side on which they are.
    #[inline(never)]
    fn push_off(
        &mut self,
        particles: &mut impl ParticleBlock,
        range: Range<usize>,
        obstacle: &Obstacle,
        mesh: &PlacedMesh,
    ) {
        for index in range {
            let path = particles.path(index);
            let (start, displacement) = (path.start.to_array(), path.displacement.to_array());
            let is_near =
                particles.inverse_mass(index) > 0.0 && obstacle.zone.may_meet(start, displacement);
            if !is_near {
                continue;
            }
            let before = self.bounces[index];
            let mut room = mesh.room(&path);
            let number = particles.first() + index;
            let mut triangles = mesh.list(&mut self.near_meshes, number, &room);
            if triangles.are_none() {
                continue;
            }
            for push_count in 0..=PUSHES_MAX {
                let path = particles.path(index);
                if !mesh.is_within(&room, &path) {
                    room = mesh.room(&path);
                    triangles = mesh.list(&mut self.near_meshes, number, &room);
                }
                match mesh.stop(&path, &room, &triangles, push_count) {
                    None => break,
                    Some(Stop::Hold) => {
                        self.hold(particles, (index, &path), &obstacle.surface, mesh);
                        break;
                    }
                    Some(Stop::Push(hit)) => {
                        let (rounding, surface) = (mesh.rounding(), &obstacle.surface);
                        let bounced = (self.bounces[index] - before).dot(hit.normal);
                        let contact = Contact { index, path, hit, rounding, surface, bounced };
                        self.resolve(particles, &contact);
                    }
                }
            }
        }
    }

    /// Moves a particle with the mesh that leaves it no room.
    fn hold(
        &mut self,
        particles: &mut impl ParticleBlock,
        (index, path): (usize, &SubstepPath),
        surface: &Surface,
        mesh: &PlacedMesh,
    ) {
        let displacement = mesh.held_displacement(path.start);
        particles.set_displacement(index, displacement);
        self.displacements[index] = surface.displacement_at(path.start + displacement);
        self.touch(index);
    }

    /// Pushes one particle out, and computes the displacement with which it continues.
    ///
    /// Friction acts on the displacement: the tangential part is shortened by at most friction times
    /// the depth gained in this substep, so that a particle on a slope stays at rest instead of
    /// creeping (Unified Particle Physics: Macklin et al. 2014, section 6.1). Restitution acts on
    /// the predicted approach (Detailed Rigid Body Simulation: Mueller et al. 2020, section 3.6).
    /// The push itself adds no speed.
    fn resolve(&mut self, particles: &mut impl ParticleBlock, contact: &Contact<'_>) {
        let Contact { index, path, hit: Hit { normal, depth }, rounding, surface, bounced } =
            *contact;
        let carried = surface.displacement_at(path.start + path.displacement + normal * depth);
        let before =
            if self.is_touched[index] { self.displacements[index] } else { path.displacement };
        let relative = before - carried;
        let out = relative.dot(normal);
        let sliding = relative - normal * out;
        // A particle that rests above the surface by a rounding gains as much depth as one on it.
        let depth_max = depth + rounding;
        let gained = if -out < depth_max { -out } else { depth_max };
        let friction = surface.friction * if gained > 0.0 { gained } else { 0.0 };
        let slide = sliding.length();
        let kept = if slide > friction { sliding * (1.0 - friction / slide) } else { Vec3::ZERO };
        let approach = (carried - particles.predicted(index)).dot(normal);
        let is_bouncing = approach > surface.rest_distance;
        let bounce = if is_bouncing {
            surface.restitution * surface.rebound(approach, depth, normal) - bounced
        } else {
            0.0
        };
        let displacement = path.displacement + normal * depth - (sliding - kept);
        particles.set_displacement(index, displacement);
        self.displacements[index] = carried + kept;
        self.bounces[index] += normal * if bounce > 0.0 { bounce } else { 0.0 };
        self.touch(index);
    }

    fn touch(&mut self, index: usize) {
        if !std::mem::replace(&mut self.is_touched[index], true) {
            #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
            self.touched.push(index as u32);
        }
    }

    /// After the particles have advanced: moves those in contact out of the obstacles by the
    /// rounding that is left, and gives them the displacements with which they continue.
    #[inline(always)]
    pub(crate) fn correct_touched(
        &mut self,
        particles: &mut impl ParticleBlock,
        inputs: &SubstepInputs<'_>,
    ) {
        if !self.touched.is_empty() {
            self.correct_all_touched(particles, inputs);
        }
    }

    #[inline(never)]
    fn correct_all_touched(
        &mut self,
        particles: &mut impl ParticleBlock,
        inputs: &SubstepInputs<'_>,
    ) {
        for Obstacle { solid, .. } in inputs.obstacles {
            if inputs.is_given_up() {
                return;
            }
            for index in self.touched.iter().map(|index| *index as usize) {
                let path = particles.path(index);
                let at_end = SubstepPath { displacement: Vec3::ZERO, ..path };
                let Some(hit) = solid.hit(&at_end) else {
                    continue;
                };
                if hit.depth <= rounding(&path, solid) {
                    particles.set_position(index, path.start + hit.normal * hit.depth);
                }
            }
        }
        for index in self.touched.drain(..).map(|index| index as usize) {
            let displacement = self.displacements[index] + std::mem::take(&mut self.bounces[index]);
            particles.set_displacement(index, displacement);
            self.is_touched[index] = false;
        }
    }
}
