//! Checks of single values: each is read once, and a wrong one is named with its line.

use std::cell::RefCell;
use std::ops::{Range, RangeInclusive};

use sim_types::{COORDINATE_MAX, Method, NumberRange};
use toml::Spanned;

use super::SceneError;
use super::error::Place;
use super::file::{Number, Vector, Whole};

/// A range of finite numbers, and the words for it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range32 {
    contains: fn(f32) -> bool,
    allowed: &'static str,
}

impl Range32 {
    pub(crate) const AT_LEAST_ZERO: Self =
        Self { contains: |value| value >= 0.0, allowed: NumberRange::AT_LEAST_ZERO.text };
    pub(crate) const POSITIVE: Self =
        Self { contains: |value| value > 0.0, allowed: NumberRange::POSITIVE.text };
    pub(crate) const COMPLIANCE: Self = Self {
        contains: |value| NumberRange::COMPLIANCE.contains(value),
        allowed: NumberRange::COMPLIANCE.text,
    };
    pub(crate) const SHARE: Self = Self {
        contains: |value| NumberRange::SHARE.contains(value),
        allowed: NumberRange::SHARE.text,
    };
    /// 1/mass must be a number of f32, too.
    pub(crate) const MASS: Self = Self {
        contains: |value| value > 0.0 && (1.0 / value).is_finite() && 1.0 / value > 0.0,
        allowed: "a number > 0 in kg, and 1/mass a number, too: 1e-38 to 1e38",
    };
    pub(crate) const RELAXATION: Self = Self {
        contains: |value| NumberRange::RELAXATION.contains(value),
        allowed: NumberRange::RELAXATION.text,
    };
    pub(crate) const RATIO: Self = Self {
        contains: |value| NumberRange::RATIO.contains(value),
        allowed: "more than 1, or inf for off",
    };
    pub(crate) const DISTANCE_LIMIT: Self =
        Self { contains: |value| value >= 0.0, allowed: "a number >= 0, or inf for off" };
    pub(crate) const FORCE_LIMIT: Self =
        Self { contains: |value| value > 0.0, allowed: "a number > 0 in N, or inf for off" };
    /// In f32 a coordinate and a size of the same magnitude still add up.
    pub(crate) const SIZE: Self = Self {
        contains: |value| value > 0.0 && value <= COORDINATE_MAX,
        allowed: "more than 0, at most 1e7",
    };
    /// A step counts it in whole numbers.
    pub(crate) const PERIOD: Self = Self {
        contains: |value| value > 0.0 && value <= 1e6,
        allowed: "more than 0, at most 1e6 s",
    };
    pub(crate) const ANGULAR_VELOCITY: Self =
        Self { contains: |value| value.abs() <= 1e4, allowed: "-1e4 to 1e4 rad/s" };
    pub(crate) const COORDINATE: Self = Self {
        contains: |value| value.abs() <= COORDINATE_MAX,
        allowed: "-1e7 to 1e7; put a greater distance into `origin`",
    };

    pub(crate) fn has(self, value: f32) -> bool {
        (self.contains)(value)
    }
}

/// Checks values, and says where in the text a wrong one stands.
pub(super) struct Reader<'a> {
    pub(super) place: Place<'a>,
    /// Reads a file that the scene names.
    pub(super) read_file: &'a dyn Fn(&str) -> Result<String, String>,
    /// What was found in such files.
    pub(super) findings: RefCell<Vec<String>>,
    pub(super) is_planar: bool,
    pub(super) method: Method,
}

impl Reader<'_> {
    pub(super) fn error<T>(
        &self,
        span: Range<usize>,
        field: &str,
        problem: String,
    ) -> Result<T, SceneError> {
        Err(self.place.error(span, field, problem))
    }

    pub(super) fn whole(
        &self,
        field: &str,
        value: &Whole,
        range: RangeInclusive<u32>,
    ) -> Result<u32, SceneError> {
        let found = *value.get_ref();
        match u32::try_from(found) {
            Ok(found) if range.contains(&found) => Ok(found),
            _ => {
                let (low, high) = range.into_inner();
                let allowed =
                    if low == high { low.to_string() } else { format!("{low} to {high}") };
                self.error(
                    value.span(),
                    field,
                    format!("{found} is out of range (allowed: {allowed})"),
                )
            }
        }
    }

    /// The number, rounded once from its text to f32.
    pub(super) fn finite(&self, field: &str, number: &Number) -> Result<f32, SceneError> {
        let text = self.place.text[number.span()].replace('_', "");
        #[allow(clippy::cast_possible_truncation, reason = "hexadecimal integers have no f32 text")]
        let value = text.parse().unwrap_or(*number.get_ref() as f32);
        if value.is_finite() {
            return Ok(value);
        }
        self.error(
            number.span(),
            field,
            format!("{text} is not a finite number of 32 bits (allowed: a finite number)"),
        )
    }

    pub(super) fn ranged(
        &self,
        field: &str,
        number: &Number,
        range: Range32,
    ) -> Result<f32, SceneError> {
        let value = self.finite(field, number)?;
        if range.has(value) {
            return Ok(value);
        }
        let problem = format!("{value} is out of range (allowed: {})", range.allowed);
        self.error(number.span(), field, problem)
    }

    pub(super) fn vector(&self, field: &str, vector: &Vector) -> Result<[f32; 3], SceneError> {
        let mut axes = [0.0; 3];
        for (axis, number) in axes.iter_mut().zip(vector.get_ref()) {
            *axis = self.ranged(field, number, Range32::COORDINATE)?;
        }
        if self.is_planar && axes[2] != 0.0 {
            let problem = format!("z is {} in a scene of 2 dimensions (allowed: 0)", axes[2]);
            return self.error(vector.span(), field, problem);
        }
        Ok(axes)
    }

    pub(super) fn vector_or(
        &self,
        field: &str,
        vector: Option<&Vector>,
        default: [f32; 3],
    ) -> Result<[f32; 3], SceneError> {
        vector.map_or(Ok(default), |vector| self.vector(field, vector))
    }

    pub(super) fn mass(&self, field: &str, mass: Option<&Number>) -> Result<f32, SceneError> {
        mass.map_or(Ok(1.0), |mass| self.ranged(field, mass, Range32::MASS))
    }

    pub(super) fn softness(&self, field: &str, number: &Number) -> Result<f32, SceneError> {
        let range = match self.method {
            Method::Xpbd => Range32::COMPLIANCE,
            Method::Pbd => Range32::SHARE,
        };
        self.ranged(field, number, range)
    }

    /// Of the two measures of softness, the one that belongs to the scene's method; the other one
    /// is an error.
    pub(super) fn softness_key<'f, T>(
        &self,
        field: impl Fn(&str) -> String,
        compliance: Option<&'f Spanned<T>>,
        stiffness: Option<&'f Spanned<T>>,
    ) -> Result<Option<(&'static str, &'f Spanned<T>)>, SceneError> {
        let (own, own_name, other, other_name, method) = match self.method {
            Method::Xpbd => (compliance, "compliance", stiffness, "stiffness", "xpbd"),
            Method::Pbd => (stiffness, "stiffness", compliance, "compliance", "pbd"),
        };
        if let Some(other) = other {
            let problem = format!("means nothing with method \"{method}\" (allowed: {own_name})");
            return self.error(other.span(), &field(other_name), problem);
        }
        Ok(own.map(|own| (own_name, own)))
    }
}
