//! Contacts: what is inside a collider is pushed out, rubs, and bounces.

use std::ops::Range;

use glam::Vec3;

use crate::colliders::{Collider, Moments};
use crate::kernels::Wide;
use crate::scene::SceneCollider;
use crate::solid::{Hit, Solid, Way, Zone, solids};

/// Particles side by side, as contacts see and move them.
pub(crate) trait Cells {
    fn count(&self) -> usize;
    fn inverse_mass(&self, index: usize) -> f32;
    /// Position and displacement.
    fn way(&self, index: usize) -> Way;
    /// The displacement before any constraint or contact.
    fn predicted(&self, index: usize) -> Vec3;
    fn set_displacement(&mut self, index: usize, displacement: Vec3);
    fn set_position(&mut self, index: usize, position: Vec3);
    /// Whether any of the particles 8 `eight`, ..., 8 `eight` + 7 may be in a zone.
    fn may_touch<W: Wide>(&self, eight: usize, zone: &Zone) -> bool;
    /// x += d.
    fn advance<W: Wide>(&mut self);
}

/// The contacts of some particles in the running substep.
#[derive(Debug, Clone, Default)]
pub(crate) struct Contacts {
    /// Particles that touched something, in the order in which they first did.
    touched: Vec<u32>,
    is_touched: Vec<bool>,
    /// By particle: the displacement that its contacts leave it, but for the bounces.
    ways: Vec<Vec3>,
    /// By particle: what its bounces add to that. Friction does not know of them: they are no way
    /// that was made in this substep.
    bounces: Vec<Vec3>,
}

/// A collider as the particles of a substep meet it; of bounds, one face.
#[derive(Debug, Clone)]
pub(crate) struct Obstacle {
    surface: Surface,
    solid: Solid,
    zone: Zone,
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
    /// Approaches by up to this way end at rest: 2 |g| h^2, twice what gravity gives in a substep.
    rest_way: f32,
}

/// Most obstacles that a collider is: bounds have six faces.
pub(crate) const OBSTACLES_PER_COLLIDER: usize = 6;

/// What the particles of a substep meet, in the order in which they meet it.
pub(crate) fn place_obstacles(
    obstacles: &mut Vec<Obstacle>,
    colliders: &[Collider],
    step: &ContactStep,
) {
    obstacles.clear();
    for collider in colliders {
        let surface = Surface::new(collider, step);
        for solid in solids(collider, step).into_iter().flatten() {
            let zone = solid.zone();
            obstacles.push(Obstacle { surface, solid, zone });
        }
    }
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
    /// Room for so many particles side by side; none where there are no colliders.
    pub(crate) fn new(count: usize) -> Self {
        Self {
            touched: Vec::with_capacity(count),
            is_touched: vec![false; count],
            ways: vec![Vec3::ZERO; count],
            bounces: vec![Vec3::ZERO; count],
        }
    }

    /// Ends a substep: what is inside of an obstacle is pushed out, everything takes its way, and
    /// what touched something goes on with the displacement that its contacts leave it.
    #[inline(always)]
    pub(crate) fn end_substep<W: Wide>(&mut self, cells: &mut impl Cells, obstacles: &[Obstacle]) {
        for obstacle in obstacles {
            for eight in 0..cells.count().div_ceil(8) {
                if cells.may_touch::<W>(eight, &obstacle.zone) {
                    let last = cells.count().min(8 * eight + 8);
                    self.collide(cells, 8 * eight..last, obstacle);
                }
            }
        }
        cells.advance::<W>();
        if !self.touched.is_empty() {
            self.part(cells, obstacles);
        }
    }

    /// Pushes free particles out of an obstacle.
    #[inline(never)]
    fn collide(&mut self, cells: &mut impl Cells, range: Range<usize>, obstacle: &Obstacle) {
        for index in range {
            if cells.inverse_mass(index) == 0.0 {
                continue;
            }
            let way = cells.way(index);
            if let Some(hit) = obstacle.solid.hit(&way) {
                let rounding = rounding(&way, &obstacle.solid);
                self.resolve(cells, index, &way, (&obstacle.surface, &Contact { hit, rounding }));
            }
        }
    }

    /// Takes back, from the new positions of what touched something, the rounding by which they
    /// are still inside of an obstacle, and gives them the displacements that their contacts leave
    /// them.
    #[inline(never)]
    fn part(&mut self, cells: &mut impl Cells, obstacles: &[Obstacle]) {
        for Obstacle { solid, .. } in obstacles {
            for index in self.touched.iter().map(|index| *index as usize) {
                let Way { start, displacement } = cells.way(index);
                let Some(hit) = solid.hit(&Way { start, displacement: Vec3::ZERO }) else {
                    continue;
                };
                if hit.depth <= rounding(&Way { start, displacement }, solid) {
                    cells.set_position(index, start + hit.normal * hit.depth);
                }
            }
        }
        for index in self.touched.drain(..).map(|index| index as usize) {
            let way = self.ways[index] + std::mem::take(&mut self.bounces[index]);
            cells.set_displacement(index, way);
            self.is_touched[index] = false;
        }
    }

    /// Pushes one particle out, and works out the displacement that it goes on with.
    ///
    /// Friction acts on the displacement: the tangential one is shortened by at most friction times
    /// the depth gained in this substep, so that a particle on a slope stands still instead of
    /// creeping (Unified Particle Physics: Macklin et al. 2014, section 6.1). Restitution acts on
    /// the predicted approach (Detailed Rigid Body Simulation: Mueller et al. 2020, section 3.6).
    /// The push itself gives no speed.
    fn resolve(
        &mut self,
        cells: &mut impl Cells,
        index: usize,
        way: &Way,
        (surface, contact): (&Surface, &Contact),
    ) {
        let Hit { normal, depth } = contact.hit;
        let carried = surface.way_of(way.start + way.displacement + normal * depth);
        let moved = if self.is_touched[index] { self.ways[index] } else { way.displacement };
        let relative = moved - carried;
        let out = relative.dot(normal);
        let sliding = relative - normal * out;
        // What rests above the surface by a rounding has come as far as it would from the surface.
        let depth_max = depth + contact.rounding;
        let gained = if -out < depth_max { -out } else { depth_max };
        let grip = surface.friction * if gained > 0.0 { gained } else { 0.0 };
        let slide = sliding.length();
        let kept = if slide > grip { sliding * (1.0 - grip / slide) } else { Vec3::ZERO };
        let approach = (carried - cells.predicted(index)).dot(normal);
        let bounce = if approach > surface.rest_way { surface.restitution * approach } else { 0.0 };
        cells.set_displacement(index, way.displacement + normal * depth - (sliding - kept));
        self.ways[index] = carried + kept;
        self.bounces[index] += normal * bounce;
        if !std::mem::replace(&mut self.is_touched[index], true) {
            #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
            self.touched.push(index as u32);
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
            rest_way: step.rest_speed * step.h,
        }
    }

    /// How far the collider's material at a point comes in a substep.
    fn way_of(&self, point: Vec3) -> Vec3 {
        (self.linear + self.angular.cross(point - self.pivot)) * self.h
    }
}
