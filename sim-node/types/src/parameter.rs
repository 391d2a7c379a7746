//! The parameters that can change while a scene runs: one table for every program.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::json::{number, vector};
use crate::kinds::ConstraintKind;
use crate::kinds::Method;
use crate::limits::NumberRange;
use crate::suggestion::nearest;

/// A parameter that can change while a scene runs. Its number is its index in [`PARAMETERS`], which describes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
#[allow(missing_docs, reason = "described in the table of parameters")]
pub enum Parameter {
    Gravity = 0,
    Damping = 1,
    WindVelocity = 2,
    WindDrag = 3,
    Substeps = 4,
    Iterations = 5,
    Relaxation = 6,
    MaxStretch = 7,
    TearStretch = 8,
    TearDistance = 9,
    TearForce = 10,
    MaxSpeed = 11,
    TimeScale = 12,
    Compliance = 13,
    Stiffness = 14,
    ContactThickness = 15,
    ContactFriction = 16,
    Bending = 17,
    Friction = 18,
    Restitution = 19,
}

/// A row of the table of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterInfo {
    /// The parameter.
    pub parameter: Parameter,
    /// Name in commands, recordings, Python and the page. A key of a scene's table has the table before the dot, except
    /// for those of `[solver]`.
    pub name: &'static str,
    /// Key in a scene, with its table. Empty if a scene has no value for the parameter.
    pub scene_key: &'static str,
    /// Unit of the value. Empty for a plain number.
    pub unit: &'static str,
    /// Effect, in words.
    pub meaning: &'static str,
    /// Form of the value.
    pub form: ValueForm,
    /// Allowed values, for each component of a vector.
    pub range: NumberRange,
    /// Value in a scene that does not set it.
    pub default: ParameterValue,
    /// Meaning of off.
    pub off: OffMeaning,
    /// Parts of a scene that can have values of their own.
    pub parts: Parts,
    /// Method to which the parameter belongs. `None` for both.
    pub method: Option<Method>,
    /// Derived state that depends on the value.
    pub affects: Affects,
    /// Slider on the page.
    pub slider: Option<Slider>,
}

/// The value of a parameter. Its JSON form is a number, three numbers or null.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, three numbers or null")]
pub enum ParameterValue {
    /// A number in the parameter's unit.
    Number(#[serde(with = "number")] f32),
    /// Three numbers in the parameter's unit.
    Vector(#[serde(with = "vector")] [f32; 3]),
    /// The parameter is off; see [`OffMeaning`].
    Off,
}

/// The form of a parameter's values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ValueForm {
    /// A number.
    Number,
    /// A whole number.
    Whole,
    /// Three numbers.
    Vector,
}

/// The meaning of [`ParameterValue::Off`] for a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OffMeaning {
    /// The parameter cannot be off.
    NotAllowed,
    /// Off means 0.
    Zero,
    /// Off means no limit.
    NoLimit,
    /// Off means that what the parameter describes does not take place.
    Absent,
    /// Off means that each constraint or bend has its own value, as after a load. `set` does not accept it.
    OwnOfEach,
}

/// The parts of a scene that can have values of their own for a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parts {
    /// None: the parameter has one value.
    None,
    /// The kinds of constraints. There is no value for all of them together.
    Kinds,
    /// Generated blocks, beside a value for all bends.
    Blocks,
    /// Colliders. Their values are published with the colliders.
    Colliders,
}

/// The part of a scene that a value is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Part {
    /// The whole scene.
    All,
    /// The constraints of a kind.
    Kind(ConstraintKind),
    /// The bends of a generated block, by its index.
    Block(u32),
    /// A collider, by its index.
    Collider(u32),
}

/// Derived state that depends on a parameter, from nothing to everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Affects {
    /// None: the step reads the value itself.
    Nothing,
    /// The limits of constraints.
    Limits,
    /// Everything derived from constraints and bends, but only when the value becomes 0 or off, or ceases to be.
    Presence,
    /// Everything derived from constraints and bends.
    Constraints,
    /// Everything derived from constraints and bends, and the tethers, whose paths consist of rigid constraints.
    RigidPaths,
}

/// A slider on the page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slider {
    /// Place among the sliders, from 0.
    pub place: usize,
    /// Text beside it.
    pub label: &'static str,
    /// It is logarithmic.
    pub is_logarithmic: bool,
    /// Value at its lower end.
    pub least: f32,
    /// Value at its upper end.
    pub most: f32,
    /// Value after its switch is turned on. Without it, there is no switch.
    pub when_on: Option<f32>,
}

const NUMBER: ParameterInfo = ParameterInfo {
    parameter: Parameter::Gravity,
    name: "",
    scene_key: "",
    unit: "",
    meaning: "",
    form: ValueForm::Number,
    range: NumberRange::AT_LEAST_ZERO,
    default: ParameterValue::Number(0.0),
    off: OffMeaning::NotAllowed,
    parts: Parts::None,
    method: None,
    affects: Affects::Nothing,
    slider: None,
};
const VECTOR: ParameterInfo = ParameterInfo {
    form: ValueForm::Vector,
    range: NumberRange::COORDINATE,
    default: ParameterValue::Vector([0.0; 3]),
    off: OffMeaning::Zero,
    ..NUMBER
};
const PASSES: ParameterInfo = ParameterInfo {
    form: ValueForm::Whole,
    range: NumberRange::PASSES,
    affects: Affects::Constraints,
    ..NUMBER
};
const LIMIT: ParameterInfo = ParameterInfo {
    default: ParameterValue::Off,
    off: OffMeaning::NoLimit,
    affects: Affects::Limits,
    ..NUMBER
};
const SOFTNESS: ParameterInfo = ParameterInfo {
    default: ParameterValue::Off,
    off: OffMeaning::OwnOfEach,
    parts: Parts::Kinds,
    affects: Affects::RigidPaths,
    ..NUMBER
};
const OF_COLLIDERS: ParameterInfo =
    ParameterInfo { off: OffMeaning::Zero, parts: Parts::Colliders, ..NUMBER };

const fn slider(place: usize, label: &'static str, least: f32, most: f32) -> Slider {
    Slider { place, label, is_logarithmic: false, least, most, when_on: None }
}

impl Slider {
    const fn logarithmic(self) -> Self {
        Self { is_logarithmic: true, ..self }
    }

    const fn when_on(self, value: f32) -> Self {
        Self { when_on: Some(value), ..self }
    }
}

/// The table of parameters. The number of a [`Parameter`] is its index here.
#[rustfmt::skip]
pub const PARAMETERS: [ParameterInfo; 20] = [
    ParameterInfo { parameter: Parameter::Gravity, name: "gravity", scene_key: "gravity", unit: "m/s²",
        meaning: "acceleration of free particles",
        default: ParameterValue::Vector([0.0, -9.81, 0.0]), slider: Some(slider(0, "Gravity", -20.0, 20.0)), ..VECTOR },
    ParameterInfo { parameter: Parameter::Damping, name: "damping", scene_key: "solver.damping", unit: "1/s",
        meaning: "decay rate of velocities",
        off: OffMeaning::Zero, slider: Some(slider(3, "Damping", 0.0, 5.0)), ..NUMBER },
    ParameterInfo { parameter: Parameter::WindVelocity, name: "wind.velocity", scene_key: "wind.velocity",
        unit: "m/s",
        meaning: "velocity of the air without gusts; no effect in a scene without a surface, or while `wind.drag` \
            is 0",
        slider: Some(slider(1, "Wind", -20.0, 20.0)), ..VECTOR },
    ParameterInfo { parameter: Parameter::WindDrag, name: "wind.drag", scene_key: "wind.drag", unit: "kg/m³",
        meaning: "half the density of the air times the drag coefficient; 0 in a scene without `[wind]`",
        off: OffMeaning::Zero, affects: Affects::Presence,
        slider: Some(slider(2, "Wind drag", 0.0, 2.0).when_on(0.6)), ..NUMBER },
    ParameterInfo { parameter: Parameter::Substeps, name: "substeps", scene_key: "solver.substeps",
        meaning: "substeps of a step",
        default: ParameterValue::Number(4.0), slider: Some(slider(8, "Substeps", 1.0, 32.0)), ..PASSES },
    ParameterInfo { parameter: Parameter::Iterations, name: "iterations", scene_key: "solver.iterations",
        meaning: "passes over the constraints in a substep",
        default: ParameterValue::Number(1.0), slider: Some(slider(7, "Iterations", 1.0, 32.0)), ..PASSES },
    ParameterInfo { parameter: Parameter::Relaxation, name: "relaxation", scene_key: "solver.relaxation",
        meaning: "fraction of each correction that a pass applies",
        range: NumberRange::RELAXATION, default: ParameterValue::Number(1.0), affects: Affects::Constraints, ..NUMBER },
    ParameterInfo { parameter: Parameter::MaxStretch, name: "max_stretch", scene_key: "solver.max_stretch",
        meaning: "length, divided by the rest length, that no constraint exceeds",
        range: NumberRange::RATIO, ..LIMIT },
    ParameterInfo { parameter: Parameter::TearStretch, name: "tear_stretch", scene_key: "solver.tear_stretch",
        meaning: "length, divided by the rest length, at which a constraint tears",
        range: NumberRange::RATIO, slider: Some(slider(10, "Tear stretch", 1.01, 4.0).when_on(1.5)), ..LIMIT },
    ParameterInfo { parameter: Parameter::TearDistance, name: "tear_distance", scene_key: "solver.tear_distance",
        unit: "m",
        meaning: "excess over the rest length at which a constraint tears",
        slider: Some(slider(11, "Tear distance", 1e-3, 100.0).when_on(0.1).logarithmic()), ..LIMIT },
    ParameterInfo { parameter: Parameter::TearForce, name: "tear_force", scene_key: "solver.tear_force", unit: "N",
        meaning: "force at which a constraint tears",
        range: NumberRange::POSITIVE, slider: Some(slider(9, "Tear force", 1e-3, 1e5).when_on(50.0).logarithmic()), ..LIMIT },
    ParameterInfo { parameter: Parameter::MaxSpeed, name: "max_speed", scene_key: "solver.max_speed", unit: "m/s",
        meaning: "largest speed of a particle",
        range: NumberRange::POSITIVE, default: ParameterValue::Number(10_000.0), ..NUMBER },
    ParameterInfo { parameter: Parameter::TimeScale, name: "time_scale",
        meaning: "simulated time per real time: the pace of the node, which is not part of the state",
        range: NumberRange::TIME_SCALE, default: ParameterValue::Number(1.0),
        slider: Some(slider(16, "Speed", 0.01, 10.0).logarithmic()), ..NUMBER },
    ParameterInfo { parameter: Parameter::Compliance, name: "compliance", unit: "m/N",
        meaning: "softness of constraints, in place of their own; method \"xpbd\" only",
        range: NumberRange::COMPLIANCE, method: Some(Method::Xpbd),
        slider: Some(slider(4, "Compliance", 1e-8, 10.0).logarithmic()), ..SOFTNESS },
    ParameterInfo { parameter: Parameter::Stiffness, name: "stiffness",
        meaning: "stiffness of constraints, in place of their own; method \"pbd\" only",
        range: NumberRange::SHARE, method: Some(Method::Pbd), slider: Some(slider(5, "Stiffness", 0.0, 1.0)),
        ..SOFTNESS },
    ParameterInfo { parameter: Parameter::ContactThickness, name: "contact.thickness", scene_key: "contact.thickness",
        unit: "m",
        meaning: "distance that the centres of two particles keep, or with `mode = \"surfaces\"` a particle and a \
            triangle; at load, at most 32 pairs of particles, each counted once, or 128 triangles for each \
            particle, on average, may be within 1.6 times of it",
        range: NumberRange::POSITIVE, default: ParameterValue::Off, off: OffMeaning::Absent,
        affects: Affects::Presence, slider: Some(slider(12, "Contact distance", 1e-3, 1.0).when_on(0.02).logarithmic()),
        ..NUMBER },
    ParameterInfo { parameter: Parameter::ContactFriction, name: "contact.friction", scene_key: "contact.friction",
        meaning: "friction between particles",
        default: ParameterValue::Number(0.3), off: OffMeaning::Zero,
        slider: Some(slider(13, "Contact friction", 0.0, 2.0)), ..NUMBER },
    ParameterInfo { parameter: Parameter::Bending, name: "bending", unit: "N m",
        meaning: "rigidity of bends, in place of their own, of a rope or a line in N m²; scenes with bends only",
        parts: Parts::Blocks, affects: Affects::Constraints, slider: Some(slider(6, "Bending", 1e-7, 10.0).logarithmic()),
        ..SOFTNESS },
    ParameterInfo { parameter: Parameter::Friction, name: "friction",
        meaning: "friction of colliders; scenes with colliders only",
        slider: Some(slider(14, "Collider friction", 0.0, 2.0)), ..OF_COLLIDERS },
    ParameterInfo { parameter: Parameter::Restitution, name: "restitution",
        meaning: "fraction of the approach speed that a particle keeps at colliders; scenes with colliders only",
        range: NumberRange::SHARE, affects: Affects::Presence, slider: Some(slider(15, "Collider bounce", 0.0, 1.0)),
        ..OF_COLLIDERS },
];

impl Parameter {
    /// Returns the parameter with this number.
    pub fn from_number(number: u32) -> Option<Self> {
        PARAMETERS.get(number as usize).map(|info| info.parameter)
    }

    /// Returns the parameter with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        PARAMETERS.iter().find(|info| info.name == name).map(|info| info.parameter)
    }

    /// Returns the parameter and the part of a name such as `compliance.shear`, `bending.1` or `friction.2`.
    ///
    /// # Errors
    /// The allowed names in words: there is no such parameter, or it has no such part.
    pub fn from_path(path: &str) -> Result<(Self, Part), String> {
        if let Some(parameter) = Self::from_name(path) {
            return Ok((parameter, Part::All));
        }
        let words = path.rsplit_once('.');
        let words = words.and_then(|(name, part)| Some((Self::from_name(name)?, part)));
        let (parameter, word) = words.ok_or_else(|| Self::allowed_names(path))?;
        let (part, allowed) = match parameter.info().parts {
            Parts::None => (None, ", which has one value"),
            Parts::Kinds => (
                ConstraintKind::from_name(word).map(Part::Kind),
                ".KIND, where KIND is structural, shear, bend or tether",
            ),
            Parts::Blocks => (
                word.parse().ok().map(Part::Block),
                ".N, where N is a generated block, counted from 0",
            ),
            Parts::Colliders => {
                (word.parse().ok().map(Part::Collider), ".N, where N is a collider, counted from 0")
            }
        };
        let part = part.ok_or_else(|| format!("{name}{allowed}", name = parameter.name()))?;
        Ok((parameter, part))
    }

    /// Returns the name of a part of this parameter, as [`Self::from_path`] reads it.
    pub fn path(self, part: Part) -> String {
        let name = self.name();
        match part {
            Part::All => name.to_owned(),
            Part::Kind(kind) => format!("{name}.{}", kind.name()),
            Part::Block(index) | Part::Collider(index) => format!("{name}.{index}"),
        }
    }

    /// Returns the parameter that had this name before version 0.3.
    pub fn from_old_name(name: &str) -> Option<Self> {
        let is_former = |info: &&ParameterInfo| info.name.replace('.', "_") == name;
        let former = PARAMETERS.iter().find(is_former).map(|info| info.parameter);
        if name == "contact" { Some(Self::ContactThickness) } else { former }
    }

    /// Returns the names of all parameters as the remedy of an unknown name, and the one that it most likely stands for.
    /// Callers put these words in parentheses, so they have none.
    pub fn allowed_names(unknown: &str) -> String {
        let names = PARAMETERS.map(|info| info.name);
        let all = names.join(", ");
        if let Some(renamed) = Self::from_old_name(unknown) {
            return format!("{all}; '{unknown}' is now called '{}'", renamed.name());
        }
        match nearest(unknown, names) {
            Some(name) => format!("{all}; did you mean '{name}'?"),
            None => all,
        }
    }

    /// Returns the parameter's row of the table.
    pub const fn info(self) -> &'static ParameterInfo {
        &PARAMETERS[self as usize]
    }

    /// Name in commands, recordings, Python and the page.
    pub fn name(self) -> &'static str {
        self.info().name
    }
}

impl ParameterInfo {
    /// Returns `true` if a scene can have this value, apart from its dimensions.
    pub fn accepts(&self, value: ParameterValue) -> bool {
        let is_in_range = value.numbers().iter().all(|number| self.range.contains(*number));
        match (self.form, value) {
            (_, ParameterValue::Off) => {
                !matches!(self.off, OffMeaning::NotAllowed | OffMeaning::OwnOfEach)
            }
            (ValueForm::Whole, ParameterValue::Number(number)) => {
                number.fract() == 0.0 && is_in_range
            }
            (ValueForm::Number, ParameterValue::Number(_))
            | (ValueForm::Vector, ParameterValue::Vector(_)) => is_in_range,
            _ => false,
        }
    }

    /// Returns the allowed values in words.
    pub fn allowed_values(&self) -> String {
        let values = match self.form {
            ValueForm::Vector => format!("three numbers, each {}, z 0 in 2-D", self.range.text),
            ValueForm::Number | ValueForm::Whole => self.range.text.to_owned(),
        };
        let off = match self.off {
            OffMeaning::Zero => ", or off for 0",
            OffMeaning::NoLimit => ", or off for no limit",
            OffMeaning::Absent => ", or off for none",
            OffMeaning::NotAllowed | OffMeaning::OwnOfEach => "",
        };
        let part = match self.parts {
            Parts::Kinds => ", for one kind or all",
            Parts::Colliders => ", for one collider or all",
            Parts::None | Parts::Blocks => "",
        };
        format!("{values}{off}{part}")
    }
}

impl ParameterValue {
    /// Returns the numbers of the value: one, three, or none for off.
    pub fn numbers(&self) -> &[f32] {
        match self {
            Self::Number(number) => std::slice::from_ref(number),
            Self::Vector(vector) => vector,
            Self::Off => &[],
        }
    }

    /// Returns the number of a value that is one.
    pub fn number(self) -> Option<f32> {
        match self {
            Self::Number(number) => Some(number),
            Self::Vector(_) | Self::Off => None,
        }
    }

    /// Returns the value with these [`Self::numbers`]; `None` for any other count than 0, 1 and 3.
    pub fn from_numbers(numbers: &[f32]) -> Option<Self> {
        match *numbers {
            [] => Some(Self::Off),
            [number] => Some(Self::Number(number)),
            [x, y, z] => Some(Self::Vector([x, y, z])),
            _ => None,
        }
    }

    /// Returns `true` if both values have the same bits.
    pub fn has_bits_of(&self, other: &Self) -> bool {
        let [own, others] =
            [self, other].map(|value| value.numbers().iter().map(|one| one.to_bits()));
        own.eq(others)
    }
}

/// As `ctl set` accepts it.
impl fmt::Display for ParameterValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(formatter),
            Self::Vector([x, y, z]) => write!(formatter, "{x} {y} {z}"),
            Self::Off => formatter.write_str("off"),
        }
    }
}

/// In words, such as `shear` or `block 1`.
impl fmt::Display for Part {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => formatter.write_str("all"),
            Self::Kind(kind) => formatter.write_str(kind.name()),
            Self::Block(block) => write!(formatter, "block {block}"),
            Self::Collider(collider) => write!(formatter, "collider {collider}"),
        }
    }
}

impl From<f32> for ParameterValue {
    fn from(number: f32) -> Self {
        Self::Number(number)
    }
}

impl From<[f32; 3]> for ParameterValue {
    fn from(vector: [f32; 3]) -> Self {
        Self::Vector(vector)
    }
}

/// `None` is off.
impl From<Option<f32>> for ParameterValue {
    fn from(number: Option<f32>) -> Self {
        number.map_or(Self::Off, Self::Number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_of_a_row_is_the_number_of_its_parameter() {
        for (number, row) in (0..).zip(PARAMETERS) {
            assert_eq!(row.parameter as u32, number);
            assert_eq!(Parameter::from_number(number), Some(row.parameter));
            assert_eq!(Parameter::from_name(row.name), Some(row.parameter));
        }
        assert_eq!(Parameter::from_number(u32::MAX), None);
    }

    #[test]
    fn every_default_is_allowed() {
        for row in PARAMETERS {
            let is_own = row.default == ParameterValue::Off && row.off == OffMeaning::OwnOfEach;
            assert!(is_own || row.accepts(row.default), "{}", row.name);
        }
    }

    #[test]
    fn sliders_have_places_without_gaps() {
        let mut sliders: Vec<_> = PARAMETERS.iter().filter_map(|row| row.slider).collect();
        sliders.sort_by_key(|slider| slider.place);
        for (place, slider) in sliders.iter().enumerate() {
            assert!(slider.place == place && slider.least < slider.most, "{slider:?}");
        }
    }

    #[test]
    fn a_path_names_a_parameter_and_its_part() {
        let shear = Part::Kind(ConstraintKind::Shear);
        for (path, expected) in [
            ("wind.drag", (Parameter::WindDrag, Part::All)),
            ("compliance", (Parameter::Compliance, Part::All)),
            ("compliance.shear", (Parameter::Compliance, shear)),
            ("bending.3", (Parameter::Bending, Part::Block(3))),
            ("friction.2", (Parameter::Friction, Part::Collider(2))),
        ] {
            assert_eq!(Parameter::from_path(path), Ok(expected));
            assert_eq!(expected.0.path(expected.1), path);
        }
        for (path, allowed) in [
            ("contact.friction.2", "contact.friction, which has one value"),
            ("damping.shear", "damping, which has one value"),
            ("stiffness.silk", "stiffness.KIND, where KIND is structural, shear, "),
            ("bending.-1", "bending.N, where N is a generated block"),
            ("friction.shear", "friction.N, where N is a collider"),
            ("", "gravity, damping, "),
            ("silk.shear", "gravity, damping, "),
        ] {
            let error = Parameter::from_path(path).unwrap_err();
            assert!(error.starts_with(allowed), "{path}: {error}");
        }
    }

    #[test]
    fn an_old_name_is_answered_with_the_new_one() {
        for (old, new) in [
            ("contact", "contact.thickness"),
            ("contact_thickness", "contact.thickness"),
            ("contact_friction", "contact.friction"),
            ("wind_velocity", "wind.velocity"),
            ("wind_drag", "wind.drag"),
        ] {
            assert_eq!(Parameter::from_name(old), None);
            let allowed = Parameter::allowed_names(old);
            assert!(allowed.ends_with(&format!("; '{old}' is now called '{new}'")), "{allowed}");
        }
        let misspelt = Parameter::allowed_names("gravty");
        assert!(misspelt.starts_with("gravity, damping, "), "{misspelt}");
        assert!(misspelt.ends_with("; did you mean 'gravity'?"), "{misspelt}");
    }

    #[test]
    fn a_value_is_allowed_by_its_form_its_range_and_the_meaning_of_off() {
        let accepts = |parameter: Parameter, value: ParameterValue| parameter.info().accepts(value);
        assert!(accepts(Parameter::Substeps, 4.0.into()));
        assert!(!accepts(Parameter::Substeps, 4.5.into()));
        assert!(!accepts(Parameter::Damping, (-1.0).into()));
        assert!(!accepts(Parameter::Damping, f32::NAN.into()));
        assert!(!accepts(Parameter::Damping, [0.0; 3].into()));
        assert!(!accepts(Parameter::Gravity, [0.0, 0.0, 2e7].into()));
        assert!(accepts(Parameter::TearForce, ParameterValue::Off));
        assert!(!accepts(Parameter::Bending, ParameterValue::Off));
        assert!(!accepts(Parameter::TimeScale, ParameterValue::Off));
    }

    #[test]
    fn the_allowed_values_name_range_off_and_kind() {
        let text = |parameter: Parameter| parameter.info().allowed_values();
        assert_eq!(text(Parameter::Substeps), "a whole number from 1 to 1000");
        assert_eq!(text(Parameter::TearForce), "a number > 0, or off for no limit");
        assert_eq!(text(Parameter::Stiffness), "0 to 1, for one kind or all");
        let gravity = "three numbers, each -1e7 to 1e7, z 0 in 2-D, or off for 0";
        assert_eq!(text(Parameter::Gravity), gravity);
    }
}
