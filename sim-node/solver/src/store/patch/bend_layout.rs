//! The place of bends in a row.

use std::ops::Range;

use sim_scene::constraints::bends::families::BendFamily;

/// The bends that begin in a row, family by family: their scaled compliances, and, if they are in memory,
/// the three components of their multipliers.
#[derive(Debug, Clone, Default)]
pub(crate) struct BendLayout {
    /// In the order of projection.
    pub(crate) families: Vec<BendFamily>,
    /// The groups of all families, in the order of projection.
    pub(crate) groups: Vec<BendGroup>,
    /// Index in the row of the first number.
    pub(crate) at: usize,
    /// Length of the fields of one family, in numbers.
    pub(crate) family_length: usize,
}

/// A group of bends of a sheet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BendGroup {
    pub(crate) family: BendFamily,
    /// Group within the family.
    pub(crate) part: usize,
    /// Index of the family in [`BendLayout::families`].
    pub(crate) family_index: usize,
}

/// Lanes in which [`crate::kernels::lanes::Wide::unzip_thirds`] puts every third of 24 columns.
const THIRDS: [usize; 8] = [0, 9, 18, 3, 12, 21, 6, 15];
/// Lanes in which [`crate::kernels::lanes::Wide::unzip`] puts every second of 16 columns.
const HALVES: [usize; 8] = [0, 2, 8, 10, 4, 6, 12, 14];

impl BendLayout {
    pub(crate) fn new(families: &[BendFamily]) -> Self {
        let groups = families.iter().enumerate().flat_map(|(family_index, family)| {
            (0..family.group_count()).map(move |part| BendGroup {
                family: *family,
                part,
                family_index,
            })
        });
        Self { families: families.to_vec(), groups: groups.collect(), at: 0, family_length: 0 }
    }

    /// Least length of a field with the columns that a group reads beyond the sheet: its lane groups begin
    /// at column 2 at the latest, and contain 24 columns.
    pub(crate) fn field_length_min(&self, columns: usize) -> usize {
        if self.families.is_empty() { 0 } else { columns + 24 }
    }

    /// Sets the place in the row, and returns its end.
    pub(crate) fn set_fields(&mut self, at: usize, stride: usize, has_multipliers: bool) -> usize {
        let field_count = if has_multipliers { 4 } else { 1 };
        (self.at, self.family_length) = (at, field_count * stride);
        at + self.families.len() * self.family_length
    }

    /// Index of a family among those of the sheet.
    pub(crate) fn family_index(&self, family: BendFamily) -> usize {
        let index = self.families.iter().position(|one| *one == family);
        let Some(index) = index else {
            unreachable!("a bend belongs to {family:?}, which its sheet does not have")
        };
        index
    }
}

impl BendGroup {
    /// Number of the group in the order of projection of all families.
    pub(crate) fn number(&self) -> u32 {
        self.family.group_of(self.part)
    }

    /// True if bends of the group begin in a row.
    pub(crate) fn begins_in(&self, row: usize) -> bool {
        match self.family {
            BendFamily::Down => row % 3 == self.part,
            BendFamily::Across => true,
            BendFamily::Twist => row % 2 == self.part / 2,
        }
    }

    /// First column of the group.
    pub(crate) fn first_column(&self) -> usize {
        match self.family {
            BendFamily::Down => 0,
            BendFamily::Across => self.part,
            BendFamily::Twist => self.part % 2,
        }
    }

    /// Lane groups of its bends in each field.
    pub(crate) fn lane_groups(&self, columns: usize, stride: usize) -> Range<usize> {
        let from = self.first_column();
        let (start, count) = match self.family {
            BendFamily::Down => (0, columns.div_ceil(8)),
            BendFamily::Across => {
                (from * columns.div_ceil(24), columns.saturating_sub(2 + from).div_ceil(24))
            }
            BendFamily::Twist => {
                (from * stride / 16, columns.saturating_sub(1 + from).div_ceil(16))
            }
        };
        start..start + count
    }

    /// Position in its field of the bend that begins at a column.
    pub(crate) fn place(&self, column: usize, columns: usize, stride: usize) -> usize {
        let (length, order) = match self.family {
            BendFamily::Down => return column,
            BendFamily::Across => (24, THIRDS),
            BendFamily::Twist => (16, HALVES),
        };
        let (block, within) =
            ((column - self.first_column()) / length, (column - self.first_column()) % length);
        let lane = order.iter().position(|column| *column == within);
        let Some(lane) = lane else {
            unreachable!("column {column} does not begin a bend of {self:?}")
        };
        8 * (self.lane_groups(columns, stride).start + block) + lane
    }
}
