//! Families: the constraints of a sheet that run in one direction.

/// A direction of constraints in a sheet, in the order of projection. Each family has an even and
/// an odd half; no two constraints of one half share a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Neighbours below each other.
    Vertical,
    /// Neighbours beside each other.
    Horizontal,
    /// From a particle to the one below its right neighbour.
    DiagonalRight,
    /// From a particle to the one below its left neighbour.
    DiagonalLeft,
    /// Second neighbours below each other.
    VerticalBend,
    /// Second neighbours beside each other.
    HorizontalBend,
}

impl Family {
    /// All families, in the order of projection.
    pub const ALL: [Self; 6] = [
        Self::Vertical,
        Self::Horizontal,
        Self::DiagonalRight,
        Self::DiagonalLeft,
        Self::VerticalBend,
        Self::HorizontalBend,
    ];

    /// Row and column of the two particles of a constraint, relative to its row and column.
    #[inline]
    const fn ends(self) -> [[usize; 2]; 2] {
        match self {
            Self::Vertical => [[0, 0], [1, 0]],
            Self::Horizontal => [[0, 0], [0, 1]],
            Self::DiagonalRight => [[0, 0], [1, 1]],
            Self::DiagonalLeft => [[0, 1], [1, 0]],
            Self::VerticalBend => [[0, 0], [2, 0]],
            Self::HorizontalBend => [[0, 0], [0, 2]],
        }
    }

    /// Number of rows from the first particle down to the second.
    #[inline]
    pub const fn reach(self) -> usize {
        self.ends()[1][0]
    }

    /// Columns of the two particles, relative to the column of the constraint.
    #[inline]
    pub const fn shifts(self) -> [usize; 2] {
        [self.ends()[0][1], self.ends()[1][1]]
    }

    /// Number of constraints that begin in a row of `columns` particles.
    #[inline]
    pub const fn count(self, columns: usize) -> usize {
        let [a, b] = self.shifts();
        columns.saturating_sub(if a > b { a } else { b })
    }

    /// The half (0 or 1) of a constraint at a row and column. Halves alternate along the family.
    #[inline]
    pub const fn half(self, row: usize, column: usize) -> usize {
        match self {
            Self::Vertical | Self::DiagonalRight | Self::DiagonalLeft => row % 2,
            Self::VerticalBend => row / 2 % 2,
            Self::Horizontal => column % 2,
            Self::HorizontalBend => column / 2 % 2,
        }
    }

    /// The group, in the order of projection, of a constraint at a row and column.
    #[allow(clippy::cast_possible_truncation, reason = "at most 11")]
    #[inline]
    pub const fn group(self, row: usize, column: usize) -> u32 {
        (2 * self as usize + self.half(row, column)) as u32
    }

    /// The family of a group.
    #[inline]
    pub const fn from_group(group: u32) -> Self {
        Self::ALL[group as usize / 2]
    }
}

/// A grid of particles whose constraints all belong to families.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sheet {
    /// Index of the first particle. The others follow row by row.
    pub first: u32,
    /// Number of columns.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
    /// Index of the first triangle. Each cell has two, row by row: upper left, lower left, lower right; and upper
    /// left, lower right, upper right.
    pub first_triangle: u32,
}

impl Sheet {
    /// Number of particles.
    #[inline]
    pub fn count(&self) -> u32 {
        self.columns * self.rows
    }

    /// Row and column of a particle, if it belongs to this sheet.
    #[inline]
    pub fn find(&self, particle: u32) -> Option<[usize; 2]> {
        let place = particle.checked_sub(self.first).filter(|place| *place < self.count())?;
        Some([place / self.columns, place % self.columns].map(|index| index as usize))
    }
}
