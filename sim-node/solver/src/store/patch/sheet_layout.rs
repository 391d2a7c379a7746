//! The place of constraints and bends in the rows of a sheet.

use sim_scene::constraints::bends::families::BendFamily;
use sim_scene::constraints::families::{Family, Sheet};

use super::bend_layout::{BendGroup, BendLayout};
use crate::constraints::parameters::PassSoftness;
use crate::store::layout::Layout;
use crate::store::rows::{LINE_LENGTH, RowLayout};

/// The constraints that begin in a row, behind its particles: family by family, then the bends.
#[derive(Debug, Clone)]
pub(crate) struct SheetLayout {
    /// The families of the sheet, in the order of projection.
    pub(crate) families: Vec<FamilyBlock>,
    /// Length of the fields of one family, in numbers.
    pub(crate) family_length: usize,
    pub(crate) bends: BendLayout,
}

/// The constraints of a family.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FamilyBlock {
    pub(crate) family: Family,
    /// Softness of every constraint of the family.
    pub(crate) softness: PassSoftness,
    /// True if [`crate::constraints::projection::RigidProjection`] suffices.
    pub(crate) is_rigid: bool,
}

impl SheetLayout {
    pub(crate) fn new(families: &[Family], bends: &[BendFamily]) -> Self {
        let softness = PassSoftness::RIGID;
        let block = |family: &Family| FamilyBlock { family: *family, softness, is_rigid: false };
        Self {
            families: families.iter().map(block).collect(),
            family_length: 0,
            bends: BendLayout::new(bends),
        }
    }

    /// The layout of the rows of a sheet, without fields.
    pub(crate) fn rows(&self, sheet: &Sheet) -> RowLayout {
        let (columns, rows) = (sheet.columns as usize, sheet.rows as usize);
        // Room for the last lane group, or the last two of constraints within a row, and for the columns
        // by which their other ends are further on.
        let length = columns.next_multiple_of(LINE_LENGTH) + LINE_LENGTH;
        let length = length.max(self.bends.field_length_min(columns));
        RowLayout::new(sheet.first as usize, [rows, columns], length.next_multiple_of(LINE_LENGTH))
    }

    /// Sets the fields of the rows.
    pub(crate) fn set_fields(&mut self, rows: &mut RowLayout, fields: Layout) {
        rows.set_fields(fields);
        self.family_length = fields.constraints.column_count() * rows.stride;
        let bends_at = rows.length + self.families.len() * self.family_length;
        let has_multipliers = fields.scene.bend_multipliers;
        rows.length = self.bends.set_fields(bends_at, rows.stride, has_multipliers);
        for block in &mut self.families {
            block.is_rigid = fields.used.are_rigid(block.softness.scaled_compliance);
        }
    }

    /// Number of groups of constraints and bends that a row is projected in.
    pub(crate) fn pull_groups(&self) -> usize {
        2 * self.families.len() + self.bends.groups.len()
    }

    /// Position of the fields of a family among the families of the sheet.
    pub(crate) fn family_index(&self, family: Family) -> usize {
        let index = self.families.iter().position(|block| block.family == family);
        let Some(index) = index else {
            unreachable!("a constraint belongs to {family:?}, which its sheet does not have")
        };
        index
    }

    /// Index, in a row, of the rest length of a constraint that begins at a column.
    pub(crate) fn constraint_index(
        &self,
        rows: &RowLayout,
        family: Family,
        column: usize,
    ) -> usize {
        let is_between_rows = family.reach() > 0;
        let place = if is_between_rows { column } else { place_within(rows, family, column) };
        rows.constraints_at * rows.stride + self.family_index(family) * self.family_length + place
    }

    /// Index, in a row, of the scaled compliance of a bend.
    pub(crate) fn bend_index(
        &self,
        rows: &RowLayout,
        family: BendFamily,
        [row, column]: [usize; 2],
    ) -> usize {
        let family_index = self.bends.family_index(family);
        let group = BendGroup { family, part: family.part(row, column), family_index };
        self.bends.at
            + family_index * self.bends.family_length
            + group.place(column, rows.columns, rows.stride)
    }
}

/// Position in its field of a constraint within a row. Its half begins at 0 or in the middle.
/// Within the half, constraints lie in the order in which [`crate::kernels::lanes::Wide::unzip`]
/// separates sixteen columns.
fn place_within(rows: &RowLayout, family: Family, column: usize) -> usize {
    let half = family.half(0, column);
    let (start, order): (_, [usize; 8]) = match family {
        Family::HorizontalBend => (2 * half, [0, 1, 8, 9, 4, 5, 12, 13]),
        _ => (half, [0, 2, 8, 10, 4, 6, 12, 14]),
    };
    let (block, within) = ((column - start) / 16, (column - start) % 16);
    let lane = order.iter().position(|column| *column == within);
    let Some(lane) = lane else {
        unreachable!("column {column} does not begin a constraint of {family:?}")
    };
    half * rows.stride / 2 + 8 * block + lane
}
