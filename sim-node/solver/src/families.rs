//! Families: the constraints of a sheet that run in one direction. They are what a structured patch
//! is projected by.

/// A direction, in the order of projection. The constraints of a family fall into an even and an
/// odd half; no two of one half share a particle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Family {
    Vertical,
    Horizontal,
    DiagonalRight,
    DiagonalLeft,
    VerticalBend,
    HorizontalBend,
}

impl Family {
    pub(crate) const ALL: [Self; 6] = [
        Self::Vertical,
        Self::Horizontal,
        Self::DiagonalRight,
        Self::DiagonalLeft,
        Self::VerticalBend,
        Self::HorizontalBend,
    ];

    /// Rows and columns of the first and of the second particle of a constraint, counted from the
    /// row and column at which it begins.
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

    /// Rows from the first particle down to the second.
    pub(crate) const fn reach(self) -> usize {
        self.ends()[1][0]
    }

    /// Columns of the two particles, from where the constraint begins.
    pub(crate) const fn shifts(self) -> [usize; 2] {
        [self.ends()[0][1], self.ends()[1][1]]
    }

    /// Constraints that begin in a row of so many particles.
    pub(crate) const fn count(self, columns: usize) -> usize {
        let [a, b] = self.shifts();
        columns.saturating_sub(if a > b { a } else { b })
    }

    /// Which half a constraint belongs to that begins there: halves alternate along it.
    pub(crate) const fn half(self, row: usize, column: usize) -> usize {
        match self {
            Self::Vertical | Self::DiagonalRight | Self::DiagonalLeft => row % 2,
            Self::VerticalBend => row / 2 % 2,
            Self::Horizontal => column % 2,
            Self::HorizontalBend => column / 2 % 2,
        }
    }

    /// The group of a constraint that begins there, in the order of projection.
    #[allow(clippy::cast_possible_truncation, reason = "at most 11")]
    pub(crate) const fn group(self, row: usize, column: usize) -> u32 {
        (2 * self as usize + self.half(row, column)) as u32
    }

    /// The family of a group.
    pub(crate) const fn of_group(group: u32) -> Self {
        Self::ALL[group as usize / 2]
    }
}

/// A sheet of particles, all of whose constraints are of families: part of a scene's model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Sheet {
    /// Index of its first particle; the others follow row by row.
    pub(crate) first: u32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
}

impl Sheet {
    pub(crate) fn count(&self) -> u32 {
        self.columns * self.rows
    }

    /// Row and column of a particle, if it is one of these.
    pub(crate) fn find(&self, particle: u32) -> Option<[usize; 2]> {
        let place = particle.checked_sub(self.first).filter(|place| *place < self.count())?;
        Some([place / self.columns, place % self.columns].map(|one| one as usize))
    }
}
