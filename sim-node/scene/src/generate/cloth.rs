//! A sheet of particles.

use sim_types::{ConstraintKind, NumberRange};

use super::builder::{ConstraintBuilder, ParticleBuilder, round};
use super::folds::Folds;
use crate::constraints::families::Family;
use crate::definition::bending::SheetBending;
use crate::fields::{At, Fields, printed};

/// A sheet of columns x rows particles. Particle (c, r) has index r columns + c.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloth {
    /// Number of columns, at least 1.
    pub columns: u32,
    /// Number of rows, at least 1.
    pub rows: u32,
    /// Distance between neighbours, > 0.
    pub spacing: f32,
    /// Position of particle (0, 0).
    pub origin: [f32; 3],
    /// Vector from one column to the next, in multiples of the spacing.
    pub right: [f32; 3],
    /// Vector from one row to the next, in multiples of the spacing.
    pub down: [f32; 3],
    /// Folds in which the sheet is gathered, if it is.
    pub folds: Option<Folds>,
    /// Kinds of constraints to create.
    pub links: Vec<ConstraintKind>,
    /// Diagonals of each cell that have a shear constraint.
    pub diagonals: Diagonals,
    /// Bending rigidity, if it has any.
    pub bending: Option<SheetBending>,
}

/// Diagonals of a cell that have a shear constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Diagonals {
    /// Only the one from upper left to lower right.
    One,
    /// Both.
    Two,
}

impl Cloth {
    /// Returns a sheet with the defaults.
    pub(super) fn blank(links: &[ConstraintKind]) -> Self {
        Self {
            columns: 1,
            rows: 1,
            spacing: 1.0,
            origin: [0.0; 3],
            right: [1.0, 0.0, 0.0],
            down: [0.0, -1.0, 0.0],
            folds: None,
            links: links.to_vec(),
            diagonals: Diagonals::Two,
            bending: None,
        }
    }

    pub(super) fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.count("columns", &mut self.columns, 1);
        fields.count("rows", &mut self.rows, 1);
        fields.require("spacing", NumberRange::POSITIVE.text);
        fields.number("spacing", &mut self.spacing, NumberRange::POSITIVE);
        fields.vector("origin", &mut self.origin);
        fields.vector("right", &mut self.right);
        fields.vector("down", &mut self.down);
        Folds::walk(&mut self.folds, fields);
        let print = |links: &Vec<_>| {
            printed(&links.iter().map(|kind: &ConstraintKind| kind.name()).collect::<Vec<_>>())
        };
        fields.value("links", &mut self.links, read_links, print);
        let diagonals = [Diagonals::One, Diagonals::Two];
        let read = |at: At<'_>| at.whole(1..=2).map(|count| diagonals[count as usize - 1]);
        fields.value("diagonals", &mut self.diagonals, read, |one| printed(&u32::from(*one)));
        SheetBending::walk(&mut self.bending, fields);
    }
}

/// Reads the kinds of constraints in a sheet, ascending and without duplicates.
fn read_links(at: At<'_>) -> Option<Vec<ConstraintKind>> {
    use ConstraintKind::{Bend, Shear, Structural};
    let known = [Structural, Shear, Bend].map(|kind| (kind.name(), kind));
    let mut kinds: Vec<_> = at.list()?.map(|kind| kind.word(&known)).collect::<Option<_>>()?;
    kinds.sort_unstable_by_key(|kind| *kind as u32);
    kinds.dedup();
    Some(kinds)
}

impl From<Diagonals> for u32 {
    fn from(diagonals: Diagonals) -> Self {
        match diagonals {
            Diagonals::One => 1,
            Diagonals::Two => 2,
        }
    }
}

/// Words for the pinned particles; the default of a cloth is the first.
pub(crate) const PIN_WORDS: [&str; 4] = ["top", "top-even", "corners", "none"];

/// A constraint with the family that it declares for the order of projection.
struct Link {
    a: u32,
    b: u32,
    kind: ConstraintKind,
    family: u32,
}

impl Cloth {
    pub(super) fn particle_count(&self) -> u64 {
        u64::from(self.columns) * u64::from(self.rows)
    }

    pub(super) fn constraint_count(&self) -> u64 {
        self.links.iter().map(|kind| self.link_count(*kind)).sum()
    }

    pub(super) fn triangle_count(&self) -> u64 {
        2 * u64::from(self.columns.saturating_sub(1)) * u64::from(self.rows.saturating_sub(1))
    }

    pub(super) fn build_particles(&self, builder: &mut ParticleBuilder<'_>) {
        let places = self.places();
        for row in 0..self.rows {
            for (column, place) in (0..).zip(&places) {
                let index = row * self.columns + column;
                let position = self.position(*place, row);
                builder.particle(position, |word| self.is_pinned(word, index));
            }
        }
    }

    /// Appends constraints particle by particle, and two triangles per cell.
    pub(super) fn build_constraints(&self, builder: &mut ConstraintBuilder<'_>) {
        builder.sheet(self.columns, self.rows);
        for row in 0..self.rows {
            for column in 0..self.columns {
                for link in self.links_at(column, row) {
                    builder.family_link([link.a, link.b], link.kind, link.family);
                }
            }
        }
        for row in 1..self.rows {
            for column in 1..self.columns {
                let below = row * self.columns + column;
                let above = below - self.columns;
                builder.triangle([above - 1, below - 1, below]);
                builder.triangle([above - 1, below, above]);
            }
        }
    }

    fn is_pinned(&self, word: &str, index: u32) -> bool {
        let is_top = index < self.columns;
        match word {
            "top" => is_top,
            "top-even" => is_top && index.is_multiple_of(2),
            "corners" => index == 0 || index == self.columns - 1,
            _ => false,
        }
    }

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

    /// Returns for each column its way along the sheet and out of its front, in spacings.
    fn places(&self) -> Vec<[f64; 2]> {
        match self.folds {
            Some(folds) => folds.places(self.columns),
            None => (0..self.columns).map(|column| [f64::from(column), 0.0]).collect(),
        }
    }

    fn position(&self, [along, out]: [f64; 2], row: u32) -> [f32; 3] {
        let spacing = f64::from(self.spacing);
        let front = if out == 0.0 { [0.0; 3] } else { self.front() };
        let coordinate = |axis: usize| {
            let right = f64::from(self.right[axis]) * along;
            let down = f64::from(self.down[axis]) * f64::from(row);
            round(f64::from(self.origin[axis]) + spacing * (right + down + front[axis] * out))
        };
        [coordinate(0), coordinate(1), coordinate(2)]
    }

    /// The vector out of the front of the sheet, as long as `right`.
    fn front(&self) -> [f64; 3] {
        let [right, down] = [self.right, self.down].map(|one| one.map(f64::from));
        let cross = |a: usize, b: usize| down[a] * right[b] - down[b] * right[a];
        let normal = [cross(1, 2), cross(2, 0), cross(0, 1)];
        let square = |one: [f64; 3]| one.iter().map(|axis| axis * axis).sum::<f64>();
        let scale = (square(right) / square(normal)).sqrt();
        if scale.is_finite() { normal.map(|axis| axis * scale) } else { [0.0; 3] }
    }

    /// Returns the constraints that start at a particle: right, down, down-right, then from its
    /// right neighbour down-left, two right, two down.
    fn links_at(&self, column: u32, row: u32) -> impl Iterator<Item = Link> {
        use ConstraintKind::{Bend, Shear, Structural};
        let index = move |c: u32, r: u32| r * self.columns + c;
        let (c, r) = (column, row);
        let link = move |kind, family: Family, from: [u32; 2], to: [u32; 2]| {
            let is_inside = from[0].max(to[0]) < self.columns && to[1] < self.rows;
            let is_wanted = is_inside && self.links.contains(&kind);
            is_wanted.then(|| Link {
                a: index(from[0], from[1]),
                b: index(to[0], to[1]),
                kind,
                family: family.group(r as usize, c as usize),
            })
        };
        let left = (self.diagonals == Diagonals::Two)
            .then(|| link(Shear, Family::DiagonalLeft, [c + 1, r], [c, r + 1]));
        [
            link(Structural, Family::Horizontal, [c, r], [c + 1, r]),
            link(Structural, Family::Vertical, [c, r], [c, r + 1]),
            link(Shear, Family::DiagonalRight, [c, r], [c + 1, r + 1]),
            left.flatten(),
            link(Bend, Family::HorizontalBend, [c, r], [c + 2, r]),
            link(Bend, Family::VerticalBend, [c, r], [c, r + 2]),
        ]
        .into_iter()
        .flatten()
    }
}
