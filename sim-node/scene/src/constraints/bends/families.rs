//! Families of bends: the bends of a sheet in one direction.

use super::{SECOND_DIFFERENCE, TWIST};

/// A direction of bends in a sheet, in the order of projection. No two bends of one group of a family
/// share a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BendFamily {
    /// Three particles below each other; three groups by row.
    Down,
    /// Three particles beside each other; three groups by column.
    Across,
    /// The corners of a cell, row by row; four groups by row and column.
    Twist,
}

impl BendFamily {
    /// All families, in the order of projection.
    pub const ALL: [Self; 3] = [Self::Down, Self::Across, Self::Twist];

    /// Number of groups.
    #[inline]
    pub const fn group_count(self) -> usize {
        match self {
            Self::Down | Self::Across => 3,
            Self::Twist => 4,
        }
    }

    /// Row and column of the particles, relative to the row and column of the bend. A second difference
    /// has three.
    #[inline]
    pub const fn places(self) -> &'static [[u32; 2]] {
        match self {
            Self::Down => &[[0, 0], [1, 0], [2, 0]],
            Self::Across => &[[0, 0], [0, 1], [0, 2]],
            Self::Twist => &[[0, 0], [0, 1], [1, 0], [1, 1]],
        }
    }

    /// Number of rows from the first particle down to the last.
    #[inline]
    pub const fn reach(self) -> usize {
        match self {
            Self::Down => 2,
            Self::Across => 0,
            Self::Twist => 1,
        }
    }

    /// Coefficients of the particles of a bend.
    #[inline]
    pub const fn coefficients(self) -> [f32; 4] {
        match self {
            Self::Down | Self::Across => SECOND_DIFFERENCE,
            Self::Twist => TWIST,
        }
    }

    /// Group, within the family, of a bend at a row and column.
    #[inline]
    pub const fn part(self, row: usize, column: usize) -> usize {
        match self {
            Self::Down => row % 3,
            Self::Across => column % 3,
            Self::Twist => 2 * (row % 2) + column % 2,
        }
    }

    /// Group, in the order of projection of all families, of a bend at a row and column.
    #[inline]
    pub const fn group(self, row: usize, column: usize) -> u32 {
        self.group_of(self.part(row, column))
    }

    /// Group, in the order of projection of all families, of a group within the family.
    #[allow(clippy::cast_possible_truncation, reason = "at most 9")]
    #[inline]
    pub const fn group_of(self, part: usize) -> u32 {
        let first = match self {
            Self::Down => 0,
            Self::Across => 3,
            Self::Twist => 6,
        };
        (first + part) as u32
    }

    /// The family of a group.
    #[inline]
    pub const fn from_group(group: u32) -> Self {
        match group {
            0..3 => Self::Down,
            3..6 => Self::Across,
            _ => Self::Twist,
        }
    }
}
