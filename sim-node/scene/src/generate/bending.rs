//! The bends of sheets.

use glam::Vec3;

use super::builder::{ConstraintBuilder, round};
use super::cloth::Cloth;
use crate::constraints::bends::families::BendFamily;
use crate::constraints::bends::{Bend, BendShape};

/// Bends of one family: those that begin in the first rows and columns.
struct BendRange {
    family: BendFamily,
    rows: u32,
    columns: u32,
}

/// Distances of neighbours in a sheet.
struct Spacings {
    /// Along the weft, from column to column.
    across: f64,
    /// Along the warp, from row to row.
    down: f64,
}

impl Cloth {
    /// Number of bends.
    pub(super) fn bend_count(&self) -> u64 {
        self.bend_ranges().map(|one| u64::from(one.rows) * u64::from(one.columns)).sum()
    }

    /// Appends bends particle by particle: across, down, then the twist of the cell.
    pub(super) fn build_bends(&self, builder: &mut ConstraintBuilder<'_>) {
        let ranges: Vec<_> = self.bend_ranges().collect();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let begins = |one: &&BendRange| row < one.rows && column < one.columns;
                for BendRange { family, .. } in ranges.iter().filter(begins) {
                    self.build_bend(*family, [row, column], builder);
                }
            }
        }
    }

    /// Returns alpha B of a bend inside of the sheet, along the warp and along the weft, in m^2.
    pub fn bend_geometries(&self) -> [f64; 2] {
        let Spacings { across, down } = self.spacings();
        [down.powi(3) / across, across.powi(3) / down]
    }

    fn bend_ranges(&self) -> impl Iterator<Item = BendRange> {
        let Self { columns, rows, .. } = *self;
        let (has_bends, has_twist) =
            self.bending.map_or((false, false), |bending| (true, bending.twist));
        let ranges = [
            (has_bends, BendFamily::Across, [0, 2]),
            (has_bends, BendFamily::Down, [2, 0]),
            (has_twist, BendFamily::Twist, [1, 1]),
        ];
        let ranges = ranges.into_iter().filter(|(exists, ..)| *exists);
        ranges.map(move |(_, family, [below, right])| BendRange {
            family,
            rows: rows.saturating_sub(below),
            columns: columns.saturating_sub(right),
        })
    }

    fn build_bend(
        &self,
        family: BendFamily,
        [row, column]: [u32; 2],
        builder: &mut ConstraintBuilder<'_>,
    ) {
        let index = |place: &[u32; 2]| (row + place[0]) * self.columns + column + place[1];
        let particles = match family.places() {
            [a, b, c] => [index(a), index(b), index(c), index(b)],
            [a, b, c, d] => [index(a), index(b), index(c), index(d)],
            _ => unreachable!("a bend has three or four particles"),
        };
        let Spacings { across, down } = self.spacings();
        let [of_warp, of_weft] = self.bend_geometries();
        let geometry = match family {
            BendFamily::Across => of_weft / width_share(row, self.rows),
            BendFamily::Down => of_warp / width_share(column, self.columns),
            BendFamily::Twist => across * down / 2.0,
        };
        let shape = match family {
            BendFamily::Across | BendFamily::Down => BendShape::Line,
            BendFamily::Twist => BendShape::Cell,
        };
        let [warp, weft] = self.bending.map_or([0.0; 2], |bending| bending.bending.threads());
        let rigidity = match family {
            BendFamily::Across => weft,
            BendFamily::Down => warp,
            // That of plates whose threads have different rigidities (Huber 1923).
            BendFamily::Twist => (warp * weft).sqrt(),
        };
        let (row, column) = (row as usize, column as usize);
        let bend = Bend {
            particles: particles.map(|particle| builder.first + particle),
            coefficients: family.coefficients(),
            geometry: round(geometry),
            rigidity,
            shape,
            block: None,
        };
        builder.model.push_bend(bend, Some(family.group(row, column)));
    }

    fn spacings(&self) -> Spacings {
        let length =
            |direction| f64::from(self.spacing) * Vec3::from_array(direction).as_dvec3().length();
        Spacings { across: length(self.right), down: length(self.down) }
    }
}

/// Width of a row in spacings: half a cell on either side. A single row has the width of a cell.
fn width_share(row: u32, rows: u32) -> f64 {
    let is_border = row == 0 || row + 1 == rows;
    if is_border && rows > 1 { 0.5 } else { 1.0 }
}
