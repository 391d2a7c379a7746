//! Generators: shapes that stand for many particles and constraints.

use serde::Serialize;

use super::model::Model;
use super::{Limits, Method, SceneParticle, Softness, decimal};
use crate::constraints::{Constraint, ConstraintKind};

/// A shape, and what its particles and constraints are like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Generator {
    /// The shape.
    #[serde(flatten)]
    pub shape: Shape,
    /// Mass of each particle in kg.
    #[serde(with = "decimal::number")]
    pub mass: f32,
    /// Particles of the shape that are pinned.
    pub pinned: Pinned,
    /// How soft the constraints are.
    #[serde(flatten)]
    pub softness: KindSoftness,
    /// Length / rest length above which its constraints tear, instead of the scene's; infinity is
    /// off.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_stretch: Option<f32>,
}

/// The shapes.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Shape {
    /// A sheet.
    Cloth(Cloth),
    /// A line.
    Rope(Rope),
}

/// A sheet of columns x rows particles; particle (c, r) has index r columns + c.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cloth {
    /// At least 1.
    pub columns: u32,
    /// At least 1.
    pub rows: u32,
    /// Distance between neighbours.
    #[serde(with = "decimal::number")]
    pub spacing: f32,
    /// Position of particle (0, 0).
    #[serde(with = "decimal::vector")]
    pub origin: [f32; 3],
    /// From column to column, times the spacing.
    #[serde(with = "decimal::vector")]
    pub right: [f32; 3],
    /// From row to row, times the spacing.
    #[serde(with = "decimal::vector")]
    pub down: [f32; 3],
    /// Which kinds of constraints it has.
    pub links: Vec<ConstraintKind>,
    /// Diagonals of a cell with shear constraints.
    pub diagonals: Diagonals,
}

/// How many diagonals of a cell have a shear constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(into = "u32")]
pub enum Diagonals {
    /// Only down-right.
    One,
    /// Both.
    Two,
}

impl From<Diagonals> for u32 {
    fn from(diagonals: Diagonals) -> Self {
        match diagonals {
            Diagonals::One => 1,
            Diagonals::Two => 2,
        }
    }
}

/// A line of particles; constraint i joins particles i and i + 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rope {
    /// Particles, at least 2.
    pub count: u32,
    /// Position of the first.
    #[serde(with = "decimal::vector")]
    pub from: [f32; 3],
    /// Position of the last.
    #[serde(with = "decimal::vector")]
    pub to: [f32; 3],
}

/// Which particles of a shape are pinned.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Pinned {
    /// One of the words of the shape.
    Word(&'static str),
    /// Indices within the shape, ascending.
    List(Vec<u32>),
}

/// The softness of each kind of constraint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KindSoftness {
    /// In m/N (method xpbd).
    Compliance(PerKind),
    /// 0..=1 (method pbd).
    Stiffness(PerKind),
}

/// A number for each kind of constraint that generators make.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PerKind {
    /// Of constraints between direct neighbours.
    #[serde(with = "decimal::number")]
    pub structural: f32,
    /// Of constraints across a diagonal.
    #[serde(with = "decimal::number")]
    pub shear: f32,
    /// Of constraints between next neighbours but one.
    #[serde(with = "decimal::number")]
    pub bend: f32,
}

impl KindSoftness {
    /// Rigid, in the measure of a method.
    pub fn rigid(method: Method) -> Self {
        let value = Softness::rigid(method).value();
        Self::new(method, PerKind { structural: value, shear: value, bend: value })
    }

    /// The numbers in the measure of a method.
    pub fn new(method: Method, per_kind: PerKind) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(per_kind),
            Method::Pbd => Self::Stiffness(per_kind),
        }
    }

    fn of(self, kind: ConstraintKind) -> f32 {
        let (Self::Compliance(values) | Self::Stiffness(values)) = self;
        match kind {
            ConstraintKind::Structural | ConstraintKind::Tether => values.structural,
            ConstraintKind::Shear => values.shear,
            ConstraintKind::Bend => values.bend,
        }
    }
}

/// The words for pinned particles of a cloth; the first is the default.
pub(crate) const CLOTH_PINS: [&str; 4] = ["top", "top-even", "corners", "none"];
/// The words for pinned particles of a rope; the first is the default.
pub(crate) const ROPE_PINS: [&str; 4] = ["first", "last", "both", "none"];

impl Generator {
    /// Particles that it makes; at most 2^64, so it is known before any is made.
    pub(crate) fn particle_count(&self) -> u64 {
        match &self.shape {
            Shape::Cloth(cloth) => u64::from(cloth.columns) * u64::from(cloth.rows),
            Shape::Rope(rope) => u64::from(rope.count),
        }
    }

    /// Constraints that it makes.
    pub(crate) fn constraint_count(&self) -> u64 {
        match &self.shape {
            Shape::Cloth(cloth) => cloth.links.iter().map(|kind| cloth.link_count(*kind)).sum(),
            Shape::Rope(rope) => u64::from(rope.count) - 1,
        }
    }

    pub(crate) fn build(&self, model: &mut Model) {
        let first = model.particle_count();
        let tear_stretch = self.tear_stretch;
        model.begin_limits(Limits { tear_stretch, ..Limits::default() });
        match &self.shape {
            Shape::Cloth(cloth) => self.build_cloth(cloth, first, model),
            Shape::Rope(rope) => self.build_rope(rope, first, model),
        }
    }

    fn build_cloth(&self, cloth: &Cloth, first: u32, model: &mut Model) {
        for row in 0..cloth.rows {
            for column in 0..cloth.columns {
                let index = row * cloth.columns + column;
                let position = cloth.position(column, row);
                model.particles.push(self.particle(position, self.is_cloth_pin(cloth, index)));
            }
        }
        for row in 0..cloth.rows {
            for column in 0..cloth.columns {
                for link in cloth.links_of(column, row) {
                    self.push_link(&link, first, model);
                }
            }
        }
        for row in 1..cloth.rows {
            for column in 1..cloth.columns {
                let below = first + row * cloth.columns + column;
                let above = below - cloth.columns;
                model.triangles.push([above - 1, below - 1, below]);
                model.triangles.push([above - 1, below, above]);
            }
        }
    }

    fn build_rope(&self, rope: &Rope, first: u32, model: &mut Model) {
        let last = rope.count - 1;
        for index in 0..rope.count {
            let share = f64::from(index) / f64::from(last);
            let along = |axis: usize| {
                let (from, to) = (f64::from(rope.from[axis]), f64::from(rope.to[axis]));
                round(from + (to - from) * share)
            };
            let is_pinned = match &self.pinned {
                Pinned::Word("first") => index == 0,
                Pinned::Word("last") => index == last,
                Pinned::Word("both") => index == 0 || index == last,
                Pinned::Word(_) => false,
                Pinned::List(list) => list.binary_search(&index).is_ok(),
            };
            model.particles.push(self.particle([along(0), along(1), along(2)], is_pinned));
        }
        for index in 0..last {
            let link =
                Link { a: index, b: index + 1, kind: ConstraintKind::Structural, family: None };
            self.push_link(&link, first, model);
        }
    }

    fn particle(&self, position: [f32; 3], pinned: bool) -> SceneParticle {
        SceneParticle { position, mass: self.mass, pinned, velocity: [0.0; 3] }
    }

    fn push_link(&self, link: &Link, first: u32, model: &mut Model) {
        let (a, b) = (first + link.a, first + link.b);
        model.push(
            Constraint {
                a,
                b,
                rest_length: model.distance(a, b),
                compliance: self.softness.of(link.kind),
                kind: link.kind,
            },
            link.family,
        );
    }

    fn is_cloth_pin(&self, cloth: &Cloth, index: u32) -> bool {
        let is_top = index < cloth.columns;
        match &self.pinned {
            Pinned::Word("top") => is_top,
            Pinned::Word("top-even") => is_top && index.is_multiple_of(2),
            Pinned::Word("corners") => index == 0 || index == cloth.columns - 1,
            Pinned::Word(_) => false,
            Pinned::List(list) => list.binary_search(&index).is_ok(),
        }
    }
}

/// A constraint within a shape, with the family that it declares for the order of projection.
struct Link {
    a: u32,
    b: u32,
    kind: ConstraintKind,
    family: Option<u32>,
}

/// The families of a sheet, in the order of projection; each has an even and an odd half, and no
/// two constraints of one half share a particle.
#[derive(Clone, Copy)]
enum Family {
    Vertical,
    Horizontal,
    DiagonalRight,
    DiagonalLeft,
    VerticalBend,
    HorizontalBend,
}

impl Family {
    /// The group of one half; `phase` counts along the direction of the constraint.
    fn half(self, phase: u32) -> u32 {
        2 * self as u32 + phase % 2
    }
}

impl Cloth {
    fn link_count(&self, kind: ConstraintKind) -> u64 {
        let (columns, rows) = (u64::from(self.columns), u64::from(self.rows));
        let straight =
            |reach| columns.saturating_sub(reach) * rows + columns * rows.saturating_sub(reach);
        match kind {
            ConstraintKind::Structural => straight(1),
            ConstraintKind::Shear => {
                u64::from(u32::from(self.diagonals)) * (columns - 1) * (rows - 1)
            }
            ConstraintKind::Bend => straight(2),
            ConstraintKind::Tether => 0,
        }
    }

    fn position(&self, column: u32, row: u32) -> [f32; 3] {
        let spacing = f64::from(self.spacing);
        let along = |axis: usize| {
            let right = f64::from(self.right[axis]) * f64::from(column);
            let down = f64::from(self.down[axis]) * f64::from(row);
            round(f64::from(self.origin[axis]) + spacing * (right + down))
        };
        [along(0), along(1), along(2)]
    }

    /// The constraints that start at a particle: right, down, down-right, then from its right
    /// neighbour down-left, two right, two down.
    fn links_of(&self, column: u32, row: u32) -> impl Iterator<Item = Link> {
        use ConstraintKind::{Bend, Shear, Structural};
        let index = move |c: u32, r: u32| r * self.columns + c;
        let link = move |kind, family, from: [u32; 2], to: [u32; 2]| {
            let is_inside = from[0].max(to[0]) < self.columns && to[1] < self.rows;
            let is_wanted = is_inside && self.links.contains(&kind);
            is_wanted.then(|| Link {
                a: index(from[0], from[1]),
                b: index(to[0], to[1]),
                kind,
                family: Some(family),
            })
        };
        let (c, r) = (column, row);
        let left = (self.diagonals == Diagonals::Two)
            .then(|| link(Shear, Family::DiagonalLeft.half(r), [c + 1, r], [c, r + 1]));
        [
            link(Structural, Family::Horizontal.half(c), [c, r], [c + 1, r]),
            link(Structural, Family::Vertical.half(r), [c, r], [c, r + 1]),
            link(Shear, Family::DiagonalRight.half(r), [c, r], [c + 1, r + 1]),
            left.flatten(),
            link(Bend, Family::HorizontalBend.half(c / 2), [c, r], [c + 2, r]),
            link(Bend, Family::VerticalBend.half(r / 2), [c, r], [c, r + 2]),
        ]
        .into_iter()
        .flatten()
    }
}

#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the scene's f32")]
fn round(value: f64) -> f32 {
    value as f32
}
