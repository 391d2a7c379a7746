//! Contacts: particles inside an obstacle are pushed out, slowed by friction, and bounced.

mod correction;
pub(crate) mod reaction;
mod response;

use correction::{Advanced, corrected};
use glam::Vec3;
use reaction::{BlockReaction, LaneContacts, LaneReaction, Reaction, ReactionRoom, Reactions};
use response::{Contact, respond};

use super::hit::{Hit, LaneHit};
use super::mesh::near::NearMeshes;
use super::mesh::{PUSHES_MAX, PlacedMesh, Stop};
use super::obstacle::{Obstacle, Surface, rounding};
use super::path::{LanePath, SubstepPath};
use super::solid::Solid;
use super::solid::lane_solid::LaneSolid;
use crate::kernels::lanes::{Lanes8, Wide};
use crate::kernels::vectors::{difference, lane_of, load, masked, select, set_lane, store, sum};
use crate::step::particle_block::ParticleBlock;
use crate::step::substep::SubstepInputs;

/// Contacts of a block of particles in one substep.
#[derive(Debug, Clone, Default)]
pub(crate) struct Contacts {
    /// Groups of eight with a particle in contact, in the order of their first contact.
    touched: Vec<usize>,
    groups: Vec<GroupContacts>,
    near_meshes: NearMeshes,
    /// The reactions of all blocks of the worker.
    pub(crate) reactions: Reactions,
}

/// Contacts of eight particles.
#[derive(Debug, Clone, Default)]
struct GroupContacts {
    /// 1 for a particle in contact, else 0.
    touched: Lanes8,
    /// The displacement that the contacts of a particle leave it, without bounces. Any numbers for particles
    /// that are not in contact.
    displacements: [Lanes8; 3],
    /// The displacement that its bounces add. Friction ignores it, because the particle does not make
    /// it in this substep.
    bounces: [Lanes8; 3],
}

/// Memory that the contacts of a worker need.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ContactRoom {
    /// Largest number of particles in a block; 0 in a scene without colliders.
    pub(crate) block_length: usize,
    /// Number of particles that can be near a mesh; 0 in a scene without meshes.
    pub(crate) near_mesh_count: usize,
    pub(crate) reactions: ReactionRoom,
}

/// A particle inside an obstacle.
struct SingleContact<'a> {
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
        let count = room.block_length.div_ceil(8);
        Self {
            touched: Vec::with_capacity(count),
            groups: vec![GroupContacts::default(); count],
            near_meshes: NearMeshes::new(room.near_mesh_count),
            reactions: Reactions::new(room.reactions),
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
            let mut block = self.reactions.begin_block();
            let reaction = block.as_mut();
            match &obstacle.solid {
                Solid::HalfSpace(half_space) => {
                    self.push_groups_out::<W>(particles, (obstacle, half_space), reaction);
                }
                Solid::Sphere(sphere) => {
                    self.push_groups_out::<W>(particles, (obstacle, sphere), reaction);
                }
                Solid::Capsule { .. } | Solid::Box { .. } => {
                    let reaction = reaction.map(|reaction| &mut reaction.single);
                    self.push_each_out::<W>(particles, obstacle, reaction);
                }
                Solid::Mesh(mesh) => {
                    let reaction = reaction.map(|reaction| &mut reaction.single);
                    self.push_each_off::<W>(particles, (obstacle, mesh), inputs, reaction);
                }
            }
            if let Some(block) = block {
                self.reactions.add(obstacle.collider, &block);
            }
        }
    }

    /// Pushes particles out of a solid, eight at a time.
    #[inline(always)]
    fn push_groups_out<W: Wide>(
        &mut self,
        particles: &mut impl ParticleBlock,
        (obstacle, solid): (&Obstacle, &impl LaneSolid),
        reaction: Option<&mut BlockReaction>,
    ) {
        let Obstacle { surface, zone, .. } = obstacle;
        let (zero, reach) = (W::splat(0.0), obstacle.solid.reach());
        let mut sums = LaneReaction::<W>::new();
        for group in 0..particles.group_count() {
            let path = particles.paths::<W>(group);
            let is_free = zero.is_below(particles.inverse_masses::<W>(group));
            if !W::any(W::both(solid.is_inside(&path), is_free)) {
                continue;
            }
            let LaneHit { is_hit, normal, depth } = solid.hit(&path);
            // Very far away, the rounding of a path can be larger than the margin of the zone. So each
            // particle is tested alone, or the result would depend on the others of its group.
            let may_meet = zone.may_meet(path.start, path.displacement);
            let is_hit = W::both(W::both(is_hit, may_meet), is_free);
            if !W::any(is_hit) {
                continue;
            }
            let eight = &mut self.groups[group];
            let touched = W::load(&eight.touched, 0);
            let is_touched = zero.is_below(touched);
            if !W::any(is_touched) {
                self.touched.push(group);
            }
            let left = load(&eight.displacements);
            let before = select::<W>(is_touched, left, path.displacement);
            let (rounding, bounced) = (rounding(&path, reach), zero);
            let predicted = particles.predicted_lanes::<W>(group);
            let contact = Contact { path, normal, depth, rounding, before, predicted, bounced };
            let response = respond(surface, &contact);
            let displacement = select::<W>(is_hit, response.displacement, path.displacement);
            particles.set_displacements(group, displacement);
            store(select::<W>(is_hit, response.left, left), &mut eight.displacements);
            let bounce = masked(response.bounce, is_hit);
            store(sum(load::<W>(&eight.bounces), bounce), &mut eight.bounces);
            W::select(is_hit, W::splat(1.0), touched).store(&mut eight.touched, 0);
            if reaction.is_some() {
                let lost = difference(difference(before, response.left), bounce);
                let inverse_mass = particles.inverse_masses::<W>(group);
                let position = sum(path.start, displacement);
                sums.add(&LaneContacts { is_hit, inverse_mass, lost, position }, surface.pivot);
            }
        }
        if let Some(reaction) = reaction {
            sums.add_to(reaction);
        }
    }

    /// Pushes particles out of a box or capsule, one by one.
    #[inline(always)]
    fn push_each_out<W: Wide>(
        &mut self,
        particles: &mut impl ParticleBlock,
        obstacle: &Obstacle,
        mut reaction: Option<&mut Reaction>,
    ) {
        for group in 0..particles.group_count() {
            if may_touch::<W>(particles, group, obstacle) {
                self.push_group_out(particles, group, obstacle, reaction.as_deref_mut());
            }
        }
    }

    /// Pushes particles off a mesh, one by one.
    #[inline(always)]
    fn push_each_off<W: Wide>(
        &mut self,
        particles: &mut impl ParticleBlock,
        (obstacle, mesh): (&Obstacle, &PlacedMesh),
        inputs: &SubstepInputs<'_>,
        mut reaction: Option<&mut Reaction>,
    ) {
        for group in 0..particles.group_count() {
            if !may_touch::<W>(particles, group, obstacle) {
                continue;
            }
            // A long path through a large mesh takes milliseconds.
            if inputs.is_given_up() {
                return;
            }
            self.push_off(particles, group, (obstacle, mesh), reaction.as_deref_mut());
        }
    }

    /// Pushes the particles of a group out of a box or capsule, one by one.
    #[inline(never)]
    fn push_group_out(
        &mut self,
        particles: &mut impl ParticleBlock,
        group: usize,
        obstacle: &Obstacle,
        mut reaction: Option<&mut Reaction>,
    ) {
        for index in 8 * group..8 * group + 8 {
            if particles.inverse_mass(index) == 0.0 {
                continue;
            }
            let path = particles.path(index);
            let (start, displacement) = (path.start.to_array(), path.displacement.to_array());
            // As in `push_groups_out`.
            if obstacle.zone.may_meet(start, displacement)
                && let Some(hit) = obstacle.solid.hit(&path)
            {
                let rounding = rounding(&LanePath::from(&path), obstacle.solid.reach());
                let (surface, bounced) = (&obstacle.surface, 0.0);
                let contact = SingleContact { index, path, hit, rounding, surface, bounced };
                self.resolve(particles, &contact, reaction.as_deref_mut());
                count(reaction.as_deref_mut());
            }
        }
    }

    /// Pushes a group of particles off the triangles of a mesh, on the side on which they are.
    #[inline(never)]
    fn push_off(
        &mut self,
        particles: &mut impl ParticleBlock,
        group: usize,
        (obstacle, mesh): (&Obstacle, &PlacedMesh),
        mut reaction: Option<&mut Reaction>,
    ) {
        let mut lists = std::mem::take(&mut self.near_meshes);
        for index in 8 * group..8 * group + 8 {
            let path = particles.path(index);
            let (start, displacement) = (path.start.to_array(), path.displacement.to_array());
            let is_near =
                particles.inverse_mass(index) > 0.0 && obstacle.zone.may_meet(start, displacement);
            if is_near {
                let mesh = (&obstacle.surface, mesh, &mut lists);
                self.push_path_off(particles, (index, path), mesh, reaction.as_deref_mut());
            }
        }
        self.near_meshes = lists;
    }

    /// Pushes a particle off the triangles of a mesh.
    #[inline(always)]
    fn push_path_off(
        &mut self,
        particles: &mut impl ParticleBlock,
        (index, mut path): (usize, SubstepPath),
        (surface, mesh, lists): (&Surface, &PlacedMesh, &mut NearMeshes),
        mut reaction: Option<&mut Reaction>,
    ) {
        let before = self.bounce(index);
        let number = particles.first() + index;
        let mut relative = mesh.path(&path);
        let mut around = mesh.surroundings(lists, number, &relative);
        if around.are_free() {
            return;
        }
        for push_count in 0..=PUSHES_MAX {
            let stop = mesh.stop(&relative, &around, push_count);
            if stop.is_some() && push_count == 0 {
                count(reaction.as_deref_mut());
            }
            match stop {
                None => break,
                Some(Stop::Hold) => {
                    self.hold(particles, (index, &path), (surface, mesh), reaction);
                    break;
                }
                Some(Stop::Push(hit)) => {
                    let rounding = mesh.rounding();
                    let bounced = (self.bounce(index) - before).dot(hit.normal);
                    let contact = SingleContact { index, path, hit, rounding, surface, bounced };
                    self.resolve(particles, &contact, reaction.as_deref_mut());
                }
            }
            path = particles.path(index);
            relative = mesh.path(&path);
            if !around.contain_end(&relative) {
                around = mesh.surroundings(lists, number, &relative);
            }
        }
    }

    /// Moves a particle with the mesh that leaves it no room.
    fn hold(
        &mut self,
        particles: &mut impl ParticleBlock,
        (index, path): (usize, &SubstepPath),
        (surface, mesh): (&Surface, &PlacedMesh),
        reaction: Option<&mut Reaction>,
    ) {
        let displacement = mesh.held_displacement(path.start);
        let before = self.left(index).unwrap_or(path.displacement);
        particles.set_displacement(index, displacement);
        let position = path.start + displacement;
        let left = surface.displacement_at(position.to_array());
        set_lane(&mut self.groups[index / 8].displacements, index % 8, left);
        self.touch(index);
        if let Some(reaction) = reaction {
            let (mass, lost) = (1.0 / particles.inverse_mass(index), before - Vec3::from(left));
            reaction.add(mass, lost, position - surface.pivot);
        }
    }

    /// Pushes one particle out.
    fn resolve(
        &mut self,
        particles: &mut impl ParticleBlock,
        contact: &SingleContact<'_>,
        reaction: Option<&mut Reaction>,
    ) {
        let SingleContact { index, path, hit: Hit { normal, depth }, rounding, surface, bounced } =
            *contact;
        let (group, lane) = (index / 8, index % 8);
        let before = self.left(index).unwrap_or(path.displacement);
        let response = respond(
            surface,
            &Contact {
                path: LanePath::from(&path),
                normal: normal.to_array(),
                depth,
                rounding,
                before: before.to_array(),
                predicted: particles.predicted(index).to_array(),
                bounced,
            },
        );
        let displacement = Vec3::from_array(response.displacement);
        particles.set_displacement(index, displacement);
        let eight = &mut self.groups[group];
        set_lane(&mut eight.displacements, lane, response.left);
        let bounce = sum(lane_of(&eight.bounces, lane), response.bounce);
        set_lane(&mut eight.bounces, lane, bounce);
        self.touch(index);
        if let Some(reaction) = reaction {
            let after = Vec3::from_array(sum(response.left, response.bounce));
            let (mass, position) = (1.0 / particles.inverse_mass(index), path.start + displacement);
            reaction.add(mass, before - after, position - surface.pivot);
        }
    }

    /// Displacement that earlier contacts leave a particle, without bounces. None before the first one.
    fn left(&self, index: usize) -> Option<Vec3> {
        let eight = &self.groups[index / 8];
        let is_touched = eight.touched[index % 8] > 0.0;
        is_touched.then(|| Vec3::from_array(lane_of(&eight.displacements, index % 8)))
    }

    /// Displacement that the bounces of a particle add.
    fn bounce(&self, index: usize) -> Vec3 {
        Vec3::from_array(lane_of(&self.groups[index / 8].bounces, index % 8))
    }

    fn touch(&mut self, index: usize) {
        let (group, lane) = (index / 8, index % 8);
        if self.groups[group].touched == [0.0; 8] {
            self.touched.push(group);
        }
        self.groups[group].touched[lane] = 1.0;
    }

    /// After the particles have advanced: moves those in contact out of the obstacles by the
    /// rounding that is left, and gives them the displacements with which they continue.
    #[inline(always)]
    pub(crate) fn correct_touched<W: Wide>(
        &mut self,
        particles: &mut impl ParticleBlock,
        inputs: &SubstepInputs<'_>,
    ) {
        for group in self.touched.drain(..) {
            if inputs.is_given_up() {
                return;
            }
            let eight = &mut self.groups[group];
            let touched = W::splat(0.0).is_below(W::load(&eight.touched, 0));
            let mut path = particles.paths::<W>(group);
            for Obstacle { solid, .. } in inputs.obstacles {
                path.start = corrected(solid, &Advanced { path, touched: &eight.touched });
            }
            let after = sum(load(&eight.displacements), load(&eight.bounces));
            path.displacement = select::<W>(touched, after, path.displacement);
            particles.set_paths(group, &path);
            (eight.touched, eight.bounces) = ([0.0; 8], [[0.0; 8]; 3]);
        }
    }
}

/// Counts a particle in contact.
fn count(reaction: Option<&mut Reaction>) {
    if let Some(reaction) = reaction {
        reaction.contacts += 1;
    }
}

/// True if a free particle of a group may enter the zone of an obstacle.
#[inline(always)]
fn may_touch<W: Wide>(particles: &impl ParticleBlock, group: usize, obstacle: &Obstacle) -> bool {
    let LanePath { start, displacement } = particles.paths::<W>(group);
    let is_free = W::splat(0.0).is_below(particles.inverse_masses(group));
    W::any(W::both(obstacle.zone.may_meet(start, displacement), is_free))
}
