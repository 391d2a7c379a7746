//! Contacts: what is inside a collider is pushed out, rubs, and bounces.

use glam::{Quat, Vec3};

use crate::colliders::{Body, Collider, Moments};
use crate::particles::Particles;

/// The contacts of the running substep.
#[derive(Debug, Clone, Default)]
pub(crate) struct Contacts {
    /// Particles that touched something, in the order in which they first did.
    touched: Vec<u32>,
    is_touched: Vec<bool>,
    /// By particle: the velocity that its contacts leave it.
    velocities: Vec<Vec3>,
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

/// What all contacts of a substep have in common.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactStep {
    pub(crate) h: f32,
    pub(crate) rest_speed: f32,
    pub(crate) moments: Moments,
    /// Bodies have no extent along z.
    pub(crate) is_planar: bool,
}

/// Where a particle leaves a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Hit {
    /// Out of the collider, of length 1.
    normal: Vec3,
    /// How far inside it is along the normal, > 0.
    depth: f32,
}

/// The way of a particle in a substep.
#[derive(Debug, Clone, Copy)]
struct Way {
    /// x.
    start: Vec3,
    /// d.
    displacement: Vec3,
}

impl Contacts {
    pub(crate) fn new(particle_count: usize) -> Self {
        Self {
            touched: Vec::with_capacity(particle_count),
            is_touched: vec![false; particle_count],
            velocities: vec![Vec3::ZERO; particle_count],
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
                    self.resolve(particles, index, &way, (&surface, &hit));
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
                let rounding = 4.0 * f32::EPSILON * (start.abs().element_sum() + solid.reach());
                if hit.depth <= rounding {
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
        (surface, hit): (&Surface, &Hit),
    ) {
        let Hit { normal, depth } = *hit;
        let Surface { h, friction, restitution, rest_speed, .. } = *surface;
        let carried = surface.velocity_at(way.start + way.displacement + normal * depth);
        let moved =
            if self.is_touched[index] { self.velocities[index] } else { way.displacement / h };
        let relative = moved - carried;
        let normal_speed = relative.dot(normal);
        let sliding = relative - normal * normal_speed;
        let gained = if -normal_speed * h < depth { -normal_speed * h } else { depth };
        let grip = friction * if gained > 0.0 { gained } else { 0.0 };
        let slide = sliding.length() * h;
        let kept = if slide > grip { sliding * (1.0 - grip / slide) } else { Vec3::ZERO };
        let approach = (carried - vector(particles.velocities[index])).dot(normal);
        let bounce = if approach > rest_speed { restitution * approach } else { 0.0 };
        let displacement = way.displacement + normal * depth - (sliding - kept) * h;
        particles.displacements[index] = displacement.extend(0.0).to_array();
        self.velocities[index] = carried + kept + normal * bounce;
        if !std::mem::replace(&mut self.is_touched[index], true) {
            #[allow(clippy::cast_possible_truncation, reason = "at most 2^24 particles")]
            self.touched.push(index as u32);
        }
    }

    /// Gives the particles that touched something the velocities that their contacts leave them.
    pub(crate) fn finish(&mut self, particles: &mut Particles) {
        for index in self.touched.drain(..).map(|index| index as usize) {
            particles.velocities[index] = self.velocities[index].extend(0.0).to_array();
            self.is_touched[index] = false;
        }
    }
}

impl ContactStep {
    /// The axes that a body has an extent along.
    fn axis_count(&self) -> usize {
        if self.is_planar { 2 } else { 3 }
    }
}

impl Surface {
    fn new(collider: &Collider, step: &ContactStep) -> Self {
        Self {
            linear: collider.linear,
            angular: collider.angular,
            pivot: collider.body(step.moments.end).pivot(),
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

/// Everything that a particle can be inside of, where it is at the end of a substep.
enum Solid {
    HalfSpace { normal: Vec3, offset: f32 },
    Ball { center: Vec3, radius: f32 },
    Capsule { ends: [Vec3; 2], radius: f32 },
    Block { block: Block, now: Axes, before: Axes },
}

/// The solids of a collider: one, or a half-space for each face of bounds.
fn solids(collider: &Collider, step: &ContactStep) -> [Option<Solid>; 6] {
    let body = collider.body(step.moments.end);
    let one = |solid| [Some(solid), None, None, None, None, None];
    match body {
        Body::Plane { normal, offset } => one(Solid::HalfSpace { normal, offset }),
        Body::Sphere { center, radius } => one(Solid::Ball { center, radius }),
        Body::Capsule { a, b, radius } => one(Solid::Capsule { ends: [a, b], radius }),
        Body::Box { center, half_extents, rotation } => one(Solid::Block {
            block: Block::new(half_extents.to_array(), step.axis_count(), center),
            now: Axes::new(center, rotation),
            before: match collider.body(step.moments.start) {
                Body::Box { center, rotation, .. } => Axes::new(center, rotation),
                _ => Axes::new(center, rotation),
            },
        }),
        Body::Bounds { min, max } => {
            let face = |axis: usize, normal: Vec3| {
                let low = Solid::HalfSpace { normal, offset: min[axis] };
                let high = Solid::HalfSpace { normal: -normal, offset: -max[axis] };
                if axis < step.axis_count() { [Some(low), Some(high)] } else { [None, None] }
            };
            let [a, b] = face(0, Vec3::X);
            let [c, d] = face(1, Vec3::Y);
            let [e, f] = face(2, Vec3::Z);
            [a, b, c, d, e, f]
        }
    }
}

impl Solid {
    /// Where a particle leaves it, if its way ends inside or, for a box, passes through it.
    fn hit(&self, way: &Way) -> Option<Hit> {
        match self {
            Self::HalfSpace { normal, offset } => hit_half_space(way, *normal, *offset),
            Self::Ball { center, radius } => hit_ball(way, *center, *radius, Vec3::Y),
            Self::Capsule { ends, radius } => hit_capsule(way, *ends, *radius),
            Self::Block { block, now, before } => {
                let (start, end) = (before.local(way.start), now.local_end(way));
                let (face, depth) = block.hit(start.to_array(), end.to_array())?;
                Some(Hit { normal: now.face_normal(face), depth })
            }
        }
    }

    /// The size of its numbers, for what their rounding may be.
    fn reach(&self) -> f32 {
        match self {
            Self::HalfSpace { offset, .. } => offset.abs(),
            Self::Ball { center, radius } => center.abs().element_sum() + radius,
            Self::Capsule { ends: [a, b], radius } => {
                a.abs().element_sum() + b.abs().element_sum() + radius
            }
            Self::Block { block, .. } => block.reach,
        }
    }
}

/// The displacement is added last: near the surface, the rest is exact, and it keeps its digits.
fn hit_half_space(way: &Way, normal: Vec3, offset: f32) -> Option<Hit> {
    let height = (normal.dot(way.start) - offset) + normal.dot(way.displacement);
    (height < 0.0).then_some(Hit { normal, depth: -height })
}

/// `fallback` is the way out of the very middle.
fn hit_ball(way: &Way, center: Vec3, radius: f32, fallback: Vec3) -> Option<Hit> {
    let arm = (way.start - center) + way.displacement;
    let square = arm.dot(arm);
    // A number that is not one compares false, and touches nothing.
    let is_inside = square < radius * radius;
    if !is_inside {
        return None;
    }
    let distance = square.sqrt();
    let normal = if square < f32::MIN_POSITIVE { fallback } else { arm / distance };
    (distance < radius).then_some(Hit { normal, depth: radius - distance })
}

fn hit_capsule(way: &Way, [a, b]: [Vec3; 2], radius: f32) -> Option<Hit> {
    let axis = b - a;
    let square = axis.dot(axis);
    let along =
        if square > 0.0 { (way.start + way.displacement - a).dot(axis) / square } else { 0.0 };
    let share = along.clamp(0.0, 1.0);
    // Across the axis, and in the plane of a 2-D scene.
    let across = Vec3::new(-axis.y, axis.x, 0.0);
    let fallback = if across == Vec3::ZERO { Vec3::X } else { across.normalize() };
    hit_ball(way, a + axis * share, radius, fallback)
}

/// A face of a box: its axis, and the side of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Face {
    axis: usize,
    sign: f32,
}

/// The faces of a box, in the order in which ties are decided.
const FACES: [(usize, f32); 6] = [(0, 1.0), (1, 1.0), (2, 1.0), (0, -1.0), (1, -1.0), (2, -1.0)];

/// A box in its own axes, of which a 2-D scene has two.
struct Block {
    extents: [f32; 3],
    axis_count: usize,
    /// The size of its numbers.
    reach: f32,
}

impl Block {
    fn new(extents: [f32; 3], axis_count: usize, center: Vec3) -> Self {
        let reach = Vec3::from_array(extents).element_sum() + center.abs().element_sum();
        Self { extents, axis_count, reach }
    }

    /// Where a way leaves the box: by the face through which it came in, or by the nearest one
    /// where it began inside. Also where it has come out again on another side: nothing passes
    /// through a thin box.
    fn hit(&self, start: [f32; 3], end: [f32; 3]) -> Option<(Face, f32)> {
        let start = self.out_of_skin(start);
        let face = if !self.is_inside(start) {
            self.entered_face(start, end)?
        } else if self.is_inside(end) {
            self.nearest_face(end)?
        } else {
            return None;
        };
        let depth = self.depth(face, end);
        (depth > 0.0).then_some((face, depth))
    }

    fn faces(&self) -> impl Iterator<Item = Face> {
        let faces = FACES.into_iter().map(|(axis, sign)| Face { axis, sign });
        faces.filter(|face| face.axis < self.axis_count)
    }

    fn depth(&self, face: Face, point: [f32; 3]) -> f32 {
        self.extents[face.axis] - face.sign * point[face.axis]
    }

    fn is_inside(&self, point: [f32; 3]) -> bool {
        (0..self.axis_count).all(|axis| point[axis].abs() < self.extents[axis])
    }

    fn nearest_face(&self, point: [f32; 3]) -> Option<Face> {
        let depth = |face| self.depth(face, point);
        self.faces().reduce(|best, face| if depth(face) < depth(best) { face } else { best })
    }

    /// A point just below the surface, on it: else what lies on a thin box could be pulled through
    /// it from the inside.
    fn out_of_skin(&self, mut point: [f32; 3]) -> [f32; 3] {
        let skin = 2.0 * f32::EPSILON * self.reach;
        if self.is_inside(point)
            && let Some(face) = self.nearest_face(point)
            && self.depth(face, point) < skin
        {
            point[face.axis] = face.sign * self.extents[face.axis];
        }
        point
    }

    /// The face through which a way from outside comes in (slab method: Kay, Kajiya 1986).
    fn entered_face(&self, start: [f32; 3], end: [f32; 3]) -> Option<Face> {
        let exit = self.exit_time(start, end)?;
        let mut entry: Option<(Face, f32)> = None;
        for face in self.faces() {
            let inwards = -face.sign * (end[face.axis] - start[face.axis]);
            let outside = -self.depth(face, start);
            // Only a face that it starts in front of, and moves towards, can be entered.
            if inwards > 0.0 && outside >= 0.0 {
                let time = outside / inwards;
                if entry.is_none_or(|(_, latest)| time > latest) {
                    entry = Some((face, time));
                }
            }
        }
        entry.filter(|(_, time)| *time < exit).map(|(face, _)| face)
    }

    /// The share of a way after which it is beyond the first far side; none where it runs along or
    /// beside the box.
    fn exit_time(&self, start: [f32; 3], end: [f32; 3]) -> Option<f32> {
        let mut exit = 1.0;
        for axis in 0..self.axis_count {
            let moved = end[axis] - start[axis];
            if moved == 0.0 {
                let is_between = start[axis].abs() < self.extents[axis];
                is_between.then_some(())?;
                continue;
            }
            let far = if moved > 0.0 { self.extents[axis] } else { -self.extents[axis] };
            let time = (far - start[axis]) / moved;
            if time < exit {
                exit = time;
            }
        }
        Some(exit)
    }
}

/// The axes of a box where it is.
struct Axes {
    center: Vec3,
    rotation: Quat,
    back: Quat,
    is_turned: bool,
}

impl Axes {
    fn new(center: Vec3, rotation: Quat) -> Self {
        let (back, is_turned) = (rotation.conjugate(), rotation != Quat::IDENTITY);
        Self { center, rotation, back, is_turned }
    }

    fn turn_back(&self, vector: Vec3) -> Vec3 {
        if self.is_turned { self.back * vector } else { vector }
    }

    fn local(&self, point: Vec3) -> Vec3 {
        self.turn_back(point - self.center)
    }

    /// The displacement is added last, as in [`hit_plane`].
    fn local_end(&self, way: &Way) -> Vec3 {
        self.local(way.start) + self.turn_back(way.displacement)
    }

    fn face_normal(&self, face: Face) -> Vec3 {
        let mut normal = Vec3::ZERO;
        normal[face.axis] = face.sign;
        if self.is_turned { (self.rotation * normal).normalize() } else { normal }
    }
}

fn vector([x, y, z, _]: [f32; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}
