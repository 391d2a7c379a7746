//! The limits of scenes, and ranges of numbers and indices with their text for error messages.

use crate::reason::Reason;

/// Most particles, and most constraints, of a scene: indices below 2^24 are exact in f32.
pub const ELEMENTS_MAX: u32 = 1 << 24;
/// Most colliders of a scene: each substep tests every free particle against every collider.
pub const COLLIDERS_MAX: usize = 1 << 16;
/// Most work of a step: substeps x (constraints x iterations + particles x (colliders + 1)), as
/// projections of constraints, motions of particles and tests against colliders. One core needs some
/// seconds for it. A cloth of a million particles with 6 million constraints and 20 substeps needs about
/// an eighth of it. Beyond it, a single `set` could stop a node for minutes.
pub const STEP_WORK_MAX: u64 = 1 << 30;
/// Longest time of a motion, in seconds.
pub const OVER_S_MAX: f32 = 3600.0;
/// Most points of all motions of a scene that are on their way. A keyframe has room for as many.
pub const MOTION_POINTS_MAX: usize = 2048;
/// End of the ids of clients: ids are below 2^53, so that every reader of JSON has them exactly.
pub const CLIENT_ID_END: u64 = 1 << 53;
/// Longest text of a scene, in bytes: as a file, and with every default and mesh written out.
pub const SCENE_SIZE_BYTES_MAX: usize = 16 << 20;

/// Largest coordinate in a scene or command, in m. f32 resolves 1 m at this distance.
pub const COORDINATE_MAX: f32 = 1e7;

/// A range of finite numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberRange {
    /// Lower end.
    pub min: f32,
    /// Upper end; `f32::MAX` means no limit.
    pub max: f32,
    /// The lower end itself lies outside.
    pub excludes_min: bool,
    /// The upper end itself lies outside.
    pub excludes_max: bool,
    /// Text of the range for error messages.
    pub text: &'static str,
}

impl NumberRange {
    /// 0 or more.
    pub const AT_LEAST_ZERO: Self = Self::closed(0.0, f32::MAX, "a number >= 0");
    /// More than 0.
    pub const POSITIVE: Self =
        Self { excludes_min: true, ..Self::closed(0.0, f32::MAX, "a number > 0") };
    /// A coordinate, or a component of a velocity or acceleration.
    pub const COORDINATE: Self = Self::closed(-COORDINATE_MAX, COORDINATE_MAX, "-1e7 to 1e7");
    /// Compliance in m/N. At the smallest substep h of 10 ns, compliance / h² is still finite in f32.
    pub const COMPLIANCE: Self = Self::closed(0.0, 1e20, "0 to 1e20 m/N");
    /// A share, such as a stiffness.
    pub const SHARE: Self = Self::closed(0.0, 1.0, "0 to 1");
    /// Over-relaxation factor. From 2 on, the projections diverge.
    pub const RELAXATION: Self = Self {
        excludes_min: true,
        excludes_max: true,
        ..Self::closed(0.0, 2.0, "more than 0 and less than 2; 1 is no relaxation")
    };
    /// Limit of a length divided by its rest length.
    pub const RATIO: Self =
        Self { excludes_min: true, ..Self::closed(1.0, f32::MAX, "more than 1") };
    /// Counts of substeps and iterations.
    pub const PASSES: Self = Self::closed(1.0, 1000.0, "a whole number from 1 to 1000");
    /// A finite number.
    pub const FINITE: Self = Self::closed(-f32::MAX, f32::MAX, "a finite number");
    /// A length in a command, such as a radius, in m.
    pub const LENGTH: Self = Self::closed(0.0, COORDINATE_MAX, "0 to 1e7");
    /// Time of a motion, in seconds.
    pub const SECONDS: Self = Self::closed(0.0, OVER_S_MAX, "0 to 3600");
    /// Component of an angular velocity, in rad/s.
    pub const SPIN: Self = Self::closed(-1e4, 1e4, "-1e4 to 1e4");
    /// Pace of a node in multiples of real time.
    pub const TIME_SCALE: Self = Self::closed(1e-3, 1e3, "0.001 to 1000");

    /// A range with both of its ends.
    pub const fn closed(min: f32, max: f32, text: &'static str) -> Self {
        Self { min, max, excludes_min: false, excludes_max: false, text }
    }

    /// Returns `true` if the number lies in the range. NaN lies in no range.
    pub fn contains(&self, number: f32) -> bool {
        let is_above_min = if self.excludes_min { number > self.min } else { number >= self.min };
        let is_below_max = if self.excludes_max { number < self.max } else { number <= self.max };
        is_above_min && is_below_max
    }

    /// Checks numbers from outside.
    ///
    /// # Errors
    /// A number is not finite, or not in the range.
    pub fn check(&self, numbers: &[f32]) -> Result<(), Reason> {
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(Reason::NonFinite);
        }
        let is_allowed = numbers.iter().all(|number| self.contains(*number));
        if is_allowed { Ok(()) } else { Err(Reason::OutOfRange) }
    }
}

/// Returns the allowed indices of `count` elements, as the remedy of an unknown one.
pub fn allowed_indices(count: usize) -> String {
    match count {
        0 => "it has none".to_owned(),
        1 => "allowed: 0".to_owned(),
        count => format!("allowed: 0 to {}", count - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn allowed_indices_end_before_the_count() {
        assert_eq!(allowed_indices(0), "it has none");
        assert_eq!(allowed_indices(1), "allowed: 0");
        assert_eq!(allowed_indices(168), "allowed: 0 to 167");
    }

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
