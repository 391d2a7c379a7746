//! The properties that the constraints of a scene have, and the passes over them.

/// Properties beside the rest length that any constraint of a scene has. A property that no
/// constraint has costs neither memory nor time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "each tells if one kind of column exists")]
pub(crate) struct ConstraintFields {
    /// Constraints differ in their softness.
    pub(crate) softness: bool,
    pub(crate) floors: bool,
    pub(crate) max_lengths: bool,
    pub(crate) tear_lengths: bool,
    pub(crate) tear_multipliers: bool,
    /// Lambda is needed: for a limit of force, or for a later pass over soft constraints.
    pub(crate) multipliers: bool,
}

impl ConstraintFields {
    /// True if a `RigidProjection` suffices for constraints of this scaled compliance.
    pub(crate) fn are_rigid(self, scaled_compliance: f32) -> bool {
        let rigid = Self { max_lengths: self.max_lengths, ..Self::default() };
        self == rigid && scaled_compliance == 0.0
    }

    /// Fields of either.
    pub(crate) fn union(self, other: Self) -> Self {
        Self {
            softness: self.softness || other.softness,
            floors: self.floors || other.floors,
            max_lengths: self.max_lengths || other.max_lengths,
            tear_lengths: self.tear_lengths || other.tear_lengths,
            tear_multipliers: self.tear_multipliers || other.tear_multipliers,
            multipliers: self.multipliers || other.multipliers,
        }
    }

    /// True if constraints have marks.
    pub(crate) fn tears(self) -> bool {
        self.tear_lengths || self.tear_multipliers
    }

    /// Number of columns for these fields, including the rest length.
    pub(crate) fn column_count(self) -> usize {
        let count = |is_there: bool, columns: usize| if is_there { columns } else { 0 };
        2 + count(self.softness, 2)
            + count(self.floors, 1)
            + count(self.max_lengths, 2)
            + count(self.tear_lengths, 1)
            + count(self.tear_multipliers, 1)
            + count(self.multipliers, 1)
            + count(self.tears(), 1)
    }
}

/// One of the passes of a substep over all constraints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pass {
    /// From 0.
    pub(crate) index: u32,
    pub(crate) count: u32,
}

impl Pass {
    /// Passes of a substep, in order.
    pub(crate) fn all(count: u32) -> impl Iterator<Item = Self> {
        (0..count).map(move |index| Self { index, count })
    }

    pub(crate) fn is_first(self) -> bool {
        self.index == 0
    }

    pub(crate) fn is_last(self) -> bool {
        self.index + 1 == self.count
    }
}
