//! The layout of a row in memory.

use super::bend_layout::{BendGroup, BendLayout};
use crate::constraints::bends::families::BendFamily;
use crate::constraints::families::{Family, Sheet};
use crate::constraints::parameters::PassSoftness;
use crate::store::layout::{Layout, SceneFields};

/// Numbers in a cache line.
pub(crate) const LINE_LENGTH: usize = 16;

/// Number of fields at the beginning of every row: position, inverse mass, displacement.
pub(crate) const STATE_FIELDS: usize = 7;

/// Number of fields of each tether of a particle.
pub(crate) const TETHER_FIELDS: usize = 5;

/// Number of particles in a sheet from which on several threads are faster than one.
const SHARED_MIN: usize = 4000;

/// The layout of a row. All rows of a sheet have the same.
#[derive(Debug, Clone)]
pub(crate) struct RowLayout {
    /// Index of the first particle.
    pub(crate) first: usize,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
    /// Length of a field in numbers.
    pub(crate) stride: usize,
    pub(crate) fields: Layout,
    /// The families of the sheet, in the order of projection.
    pub(crate) families: Vec<FamilyBlock>,
    /// Number of fields before those of the constraints.
    pub(crate) constraints_at: usize,
    /// Length of the fields of one family, in numbers.
    pub(crate) family_length: usize,
    pub(crate) bends: BendLayout,
    /// Length of a row, in numbers.
    pub(crate) row_length: usize,
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

impl RowLayout {
    pub(crate) fn new(sheet: &Sheet, families: &[Family], bends: &[BendFamily]) -> Self {
        let (columns, rows) = (sheet.columns as usize, sheet.rows as usize);
        let bends = BendLayout::new(bends);
        // Room for the last lane group, or the last two of constraints within a row, and for the columns
        // by which their other ends are further on.
        let length = columns.next_multiple_of(LINE_LENGTH) + LINE_LENGTH;
        let length = length.max(bends.field_length_min(columns));
        let softness = PassSoftness::RIGID;
        let block = |family: &Family| FamilyBlock { family: *family, softness, is_rigid: false };
        Self {
            first: sheet.first as usize,
            columns,
            rows,
            stride: length.next_multiple_of(LINE_LENGTH),
            fields: Layout::default(),
            families: families.iter().map(block).collect(),
            constraints_at: 0,
            family_length: 0,
            bends,
            row_length: 0,
        }
    }

    /// Sets the fields. The results are stored, because every row needs them.
    pub(crate) fn set_fields(&mut self, fields: Layout) {
        self.fields = fields;
        let SceneFields { tethers, bend_multipliers, .. } = fields.scene;
        self.constraints_at = self.root_at(tethers);
        self.family_length = fields.constraints.column_count() * self.stride;
        let constraints_end =
            self.constraints_at * self.stride + self.families.len() * self.family_length;
        self.row_length = self.bends.set_fields(constraints_end, self.stride, bend_multipliers);
        for block in &mut self.families {
            block.is_rigid = fields.used.are_rigid(block.softness.scaled_compliance);
        }
    }

    /// Number of fields before the velocity that the wind adds.
    pub(crate) fn wind_at(&self) -> usize {
        STATE_FIELDS + 3 * usize::from(self.fields.scene.colliders)
    }

    /// Number of fields before the root of a tether.
    pub(crate) fn root_at(&self, slot: usize) -> usize {
        self.wind_at() + 3 * usize::from(self.fields.scene.wind) + TETHER_FIELDS * slot
    }

    /// Number of groups of constraints and bends that a row is projected in.
    pub(crate) fn pull_groups(&self) -> usize {
        2 * self.families.len() + self.bends.groups.len()
    }

    /// Number of bands into which the sheet is divided, each high enough that its seams are a small
    /// part of it.
    pub(crate) fn band_count(&self, workers: usize, reach: usize) -> usize {
        if self.rows * self.columns < SHARED_MIN {
            return 1;
        }
        workers.min(self.rows / (4 * reach + 1)).max(1)
    }

    /// Position of the fields of a family among the families of the sheet.
    pub(crate) fn family_index(&self, family: Family) -> usize {
        let index = self.families.iter().position(|block| block.family == family);
        let Some(index) = index else {
            unreachable!("a constraint belongs to {family:?}, which its sheet does not have")
        };
        index
    }

    /// Index, among all numbers of the sheet, of the rest length of a constraint.
    pub(crate) fn constraint_index(&self, family: Family, [row, column]: [usize; 2]) -> usize {
        let place = if family.reach() > 0 { column } else { self.place_within(family, column) };
        row * self.row_length
            + self.constraints_at * self.stride
            + self.family_index(family) * self.family_length
            + place
    }

    /// Index, among all numbers of the sheet, of the scaled compliance of a bend.
    pub(crate) fn bend_index(&self, family: BendFamily, [row, column]: [usize; 2]) -> usize {
        let family_index = self.bends.family_index(family);
        let group = BendGroup { family, part: family.part(row, column), family_index };
        row * self.row_length
            + self.bends.at
            + family_index * self.bends.family_length
            + group.place(column, self.columns, self.stride)
    }

    /// Position in its field of a constraint within a row. Its half begins at 0 or in the middle.
    /// Within the half, constraints lie in the order in which [`crate::kernels::lanes::Wide::unzip`]
    /// separates sixteen columns.
    fn place_within(&self, family: Family, column: usize) -> usize {
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
        half * self.stride / 2 + 8 * block + lane
    }
}
