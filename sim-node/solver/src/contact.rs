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
pub(crate) struct Surface {
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
        let body = collider.body(step.moments.end);
        let surface = Surface {
            linear: collider.linear,
            angular: collider.angular,
            pivot: body.pivot(),
            restitution: collider.restitution,
            friction: collider.friction,
            h: step.h,
            rest_speed: step.rest_speed,
        };
        match body {
            Body::Plane { normal, offset } => {
                self.touch(particles, &surface, |way| hit_plane(way, normal, offset));
            }
            Body::Sphere { center, radius } => {
                self.touch(particles, &surface, |way| hit_ball(way, center, radius, Vec3::Y));
            }
            Body::Capsule { a, b, radius } => {
                self.touch(particles, &surface, |way| hit_capsule(way, [a, b], radius));
            }
            Body::Box { half_extents, .. } => {
                let now = Axes::of(&body);
                let before = Axes::of(&collider.body(step.moments.start));
                let count = if step.is_planar { 2 } else { 3 };
                let extents = half_extents.to_array();
                let block = Block::new(&extents[..count], body.pivot());
                self.touch(particles, &surface, |way| {
                    let start = before.local(way.start).to_array();
                    let end = now.local_end(way).to_array();
                    let (face, depth) = block.hit(&start[..count], &end[..count])?;
                    Some(Hit { normal: now.face_normal(face), depth })
                });
            }
            Body::Bounds { min, max } => {
                let axes = [Vec3::X, Vec3::Y, Vec3::Z];
                let count = if step.is_planar { 2 } else { 3 };
                for (axis, normal) in axes.into_iter().enumerate().take(count) {
                    self.touch(particles, &surface, |way| hit_plane(way, normal, min[axis]));
                    self.touch(particles, &surface, |way| hit_plane(way, -normal, -max[axis]));
                }
            }
        }
    }

    /// Resolves the contact of each free particle that `hit` finds one for.
    #[inline]
    fn touch(
        &mut self,
        particles: &mut Particles,
        surface: &Surface,
        hit: impl Fn(&Way) -> Option<Hit>,
    ) {
        for index in 0..particles.count() {
            if particles.positions[index][3] == 0.0 {
                continue;
            }
            let way = Way {
                start: vector(particles.positions[index]),
                displacement: vector(particles.displacements[index]),
            };
            if let Some(hit) = hit(&way) {
                self.resolve(particles, index, &way, (surface, &hit));
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

impl Surface {
    /// The velocity of the collider's material at a point.
    fn velocity_at(&self, point: Vec3) -> Vec3 {
        self.linear + self.angular.cross(point - self.pivot)
    }
}

/// The displacement is added last: near the surface, the rest is exact, and it keeps its digits.
fn hit_plane(way: &Way, normal: Vec3, offset: f32) -> Option<Hit> {
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
    Some(Hit { normal, depth: radius - distance })
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
struct Block<'a> {
    extents: &'a [f32],
    /// What lies less deep than this is on the surface, but for the rounding of its position.
    skin: f32,
}

impl<'a> Block<'a> {
    fn new(extents: &'a [f32], center: Vec3) -> Self {
        let largest = extents.iter().fold(0.0, |most, one| if *one > most { *one } else { most });
        let reach = largest + center.abs().x + center.abs().y + center.abs().z;
        Self { extents, skin: 2.0 * f32::EPSILON * reach }
    }

    /// Where a way leaves the box: by the face through which it came in, or by the nearest one
    /// where it began inside. Also where it has come out again on another side: nothing passes
    /// through a thin box.
    fn hit(&self, start: &[f32], end: &[f32]) -> Option<(Face, f32)> {
        let mut surface = [0.0; 3];
        let start = self.out_of_skin(start, &mut surface);
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
        faces.filter(|face| face.axis < self.extents.len())
    }

    fn depth(&self, face: Face, point: &[f32]) -> f32 {
        self.extents[face.axis] - face.sign * point[face.axis]
    }

    fn is_inside(&self, point: &[f32]) -> bool {
        point.iter().zip(self.extents).all(|(one, max)| one.abs() < *max)
    }

    fn nearest_face(&self, point: &[f32]) -> Option<Face> {
        let depth = |face| self.depth(face, point);
        self.faces().reduce(|best, face| if depth(face) < depth(best) { face } else { best })
    }

    /// A point just below the surface, on it: else what lies on a thin box could be pulled through
    /// it from the inside.
    fn out_of_skin<'p>(&self, point: &'p [f32], surface: &'p mut [f32; 3]) -> &'p [f32] {
        let nearest = self.nearest_face(point).filter(|_| self.is_inside(point));
        let Some(face) = nearest.filter(|face| self.depth(*face, point) < self.skin) else {
            return point;
        };
        let surface = &mut surface[..point.len()];
        surface.copy_from_slice(point);
        surface[face.axis] = face.sign * self.extents[face.axis];
        surface
    }

    /// The face through which a way from outside comes in (slab method: Kay, Kajiya 1986).
    fn entered_face(&self, start: &[f32], end: &[f32]) -> Option<Face> {
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
    fn exit_time(&self, start: &[f32], end: &[f32]) -> Option<f32> {
        let mut exit = 1.0;
        for (axis, extent) in self.extents.iter().enumerate() {
            let moved = end[axis] - start[axis];
            if moved == 0.0 {
                let is_between = start[axis].abs() < *extent;
                is_between.then_some(())?;
                continue;
            }
            let far = if moved > 0.0 { *extent } else { -extent };
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
    fn of(body: &Body) -> Self {
        let Body::Box { center, rotation, .. } = *body else {
            return Self::of(&Body::Box {
                center: body.pivot(),
                half_extents: Vec3::ZERO,
                rotation: Quat::IDENTITY,
            });
        };
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
