//! Particles, constraints and triangles as shapes, from back to front.
//!
//! Triangles are sorted by the distance of their middles. A stick or dot comes right after the last
//! triangle that touches it: what is nearer hides it, its own surface does not.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};
use sim_contract::{ConstraintKind, ParticleFlags};

use super::camera::Camera;
use super::extent::position;
use super::moment::Moment;
use super::shape::{Color, Dash, Shape, Stroke};

const SURFACE: Color = Color([0x8f, 0xb8, 0xde]);
const STRUCTURAL: Color = Color([0x2b, 0x3a, 0x4a]);
const SHEAR: Color = Color([0x7b, 0x8c, 0x9e]);
const BEND: Color = Color([0xb0, 0xa4, 0xc4]);
const TETHER: Color = Color([0xc0, 0x7a, 0x2c]);
const FREE: Color = Color([0x1f, 0x4e, 0x79]);
const PINNED: Color = Color([0xb0, 0x2a, 0x2a]);
const ANCHORED: Color = Color([0x1e, 0x8a, 0x5a]);
const GRABBED: Color = Color([0xe0, 0x8a, 0x00]);
const FROZEN: Color = Color([0xc0, 0x26, 0xc0]);

/// From so many particles on, free ones that something is tied to are not drawn.
const DOTS_BELOW: usize = 2000;
/// Length of a stick, in pixels, below which its line gets thinner and dots get smaller.
const STICK_LENGTH: f64 = 16.0;
/// Share of its width that a stick has at most, and share of that which it has at least.
const ON_SURFACE: (f64, f64) = (0.6, 0.35);
const IN_THE_AIR: (f64, f64) = (1.0, 0.7);
/// Radius of a dot, and the share of it that it has at least.
const RADIUS: f64 = 2.6;
const DOT_MIN: f64 = 0.4;
/// Of a particle with a flag, before it is drawn larger than others.
const MARKED_RADIUS_MIN: f64 = 1.6;

/// How a moment is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sheet<'a> {
    pub(crate) moment: &'a Moment,
    pub(crate) camera: &'a Camera,
    pub(crate) bend: Bend,
}

/// What is done with bending constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Bend {
    Draw,
    LeaveOut,
}

/// Where a shape stands in the order: after so many triangles, and among those after the same one
/// by rank, the higher later.
type Place = (usize, u8);

impl Sheet<'_> {
    /// All shapes of the mesh.
    pub(crate) fn shapes(&self) -> Vec<Shape> {
        let triangles = self.triangles();
        let mut last_at = vec![None; self.moment.particles.len()];
        for (place, triangle) in triangles.iter().enumerate() {
            for corner in self.moment.triangles[*triangle].corners {
                last_at[corner as usize] = Some(place);
            }
        }
        let mut shapes: Vec<(Place, Shape)> = Vec::new();
        for (place, triangle) in triangles.iter().enumerate() {
            shapes.push(((place, 0), self.triangle(*triangle)));
        }
        self.add_sticks(&mut shapes, &last_at);
        self.add_dots(&mut shapes, &last_at);
        // Stable: ties stay in the order of their index.
        shapes.sort_by_key(|(place, _)| *place);
        shapes.into_iter().map(|(_, shape)| shape).collect()
    }

    /// Triangles that are whole, from back to front, ties by index. A hole is where a structural
    /// edge is torn.
    fn triangles(&self) -> Vec<usize> {
        let moment = self.moment;
        let torn_edges: BTreeSet<_> = (moment.constraints.iter().zip(&moment.is_torn))
            .filter(|(constraint, is_torn)| **is_torn && constraint.kind == STRUCTURAL_KIND)
            .map(|(constraint, _)| edge(constraint.a, constraint.b))
            .collect();
        let is_whole = |[a, b, c]: [u32; 3]| {
            let edges = [edge(a, b), edge(b, c), edge(c, a)];
            torn_edges.is_empty() || !edges.iter().any(|edge| torn_edges.contains(edge))
        };
        let mut order: Vec<_> = (moment.triangles.iter().enumerate())
            .filter(|(_, triangle)| is_whole(triangle.corners))
            .map(|(index, triangle)| {
                let [a, b, c] = triangle.corners.map(|corner| self.point(corner));
                (self.camera.nearness(a + b + c), index)
            })
            .collect();
        order.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        order.into_iter().map(|(_, index)| index).collect()
    }

    fn triangle(&self, index: usize) -> Shape {
        let [a, b, c] = self.moment.triangles[index].corners.map(|corner| self.point(corner));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let fill = SURFACE.times(self.camera.brightness(normal));
        // The outline closes the seams between neighbours.
        let outline = Some(Stroke::solid(fill, 0.7));
        let corners = [a, b, c].map(|corner| self.camera.project(corner)).into();
        Shape::Polygon { corners, fill, outline }
    }

    fn add_sticks(&self, shapes: &mut Vec<(Place, Shape)>, last_at: &[Option<usize>]) {
        let moment = self.moment;
        for (constraint, _) in
            moment.constraints.iter().zip(&moment.is_torn).filter(|(_, is_torn)| !**is_torn)
        {
            if constraint.kind == BEND_KIND && self.bend == Bend::LeaveOut {
                continue;
            }
            let [a, b] = [constraint.a, constraint.b];
            let lasts = [a, b].map(|end| last_at[end as usize]);
            // A bend lies on structural sticks, and must not hide them.
            let is_bend = constraint.kind == BEND_KIND;
            let after = if is_bend { lasts[0].min(lasts[1]) } else { lasts[0].max(lasts[1]) };
            let (share, thinnest) = if after.is_some() { ON_SURFACE } else { IN_THE_AIR };
            let (rank, mut stroke) = look_of(constraint.kind);
            let thinness = self.thinness(constraint.rest_length.into()).clamp(thinnest, 1.0);
            stroke.width *= self.camera.line_scale() * share * thinness;
            let after = after.unwrap_or(usize::MAX);
            let ends = [a, b].map(|end| self.pixel(end));
            shapes.push(((after, rank), Shape::Segment { ends, stroke }));
        }
    }

    fn add_dots(&self, shapes: &mut Vec<(Place, Shape)>, last_at: &[Option<usize>]) {
        let particles = &self.moment.particles;
        let is_tied = self.tied();
        let thinness = self.mean_length().map_or(1.0, |length| self.thinness(length));
        let scale = self.camera.line_scale();
        let radius = RADIUS * scale * thinness.clamp(DOT_MIN, 1.0);
        let marked_radius = radius.max(MARKED_RADIUS_MIN * scale) * 1.4;
        for (index, state) in (0_u32..).zip(particles) {
            let place = index as usize;
            let is_seen = particles.len() < DOTS_BELOW || !is_tied[place];
            if state.flags & DRAWN_FLAGS == 0 && !is_seen {
                continue;
            }
            let after = last_at[place].unwrap_or(usize::MAX);
            let radius = if state.flags & DRAWN_FLAGS == 0 { radius } else { marked_radius };
            shapes.push(((after, DOT_RANK), dot(state.flags, self.pixel(index), radius)));
        }
    }

    /// By particle: whether a stick that is not torn, or a triangle, is tied to it.
    fn tied(&self) -> Vec<bool> {
        let moment = self.moment;
        let mut is_tied = vec![false; moment.particles.len()];
        let whole =
            moment.constraints.iter().zip(&moment.is_torn).filter(|(_, is_torn)| !**is_torn);
        let ends = whole.flat_map(|(constraint, _)| [constraint.a, constraint.b]);
        let corners = moment.triangles.iter().flat_map(|triangle| triangle.corners);
        for index in ends.chain(corners) {
            is_tied[index as usize] = true;
        }
        is_tied
    }

    /// What the width of a line is multiplied by: less where it is short in the picture.
    fn thinness(&self, length: f64) -> f64 {
        self.camera.pixels(length) / (STICK_LENGTH * self.camera.line_scale())
    }

    /// Mean rest length of what is not torn and not a bend.
    fn mean_length(&self) -> Option<f64> {
        let lengths = (self.moment.constraints.iter().zip(&self.moment.is_torn))
            .filter(|(constraint, is_torn)| !**is_torn && constraint.kind != BEND_KIND)
            .map(|(constraint, _)| f64::from(constraint.rest_length));
        let (count, sum) = lengths.fold((0_u32, 0.0), |(count, sum), one| (count + 1, sum + one));
        (count > 0).then(|| sum / f64::from(count))
    }

    fn point(&self, particle: u32) -> DVec3 {
        position(self.moment.particles[particle as usize].position)
    }

    fn pixel(&self, particle: u32) -> DVec2 {
        self.camera.project(self.point(particle))
    }
}

const STRUCTURAL_KIND: u32 = ConstraintKind::Structural as u32;
const BEND_KIND: u32 = ConstraintKind::Bend as u32;
const SHEAR_KIND: u32 = ConstraintKind::Shear as u32;
const TETHER_KIND: u32 = ConstraintKind::Tether as u32;
/// Above all sticks.
const DOT_RANK: u8 = 5;
/// Particles with any of these are drawn in any number.
const DRAWN_FLAGS: u32 = ParticleFlags::PINNED
    | ParticleFlags::GRABBED
    | ParticleFlags::ANCHORED
    | ParticleFlags::FROZEN;

/// Rank and line of a constraint, in a picture of 720 pixels without a surface.
fn look_of(kind: u32) -> (u8, Stroke) {
    match kind {
        BEND_KIND => (1, Stroke { color: BEND, width: 0.8, dash: Dash::Dashed }),
        SHEAR_KIND => (2, Stroke::solid(SHEAR, 1.0)),
        TETHER_KIND => (3, Stroke { color: TETHER, width: 1.4, dash: Dash::Dotted }),
        _ => (4, Stroke::solid(STRUCTURAL, 1.6)),
    }
}

fn dot(flags: u32, center: DVec2, radius: f64) -> Shape {
    let is = |flag: u32| flags & flag != 0;
    let circle = |fill, radius| Shape::Circle { center, radius, fill, outline: None };
    if is(ParticleFlags::FROZEN) {
        circle(FROZEN, radius)
    } else if is(ParticleFlags::GRABBED) {
        circle(GRABBED, radius * 1.2)
    } else if is(ParticleFlags::ANCHORED) {
        circle(ANCHORED, radius)
    } else if is(ParticleFlags::PINNED) {
        let corner = |x: f64, y: f64| center + DVec2::new(x, y) * radius;
        let corners =
            vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Shape::Polygon { corners, fill: PINNED, outline: None }
    } else {
        circle(FREE, radius)
    }
}

/// An edge is the same from either end.
fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}
