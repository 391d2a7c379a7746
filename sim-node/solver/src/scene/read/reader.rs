//! Checks of single values. An error names the line, the field and what is allowed.

use std::cell::RefCell;
use std::ops::{Range, RangeInclusive};

use sim_types::{Method, NumberRange, Parameter, did_you_mean};

use super::value::{Number, Quaternion, Spanned, Tuple, Vector, Whole, Word};
use crate::scene::definition::anchor::NO_ROTATION;
use crate::scene::error::{Place, SceneError};
use crate::scene::model::Positions;

/// Checks values and creates errors at their place in the text.
pub(super) struct Reader<'a> {
    pub(super) place: Place<'a>,
    /// Reads a file that the scene names.
    pub(super) read_file: &'a dyn Fn(&str) -> Result<String, String>,
    /// Warnings about such files and other values, one sentence each.
    pub(super) warnings: RefCell<Vec<String>>,
    pub(super) is_planar: bool,
    pub(super) method: Method,
}

/// A size: in f32, it still adds up with a coordinate of the same magnitude.
pub(super) const SIZE: NumberRange = NumberRange {
    min: 0.0,
    excludes_min: true,
    text: "more than 0, at most 1e7",
    ..NumberRange::COORDINATE
};
/// A mass: its inverse is finite in f32, too. The excluded end is 2^-128.
pub(super) const MASS: NumberRange = NumberRange {
    min: f32::from_bits(0x0020_0000),
    text: "1e-38 to 1e38 kg",
    ..NumberRange::POSITIVE
};
/// A bending rigidity; 0 bends freely.
pub(super) const RIGIDITY: NumberRange = NumberRange::AT_LEAST_ZERO;
/// A period: a step counts it in whole numbers.
pub(super) const PERIOD: NumberRange =
    NumberRange { max: 1e6, text: "more than 0, at most 1e6 s", ..NumberRange::POSITIVE };
/// A component of an angular velocity.
pub(super) const ANGULAR_VELOCITY: NumberRange =
    NumberRange { min: -1e4, max: 1e4, text: "-1e4 to 1e4 rad/s", ..NumberRange::COORDINATE };
/// A coordinate, with the remedy for greater distances.
const POSITION: NumberRange = NumberRange {
    text: "-1e7 to 1e7; put a greater distance into `origin`",
    ..NumberRange::COORDINATE
};

impl Reader<'_> {
    pub(super) fn error<T>(
        &self,
        span: Range<usize>,
        field: &str,
        problem: impl Into<String>,
    ) -> Result<T, SceneError> {
        Err(self.place.error(span, field, problem.into()))
    }

    /// Returns a value that its table must have. `allowed` describes the value.
    pub(super) fn required<'f, T>(
        &self,
        value: Option<&'f T>,
        table: Range<usize>,
        field: &str,
        allowed: &str,
    ) -> Result<&'f T, SceneError> {
        let missing = || self.place.error(table, field, format!("is missing (allowed: {allowed})"));
        value.ok_or_else(missing)
    }

    pub(super) fn whole(
        &self,
        field: &str,
        value: &Whole,
        range: RangeInclusive<u32>,
    ) -> Result<u32, SceneError> {
        let number = *value.get_ref();
        if let Some(number) = u32::try_from(number).ok().filter(|number| range.contains(number)) {
            return Ok(number);
        }
        let (low, high) = range.into_inner();
        let allowed = if low == high { low.to_string() } else { format!("{low} to {high}") };
        let problem = format!("{number} is out of range (allowed: {allowed})");
        self.error(value.span(), field, problem)
    }

    /// Returns the text of a number as written.
    fn text(&self, number: &Number) -> &str {
        &self.place.text[number.span()]
    }

    /// Returns the number, rounded once from its text to f32.
    fn finite(&self, field: &str, number: &Number) -> Result<f32, SceneError> {
        let text = self.text(number).replace('_', "");
        #[allow(clippy::cast_possible_truncation, reason = "hexadecimal integers have no f32 text")]
        let value = text.parse().unwrap_or(*number.get_ref() as f32);
        if value.is_finite() {
            return Ok(value);
        }
        let problem = format!("{text} is not finite in 32 bits (allowed: a finite number)");
        self.error(number.span(), field, problem)
    }

    pub(super) fn ranged(
        &self,
        field: &str,
        number: &Number,
        range: NumberRange,
    ) -> Result<f32, SceneError> {
        let value = self.finite(field, number)?;
        if range.contains(value) {
            return Ok(value);
        }
        let problem = format!("{} is out of range (allowed: {})", self.text(number), range.text);
        self.error(number.span(), field, problem)
    }

    /// Returns two finite numbers.
    pub(super) fn pair(
        &self,
        field: &str,
        pair: &Spanned<Tuple<Number, 2>>,
    ) -> Result<[f32; 2], SceneError> {
        let [u, v] = &**pair.get_ref();
        Ok([self.finite(field, u)?, self.finite(field, v)?])
    }

    /// Returns a limit, or infinity for none.
    pub(super) fn limit(
        &self,
        field: &str,
        number: &Number,
        parameter: Parameter,
    ) -> Result<f32, SceneError> {
        if *number.get_ref() == f64::INFINITY {
            return Ok(f32::INFINITY);
        }
        let value = self.finite(field, number)?;
        let range = parameter.info().range;
        if range.contains(value) {
            return Ok(value);
        }
        let problem = format!(
            "{} is out of range (allowed: {}, or inf for off)",
            self.text(number),
            range.text
        );
        self.error(number.span(), field, problem)
    }

    /// Returns the numbers of a vector, also of one out of the plane of a scene of 2 dimensions.
    fn axes(&self, field: &str, vector: &Vector) -> Result<[f32; 3], SceneError> {
        let mut axes = [0.0; 3];
        for (axis, number) in axes.iter_mut().zip(vector.get_ref().iter()) {
            *axis = self.ranged(field, number, POSITION)?;
        }
        Ok(axes)
    }

    pub(super) fn vector(&self, field: &str, vector: &Vector) -> Result<[f32; 3], SceneError> {
        let axes = self.axes(field, vector)?;
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

    /// Returns a vector that is not zero.
    pub(super) fn direction(&self, field: &str, vector: &Vector) -> Result<[f32; 3], SceneError> {
        self.vector(field, vector)?;
        self.normal(field, vector)
    }

    /// Returns the normal of a plane. The normal of the plane of a scene of 2 dimensions is out of it.
    pub(super) fn normal(&self, field: &str, vector: &Vector) -> Result<[f32; 3], SceneError> {
        let axes = self.axes(field, vector)?;
        if axes != [0.0; 3] {
            return Ok(axes);
        }
        self.error(vector.span(), field, "has no direction (allowed: a vector other than 0)")
    }

    /// Returns a quaternion x, y, z, w; by default no rotation. In 2-D it rotates about z only.
    pub(super) fn rotation(
        &self,
        field: &str,
        rotation: Option<&Quaternion>,
    ) -> Result<[f32; 4], SceneError> {
        let Some(file) = rotation else { return Ok(NO_ROTATION) };
        let mut quaternion = [0.0; 4];
        for (part, number) in quaternion.iter_mut().zip(file.get_ref().iter()) {
            *part = self.ranged(field, number, NumberRange::COORDINATE)?;
        }
        if quaternion == [0.0; 4] {
            let problem = "has no direction (allowed: x, y, z, w that are not all 0)";
            return self.error(file.span(), field, problem);
        }
        if self.is_planar && quaternion[..2] != [0.0; 2] {
            let problem = "rotates out of the plane (allowed: [0, 0, z, w] in 2 dimensions)";
            return self.error(file.span(), field, problem);
        }
        Ok(quaternion)
    }

    pub(super) fn mass(&self, field: &str, mass: Option<&Number>) -> Result<f32, SceneError> {
        mass.map_or(Ok(1.0), |mass| self.ranged(field, mass, MASS))
    }

    /// Returns the choice that a word names.
    pub(super) fn word<T: Copy>(
        &self,
        field: &str,
        word: &Word,
        choices: &[(&'static str, T)],
    ) -> Result<T, SceneError> {
        let name = word.get_ref();
        if let Some((_, choice)) = choices.iter().find(|(known, _)| known == name) {
            return Ok(*choice);
        }
        let allowed = choices.iter().map(|(known, _)| *known).collect::<Vec<_>>().join(", ");
        let meant = did_you_mean(name, choices.iter().map(|(known, _)| *known));
        let problem = format!("\"{name}\" is unknown{meant} (allowed: {allowed})");
        self.error(word.span(), field, problem)
    }

    pub(super) fn softness(&self, field: &str, number: &Number) -> Result<f32, SceneError> {
        let parameter = match self.method {
            Method::Xpbd => Parameter::Compliance,
            Method::Pbd => Parameter::Stiffness,
        };
        self.ranged(field, number, parameter.info().range)
    }

    /// Returns the measure of softness that belongs to the scene's method. The other measure is an
    /// error.
    pub(super) fn softness_key<'f, T>(
        &self,
        field: impl Fn(&str) -> String,
        compliance: Option<&'f Spanned<T>>,
        stiffness: Option<&'f Spanned<T>>,
    ) -> Result<Option<(&'static str, &'f Spanned<T>)>, SceneError> {
        let (own, own_name, other, other_name) = match self.method {
            Method::Xpbd => (compliance, "compliance", stiffness, "stiffness"),
            Method::Pbd => (stiffness, "stiffness", compliance, "compliance"),
        };
        if let Some(other) = other {
            let method = self.method.name();
            let problem = format!("does not apply to method \"{method}\" (allowed: {own_name})");
            return self.error(other.span(), &field(other_name), problem);
        }
        Ok(own.map(|own| (own_name, own)))
    }

    /// Returns the index of an existing particle.
    pub(super) fn particle_index(
        &self,
        field: &str,
        index: &Whole,
        positions: &Positions,
    ) -> Result<u32, SceneError> {
        let Some(last) = positions.particle_count().checked_sub(1) else {
            let problem = format!(
                "{} is out of range: the scene has no particles (allowed: none)",
                index.get_ref()
            );
            return self.error(index.span(), field, problem);
        };
        self.whole(field, index, 0..=last)
    }
}
