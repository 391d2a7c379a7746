//! Solids: where a way through a collider ends, and by which face.

use glam::{Quat, Vec3};

use crate::colliders::{Body, Collider};
use crate::contact::ContactStep;
use crate::kernels::{Lanes, each};

/// Where a particle leaves a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Out of the collider, of length 1.
    pub(crate) normal: Vec3,
    /// How far inside it is along the normal, > 0.
    pub(crate) depth: f32,
}

/// The way of a particle in a substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Way {
    /// x.
    pub(crate) start: Vec3,
    /// d.
    pub(crate) displacement: Vec3,
}

/// Where ways can end inside of a solid, or pass through it: nowhere else.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Zone {
    /// Where the height above a plane is below 0.
    Below { normal: Vec3, offset: f32 },
    /// Around a solid.
    Around { min: Vec3, max: Vec3 },
}

impl Zone {
    /// All within a distance of some points, and what rounding may add.
    fn around(points: [Vec3; 2], distance: Vec3, reach: f32) -> Self {
        let distance = distance + Vec3::splat(64.0 * f32::EPSILON * reach);
        let ([a, b], mut min, mut max) = (points, Vec3::ZERO, Vec3::ZERO);
        for axis in 0..3 {
            let (low, high) = if a[axis] < b[axis] { (a, b) } else { (b, a) };
            (min[axis], max[axis]) = (low[axis] - distance[axis], high[axis] + distance[axis]);
        }
        Self::Around { min, max }
    }

    /// Whether a way comes into it.
    #[inline(always)]
    pub(crate) fn may_be_met<L: Lanes>(&self, x: [L; 3], d: [L; 3]) -> L::Mask {
        match self {
            // As `hit_half_space` works it out.
            Self::Below { normal, offset } => {
                let normal = each(normal.to_array(), L::splat);
                let along =
                    |way: [L; 3]| normal[0] * way[0] + normal[1] * way[1] + normal[2] * way[2];
                ((along(x) - L::splat(*offset)) + along(d)).is_below(L::splat(0.0))
            }
            Self::Around { min, max } => {
                let meets = |axis: usize| {
                    let (start, end) = (x[axis], x[axis] + d[axis]);
                    let is_down = end.is_below(start);
                    let low = L::choose(is_down, end, start);
                    let high = L::choose(is_down, start, end);
                    let (min, max) = (L::splat(min[axis]), L::splat(max[axis]));
                    L::both(low.is_at_most(max), min.is_at_most(high))
                };
                L::both(L::both(meets(0), meets(1)), meets(2))
            }
        }
    }
}

/// Everything that a particle can be inside of, where it is at the end of a substep.
#[derive(Debug, Clone)]
pub(crate) enum Solid {
    HalfSpace { normal: Vec3, offset: f32 },
    Ball { center: Vec3, radius: f32 },
    Capsule { ends: [Vec3; 2], radius: f32 },
    Block { block: Block, now: Axes, before: Axes },
}

/// The solids of a collider: one, or a half-space for each face of bounds.
pub(crate) fn solids(collider: &Collider, step: &ContactStep) -> [Option<Solid>; 6] {
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
    #[inline(always)]
    pub(crate) fn hit(&self, way: &Way) -> Option<Hit> {
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

    /// Where it can be met.
    pub(crate) fn zone(&self) -> Zone {
        let reach = self.reach();
        match self {
            Self::HalfSpace { normal, offset } => Zone::Below { normal: *normal, offset: *offset },
            Self::Ball { center, radius } => {
                Zone::around([*center; 2], Vec3::splat(*radius), reach)
            }
            Self::Capsule { ends, radius } => Zone::around(*ends, Vec3::splat(*radius), reach),
            Self::Block { block, now, before } => {
                let extents = Vec3::from_array(block.extents);
                // A box that turns sweeps a ball.
                let is_turned = now.is_turned || before.is_turned;
                let mut distance = if is_turned { Vec3::splat(extents.length()) } else { extents };
                if block.axis_count == 2 {
                    distance.z = f32::INFINITY;
                }
                Zone::around([now.center, before.center], distance, reach)
            }
        }
    }

    /// The size of its numbers, for what their rounding may be.
    pub(crate) fn reach(&self) -> f32 {
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
#[inline(always)]
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

#[inline(never)]
fn hit_capsule(way: &Way, [a, b]: [Vec3; 2], radius: f32) -> Option<Hit> {
    let axis = b - a;
    let square = axis.dot(axis);
    let along =
        if square > 0.0 { (way.start + way.displacement - a).dot(axis) / square } else { 0.0 };
    let share = along.clamp(0.0, 1.0);
    // Across the axis, and in the plane of a 2-D scene.
    let across = Vec3::new(-axis.y, axis.x, 0.0);
    let has_side = across.dot(across) >= f32::MIN_POSITIVE;
    let fallback = if has_side { across.normalize() } else { Vec3::X };
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
#[derive(Debug, Clone)]
pub(crate) struct Block {
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
#[derive(Debug, Clone)]
pub(crate) struct Axes {
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

    /// The displacement is added last, as in [`hit_half_space`].
    fn local_end(&self, way: &Way) -> Vec3 {
        self.local(way.start) + self.turn_back(way.displacement)
    }

    fn face_normal(&self, face: Face) -> Vec3 {
        let mut normal = Vec3::ZERO;
        normal[face.axis] = face.sign;
        if self.is_turned { (self.rotation * normal).normalize() } else { normal }
    }
}
