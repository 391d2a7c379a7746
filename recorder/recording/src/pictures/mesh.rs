//! Particles, constraints and triangles as shapes, from back to front.
//!
//! Triangles are sorted by the distance of their centers. A line or dot comes right after the last
//! triangle that touches it, so that nearer triangles hide it and its own surface does not.

use glam::{DVec2, DVec3};
use sim_messages::{ConstraintKind, ParticleFlags};

use super::camera::Camera;
use super::extent::position;
use super::shape::{Color, Dash, Shape, Stroke};
use crate::scene_state::SceneState;

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

/// Scenes with at least this many particles show free particles only if they are unconnected.
const DOTS_BELOW: usize = 2000;
/// Lines shorter than this get thinner, and their dots smaller. In pixels.
const LINE_LENGTH: f64 = 16.0;
/// Widths of lines on a surface and elsewhere.
const ON_SURFACE: LineWidth = LineWidth { max: 0.6, min_ratio: 0.35 };
const OFF_SURFACE: LineWidth = LineWidth { max: 1.0, min_ratio: 0.7 };
/// Radius of a dot, in pixels, and the minimum relative to it.
const RADIUS: f64 = 2.6;
const DOT_MIN: f64 = 0.4;
/// Minimum radius of a flagged particle, before its enlargement.
const MARKED_RADIUS_MIN: f64 = 1.6;

/// The range of a line's width.
#[derive(Debug, Clone, Copy)]
struct LineWidth {
    /// Relative to the width of the kind of constraint.
    max: f64,
    /// Width of short lines, relative to `max`.
    min_ratio: f64,
}

/// Draws the particles, constraints and triangles of a state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeshDrawing<'a> {
    pub(crate) state: &'a SceneState,
    pub(crate) camera: &'a Camera,
    pub(crate) style: Style,
}

/// The way in which particles, constraints and triangles are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// All particles, constraints and triangles.
    Wires(Bend),
    /// Triangles, each in one shade by the normals of its corners, and, where there is no
    /// surface, structural constraints and loose particles.
    Shaded,
}

/// The handling of bend constraints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bend {
    /// Draws bend constraints.
    Draw,
    /// Leaves bend constraints out.
    Hide,
}

/// The position of a shape from back to front.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct DrawOrder {
    /// Position of the last triangle behind the shape.
    after: usize,
    /// Order of the shapes after the same triangle. Higher ranks are in front.
    rank: u8,
}

/// A shape and its position from back to front.
type OrderedShape = (DrawOrder, Shape);

impl MeshDrawing<'_> {
    /// Returns all shapes, from back to front.
    pub(crate) fn shapes(&self) -> Vec<Shape> {
        let triangles = self.triangles();
        let normals = match self.style {
            Style::Wires(_) => Vec::new(),
            Style::Shaded => self.normals(&triangles),
        };
        let mut last_at = vec![None; self.state.particles.len()];
        for (place, triangle) in triangles.iter().enumerate() {
            for corner in self.state.triangles[*triangle].corners {
                last_at[corner as usize] = Some(place);
            }
        }
        let mut shapes: Vec<OrderedShape> = Vec::new();
        for (after, triangle) in triangles.iter().enumerate() {
            shapes.push((DrawOrder { after, rank: 0 }, self.triangle(*triangle, &normals)));
        }
        self.add_lines(&mut shapes, &last_at);
        self.add_dots(&mut shapes, &last_at);
        // The sort is stable, so ties keep the order of their index.
        shapes.sort_by_key(|(order, _)| *order);
        shapes.into_iter().map(|(_, shape)| shape).collect()
    }

    /// Returns the triangles without a torn side, from back to front. Ties are sorted by index.
    fn triangles(&self) -> Vec<usize> {
        let mut order: Vec<_> = (self.state.intact_triangles())
            .map(|(index, corners)| {
                let [a, b, c] = corners.map(|corner| self.point(corner));
                (self.camera.nearness(a + b + c), index)
            })
            .collect();
        order.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        order.into_iter().map(|(_, index)| index).collect()
    }

    /// Returns the sums of the normals of the triangles at each particle, by their areas.
    fn normals(&self, triangles: &[usize]) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.state.particles.len()];
        for triangle in triangles {
            let corners = self.state.triangles[*triangle].corners;
            let [a, b, c] = corners.map(|corner| self.point(corner));
            let normal = (b - a).cross(c - a);
            for corner in corners {
                normals[corner as usize] += normal;
            }
        }
        normals
    }

    /// Without normals of the particles, the triangle has its own.
    fn triangle(&self, index: usize, normals: &[DVec3]) -> Shape {
        let corners = self.state.triangles[index].corners;
        let [a, b, c] = corners.map(|corner| self.point(corner));
        let normal = match normals {
            [] => (b - a).cross(c - a),
            _ => corners.iter().map(|corner| normals[*corner as usize].normalize_or_zero()).sum(),
        };
        let normal = normal.normalize_or_zero();
        let fill = SURFACE.times(self.camera.brightness(normal));
        // The outline closes the seams between neighbors.
        let outline = Some(Stroke::solid(fill, 0.7));
        let corners = [a, b, c].map(|corner| self.camera.project(corner)).into();
        Shape::Polygon { corners, fill, outline }
    }

    fn add_lines(&self, shapes: &mut Vec<OrderedShape>, last_at: &[Option<usize>]) {
        for constraint in self.state.untorn_constraints() {
            let [a, b] = [constraint.a, constraint.b];
            let lasts = [a, b].map(|end| last_at[end as usize]);
            let is_shown = match self.style {
                Style::Wires(Bend::Draw) => true,
                Style::Wires(Bend::Hide) => constraint.kind != BEND_KIND,
                Style::Shaded => {
                    constraint.kind == STRUCTURAL_KIND && lasts.iter().any(Option::is_none)
                }
            };
            if !is_shown {
                continue;
            }
            // A bend constraint lies on structural lines and must not hide them.
            let is_bend = constraint.kind == BEND_KIND;
            let after = if is_bend { lasts[0].min(lasts[1]) } else { lasts[0].max(lasts[1]) };
            let width = if after.is_some() { ON_SURFACE } else { OFF_SURFACE };
            let (rank, mut stroke) = line_style(constraint.kind);
            let ratio = self.width_ratio(constraint.rest_length.into()).clamp(width.min_ratio, 1.0);
            stroke.width *= self.camera.line_scale() * width.max * ratio;
            let after = after.unwrap_or(usize::MAX);
            let ends = [a, b].map(|end| self.pixel(end));
            shapes.push((DrawOrder { after, rank }, Shape::Segment { ends, stroke }));
        }
    }

    fn add_dots(&self, shapes: &mut Vec<OrderedShape>, last_at: &[Option<usize>]) {
        let particles = &self.state.particles;
        let is_connected = self.state.connected();
        let ratio = self.mean_length().map_or(1.0, |length| self.width_ratio(length));
        let scale = self.camera.line_scale();
        let radius = RADIUS * scale * ratio.clamp(DOT_MIN, 1.0);
        let marked_radius = radius.max(MARKED_RADIUS_MIN * scale) * 1.4;
        for (index, state) in (0_u32..).zip(particles.iter()) {
            let place = index as usize;
            let is_marked = state.flags & MARKED_FLAGS != 0;
            let is_shown = match self.style {
                Style::Wires(_) => is_marked || particles.len() < DOTS_BELOW,
                Style::Shaded => false,
            };
            if !is_shown && is_connected[place] {
                continue;
            }
            let after = last_at[place].unwrap_or(usize::MAX);
            let radius = if is_marked { marked_radius } else { radius };
            let order = DrawOrder { after, rank: DOT_RANK };
            shapes.push((order, dot(state.flags, self.pixel(index), radius)));
        }
    }

    /// Returns the factor for the width of a line, which is below 1 for lines that are short in the
    /// picture.
    fn width_ratio(&self, length: f64) -> f64 {
        self.camera.pixels(length) / (LINE_LENGTH * self.camera.line_scale())
    }

    /// Returns the mean rest length of the untorn constraints except bend constraints.
    fn mean_length(&self) -> Option<f64> {
        let lengths = (self.state.untorn_constraints())
            .filter(|constraint| constraint.kind != BEND_KIND)
            .map(|constraint| f64::from(constraint.rest_length));
        let (count, sum) = lengths.fold((0_u32, 0.0), |(count, sum), one| (count + 1, sum + one));
        (count > 0).then(|| sum / f64::from(count))
    }

    fn point(&self, particle: u32) -> DVec3 {
        position(self.state.particles[particle as usize].position)
    }

    fn pixel(&self, particle: u32) -> DVec2 {
        self.camera.project(self.point(particle))
    }
}

const STRUCTURAL_KIND: u32 = ConstraintKind::Structural as u32;
const BEND_KIND: u32 = ConstraintKind::Bend as u32;
const SHEAR_KIND: u32 = ConstraintKind::Shear as u32;
const TETHER_KIND: u32 = ConstraintKind::Tether as u32;
/// In front of all lines.
const DOT_RANK: u8 = 5;
/// Particles with any of these flags are always drawn.
const MARKED_FLAGS: u32 = ParticleFlags::PINNED
    | ParticleFlags::GRABBED
    | ParticleFlags::ANCHORED
    | ParticleFlags::FROZEN;

/// Returns the rank and the line of a kind of constraint, in a picture of 720 pixels without a surface.
fn line_style(kind: u32) -> (u8, Stroke) {
    match kind {
        BEND_KIND => (1, Stroke { color: BEND, width: 0.8, dash: Dash::Dashed }),
        SHEAR_KIND => (2, Stroke::solid(SHEAR, 1.0)),
        TETHER_KIND => (3, Stroke { color: TETHER, width: 1.4, dash: Dash::Dotted }),
        _ => (4, Stroke::solid(STRUCTURAL, 1.6)),
    }
}

fn dot(flags: u32, center: DVec2, radius: f64) -> Shape {
    let has = |flag: u32| flags & flag != 0;
    let circle = |fill, radius| Shape::Circle { center, radius, fill, outline: None };
    if has(ParticleFlags::FROZEN) {
        circle(FROZEN, radius)
    } else if has(ParticleFlags::GRABBED) {
        circle(GRABBED, radius * 1.2)
    } else if has(ParticleFlags::ANCHORED) {
        circle(ANCHORED, radius)
    } else if has(ParticleFlags::PINNED) {
        let corner = |x: f64, y: f64| center + DVec2::new(x, y) * radius;
        let corners =
            vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        Shape::Polygon { corners, fill: PINNED, outline: None }
    } else {
        circle(FREE, radius)
    }
}
