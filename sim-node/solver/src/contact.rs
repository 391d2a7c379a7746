//! Contacts: what is inside a collider is pushed out, rubs, and bounces.

use glam::Vec3;

use crate::colliders::{Collider, Moments};
use crate::particles::Particles;
use crate::scene::SceneCollider;
use crate::solid::{Hit, Solid, Way, solids};

/// The contacts of the running substep.
#[derive(Debug, Clone, Default)]
pub(crate) struct Contacts {
    /// Particles that touched something, in the order in which they first did.
    touched: Vec<u32>,
    is_touched: Vec<bool>,
    /// By particle: the velocity that its contacts leave it, but for the bounces.
    velocities: Vec<Vec3>,
    /// By particle: what its bounces add. Friction does not know of them: they are no way that was
    /// made in this substep.
    bounces: Vec<Vec3>,
}

/// The collider of a contact, in the running substep.
#[derive(Debug, Clone, Copy)]
struct Surface {
    linear: Vec3,
    angular: Vec3,
    pivot: Vec3,
    restitution: f32,
    friction: f32,
    /// Length of the substep in seconds.
    h: f32,
    /// Approach speeds up to this one end at rest: 2 |g| h, twice what gravity gives in a substep.
    rest_speed: f32,
}

/// How deep a place is inside of a collider at load; none where it is not, but for a rounding.
pub(crate) fn depth_at_load(
    scene: &SceneCollider,
    position: [f32; 3],
    is_planar: bool,
) -> Option<f32> {
    let moments = Moments { start: 0.0, end: 0.0 };
    let step = ContactStep { h: 1.0, rest_speed: 0.0, moments, is_planar };
    let way = Way { start: Vec3::from_array(position), displacement: Vec3::ZERO };
    let solids = solids(&Collider::new(scene), &step);
    let mut hits = solids.iter().flatten().filter_map(|solid| Some((solid, solid.hit(&way)?)));
    let (_, hit) = hits.find(|(solid, hit)| hit.depth > rounding(&way, solid))?;
    Some(hit.depth)
}

/// A particle inside of a solid.
struct Contact {
    hit: Hit,
    /// How far its place and the surface may be off by their rounding.
    rounding: f32,
}

/// How far numbers of the size of a way and a solid may be off, after a few roundings.
fn rounding(way: &Way, solid: &Solid) -> f32 {
    let size = way.start.abs().element_sum() + way.displacement.abs().element_sum();
    4.0 * f32::EPSILON * (size + solid.reach())
}

/// What all contacts of a substep have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactStep {
    pub(crate) h: f32,
    pub(crate) rest_speed: f32,
    pub(crate) moments: Moments,
    /// Bodies have no extent along z.
    pub(crate) is_planar: bool,
}

impl Contacts {
    pub(crate) fn new(particle_count: usize) -> Self {
        Self {
            touched: Vec::with_capacity(particle_count),
            is_touched: vec![false; particle_count],
            velocities: vec![Vec3::ZERO; particle_count],
            bounces: vec![Vec3::ZERO; particle_count],
        }
    }

    /// Pushes every free particle out of a collider.
    pub(crate) fn collide(
        &mut self,
        particles: &mut Particles,
        collider: &Collider,
        step: &ContactStep,
    ) {
        let surface = Surface::new(collider, step);
        for solid in solids(collider, step).iter().flatten() {
            for index in 0..particles.count() {
                if particles.positions[index][3] == 0.0 {
                    continue;
                }
                let way = Way {
                    start: vector(particles.positions[index]),
                    displacement: vector(particles.displacements[index]),
                };
                if let Some(hit) = solid.hit(&way) {
                    let rounding = rounding(&way, solid);
                    self.resolve(particles, index, &way, (&surface, &Contact { hit, rounding }));
                }
            }
        }
    }

    /// Takes back, from the new positions of what touched something, the rounding by which they
    /// are still inside of a collider.
    pub(crate) fn settle(
        &self,
        particles: &mut Particles,
        collider: &Collider,
        step: &ContactStep,
    ) {
        for solid in solids(collider, step).iter().flatten() {
            for index in self.touched.iter().map(|index| *index as usize) {
                let start = vector(particles.positions[index]);
                let Some(hit) = solid.hit(&Way { start, displacement: Vec3::ZERO }) else {
                    continue;
                };
                let displacement = vector(particles.displacements[index]);
                if hit.depth <= rounding(&Way { start, displacement }, solid) {
                    let [x, y, z] = (start + hit.normal * hit.depth).to_array();
                    particles.positions[index][..3].copy_from_slice(&[x, y, z]);
                }
            }
        }
    }

    /// Pushes one particle out, and works out the velocity that it goes on with.
    ///
    /// Friction acts on the displacement: the tangential one is shortened by at most friction times
    /// the depth gained in this substep, so that a particle on a slope stands still instead of
    /// creeping (Unified Particle Physics: Macklin et al. 2014, section 6.1). Restitution acts on
    /// the velocity, from the predicted approach speed (Detailed Rigid Body Simulation: Mueller et
    /// al. 2020, section 3.6). The push itself gives no speed.
    fn resolve(
        &mut self,
        particles: &mut Particles,
        index: usize,
        way: &Way,
        (surface, contact): (&Surface, &Contact),
    ) {
        let Hit { normal, depth } = contact.hit;
        let Surface { h, friction, restitution, rest_speed, .. } = *surface;
        let carried = surface.velocity_at(way.start + way.displacement + normal * depth);
        let moved =
            if self.is_touched[index] { self.velocities[index] } else { way.displacement / h };
        let relative = moved - carried;
        let normal_speed = relative.dot(normal);
        let sliding = relative - normal * normal_speed;
        // What rests above the surface by a rounding has come as far as it would from the surface.
        let depth_max = depth + contact.rounding;
        let gained = if -normal_speed * h < depth_max { -normal_speed * h } else { depth_max };
        let grip = friction * if gained > 0.0 { gained } else { 0.0 };
        let slide = sliding.length() * h;
        let kept = if slide > grip { sliding * (1.0 - grip / slide) } else { Vec3::ZERO };
        let approach = (carried - vector(particles.velocities[index])).dot(normal);
        let bounce = if approach > rest_speed { restitution * approach } else { 0.0 };
        let displacement = way.displacement + normal * depth - (sliding - kept) * h;
        particles.displacements[index] = displacement.extend(0.0).to_array();
        self.velocities[index] = carried + kept;
        self.bounces[index] += normal * bounce;
        if !std::mem::replace(&mut self.is_touched[index], true) {
            #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
            self.touched.push(index as u32);
        }
    }

    /// Gives the particles that touched something the velocities that their contacts leave them.
    pub(crate) fn finish(&mut self, particles: &mut Particles) {
        for index in self.touched.drain(..).map(|index| index as usize) {
            let velocity = self.velocities[index] + std::mem::take(&mut self.bounces[index]);
            particles.velocities[index] = velocity.extend(0.0).to_array();
            self.is_touched[index] = false;
        }
    }
}

impl ContactStep {
    /// The axes that a body has an extent along.
    pub(crate) fn axis_count(&self) -> usize {
        if self.is_planar { 2 } else { 3 }
    }
}

impl Surface {
    fn new(collider: &Collider, step: &ContactStep) -> Self {
        Self {
            linear: collider.linear,
            angular: collider.angular,
            pivot: collider.pivot(step.moments.end),
            restitution: collider.restitution,
            friction: collider.friction,
            h: step.h,
            rest_speed: step.rest_speed,
        }
    }

    /// The velocity of the collider's material at a point.
    fn velocity_at(&self, point: Vec3) -> Vec3 {
        self.linear + self.angular.cross(point - self.pivot)
    }
}

fn vector([x, y, z, _]: [f32; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}
