//! Ranges of numbers, with the words for error messages.

/// Largest coordinate that a scene or command may name, in m: f32 resolves 1 m there.
pub const COORDINATE_MAX: f32 = 1e7;

/// A range of finite numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberRange {
    /// Lower end.
    pub min: f32,
    /// Upper end; `f32::MAX` where there is no limit.
    pub max: f32,
    /// The lower end itself is not allowed.
    pub excludes_min: bool,
    /// The upper end itself is not allowed.
    pub excludes_max: bool,
    /// The range in words, for error messages.
    pub text: &'static str,
}

impl NumberRange {
    /// From 0, without an upper limit.
    pub const AT_LEAST_ZERO: Self = Self::closed(0.0, f32::MAX, "a number >= 0");
    /// Above 0, without an upper limit.
    pub const POSITIVE: Self =
        Self { excludes_min: true, ..Self::closed(0.0, f32::MAX, "a number > 0") };
    /// A coordinate, or a component of a velocity or acceleration.
    pub const COORDINATE: Self = Self::closed(-COORDINATE_MAX, COORDINATE_MAX, "-1e7 to 1e7");
    /// Compliance in m/N. compliance / h^2 stays finite in f32 at the smallest h of 10 ns.
    pub const COMPLIANCE: Self = Self::closed(0.0, 1e20, "0 to 1e20 m/N");
    /// A share, such as a stiffness.
    pub const SHARE: Self = Self::closed(0.0, 1.0, "0 to 1");
    /// Over-relaxation factor: the projections diverge from 2 on.
    pub const RELAXATION: Self = Self {
        excludes_min: true,
        excludes_max: true,
        ..Self::closed(0.0, 2.0, "more than 0 and less than 2; 1 is no relaxation")
    };
    /// A length divided by a rest length, as a limit.
    pub const RATIO: Self =
        Self { excludes_min: true, ..Self::closed(1.0, f32::MAX, "more than 1") };
    /// Counts of substeps and iterations.
    pub const PASSES: Self = Self::closed(1.0, 1000.0, "a whole number from 1 to 1000");
    /// Pace of a node in multiples of real time.
    pub const TIME_SCALE: Self = Self::closed(1e-3, 1e3, "0.001 to 1000");

    const fn closed(min: f32, max: f32, text: &'static str) -> Self {
        Self { min, max, excludes_min: false, excludes_max: false, text }
    }

    /// Returns `true` if the number lies in the range. NaN lies in none.
    pub fn contains(&self, number: f32) -> bool {
        let is_above = if self.excludes_min { number > self.min } else { number >= self.min };
        let is_below = if self.excludes_max { number < self.max } else { number <= self.max };
        is_above && is_below
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_a_range_belong_to_it_unless_excluded() {
        let relaxation = NumberRange::RELAXATION;
        assert!(!relaxation.contains(0.0) && relaxation.contains(1.0) && !relaxation.contains(2.0));
        let share = NumberRange::SHARE;
        assert!(share.contains(0.0) && share.contains(1.0) && !share.contains(1.0 + f32::EPSILON));
    }

    #[test]
    fn a_number_that_is_not_finite_lies_in_no_range() {
        for number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert!(!NumberRange::AT_LEAST_ZERO.contains(number), "{number}");
            assert!(!NumberRange::COORDINATE.contains(number), "{number}");
        }
    }
}
