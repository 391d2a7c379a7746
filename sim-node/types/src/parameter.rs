//! The parameters that can change while a scene runs: one table for every program.

use serde::{Deserialize, Serialize};

use crate::json::non_finite::{number, vector};
use crate::range::NumberRange;

/// A parameter that can change while a scene runs.
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
    Contact = 15,
    ContactFriction = 16,
    Bending = 17,
    Friction = 18,
    Restitution = 19,
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

/// A row of the table of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterInfo {
    /// The parameter.
    pub parameter: Parameter,
    /// Name in scenes, commands and logs.
    pub name: &'static str,
    /// Unit of the value; empty for a plain number.
    pub unit: &'static str,
    /// Form of the value.
    pub form: ValueForm,
    /// Allowed values, for each component of a vector.
    pub range: NumberRange,
    /// Value in a scene that does not set it.
    pub default: ParameterValue,
    /// Meaning of off.
    pub off: OffMeaning,
    /// `set` can address the constraints of one kind.
    pub is_per_kind: bool,
    /// The value belongs to a collider. It is published with the colliders, and `set` can address one of them.
    pub is_per_collider: bool,
}

const NUMBER: ParameterInfo = ParameterInfo {
    parameter: Parameter::Gravity,
    name: "",
    unit: "",
    form: ValueForm::Number,
    range: NumberRange::AT_LEAST_ZERO,
    default: ParameterValue::Number(0.0),
    off: OffMeaning::NotAllowed,
    is_per_kind: false,
    is_per_collider: false,
};
const VECTOR: ParameterInfo = ParameterInfo {
    form: ValueForm::Vector,
    range: NumberRange::COORDINATE,
    default: ParameterValue::Vector([0.0; 3]),
    off: OffMeaning::Zero,
    ..NUMBER
};
const PASSES: ParameterInfo =
    ParameterInfo { form: ValueForm::Whole, range: NumberRange::PASSES, ..NUMBER };
const LIMIT: ParameterInfo =
    ParameterInfo { default: ParameterValue::Off, off: OffMeaning::NoLimit, ..NUMBER };
const SOFTNESS: ParameterInfo = ParameterInfo {
    default: ParameterValue::Off,
    off: OffMeaning::OwnOfEach,
    is_per_kind: true,
    ..NUMBER
};
const OF_COLLIDERS: ParameterInfo =
    ParameterInfo { off: OffMeaning::Zero, is_per_collider: true, ..NUMBER };

/// The table of parameters. The number of a [`Parameter`] is its index here.
pub const PARAMETERS: [ParameterInfo; 20] = [
    ParameterInfo {
        parameter: Parameter::Gravity,
        name: "gravity",
        unit: "m/s²",
        default: ParameterValue::Vector([0.0, -9.81, 0.0]),
        ..VECTOR
    },
    ParameterInfo {
        parameter: Parameter::Damping,
        name: "damping",
        unit: "1/s",
        off: OffMeaning::Zero,
        ..NUMBER
    },
    ParameterInfo {
        parameter: Parameter::WindVelocity,
        name: "wind_velocity",
        unit: "m/s",
        ..VECTOR
    },
    ParameterInfo {
        parameter: Parameter::WindDrag,
        name: "wind_drag",
        unit: "kg/m³",
        off: OffMeaning::Zero,
        ..NUMBER
    },
    ParameterInfo {
        parameter: Parameter::Substeps,
        name: "substeps",
        default: ParameterValue::Number(4.0),
        ..PASSES
    },
    ParameterInfo {
        parameter: Parameter::Iterations,
        name: "iterations",
        default: ParameterValue::Number(1.0),
        ..PASSES
    },
    ParameterInfo {
        parameter: Parameter::Relaxation,
        name: "relaxation",
        range: NumberRange::RELAXATION,
        default: ParameterValue::Number(1.0),
        ..NUMBER
    },
    ParameterInfo {
        parameter: Parameter::MaxStretch,
        name: "max_stretch",
        range: NumberRange::RATIO,
        ..LIMIT
    },
    ParameterInfo {
        parameter: Parameter::TearStretch,
        name: "tear_stretch",
        range: NumberRange::RATIO,
        ..LIMIT
    },
    ParameterInfo { parameter: Parameter::TearDistance, name: "tear_distance", unit: "m", ..LIMIT },
    ParameterInfo {
        parameter: Parameter::TearForce,
        name: "tear_force",
        unit: "N",
        range: NumberRange::POSITIVE,
        ..LIMIT
    },
    ParameterInfo {
        parameter: Parameter::MaxSpeed,
        name: "max_speed",
        unit: "m/s",
        range: NumberRange::POSITIVE,
        default: ParameterValue::Number(10_000.0),
        ..NUMBER
    },
    ParameterInfo {
        parameter: Parameter::TimeScale,
        name: "time_scale",
        range: NumberRange::TIME_SCALE,
        default: ParameterValue::Number(1.0),
        ..NUMBER
    },
    ParameterInfo {
        parameter: Parameter::Compliance,
        name: "compliance",
        unit: "m/N",
        range: NumberRange::COMPLIANCE,
        ..SOFTNESS
    },
    ParameterInfo {
        parameter: Parameter::Stiffness,
        name: "stiffness",
        range: NumberRange::SHARE,
        ..SOFTNESS
    },
    ParameterInfo {
        parameter: Parameter::Contact,
        name: "contact",
        unit: "m",
        range: NumberRange::POSITIVE,
        default: ParameterValue::Off,
        off: OffMeaning::Absent,
        ..NUMBER
    },
    ParameterInfo {
        parameter: Parameter::ContactFriction,
        name: "contact_friction",
        default: ParameterValue::Number(0.3),
        off: OffMeaning::Zero,
        ..NUMBER
    },
    // On a line the unit is N m².
    ParameterInfo {
        parameter: Parameter::Bending,
        name: "bending",
        unit: "N m",
        is_per_kind: false,
        ..SOFTNESS
    },
    ParameterInfo { parameter: Parameter::Friction, name: "friction", ..OF_COLLIDERS },
    ParameterInfo {
        parameter: Parameter::Restitution,
        name: "restitution",
        range: NumberRange::SHARE,
        ..OF_COLLIDERS
    },
];

impl Parameter {
    /// All parameters, by number.
    pub const ALL: [Self; 20] = [
        Self::Gravity,
        Self::Damping,
        Self::WindVelocity,
        Self::WindDrag,
        Self::Substeps,
        Self::Iterations,
        Self::Relaxation,
        Self::MaxStretch,
        Self::TearStretch,
        Self::TearDistance,
        Self::TearForce,
        Self::MaxSpeed,
        Self::TimeScale,
        Self::Compliance,
        Self::Stiffness,
        Self::Contact,
        Self::ContactFriction,
        Self::Bending,
        Self::Friction,
        Self::Restitution,
    ];

    /// Returns the parameter with this number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }

    /// Returns the parameter with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name() == name)
    }

    /// Returns the parameter's row of the table.
    pub const fn info(self) -> &'static ParameterInfo {
        &PARAMETERS[self as usize]
    }

    /// Name in scenes, commands and logs.
    pub fn name(self) -> &'static str {
        self.info().name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_of_a_row_is_the_number_of_its_parameter() {
        for (parameter, row) in Parameter::ALL.into_iter().zip(PARAMETERS) {
            assert_eq!(row.parameter, parameter);
            assert!(!row.name.is_empty());
        }
    }

    #[test]
    fn every_default_lies_in_its_range() {
        for ParameterInfo { name, range, default, off, .. } in PARAMETERS {
            match default {
                ParameterValue::Number(value) => assert!(range.contains(value), "{name}"),
                ParameterValue::Vector(value) => {
                    assert!(value.iter().all(|axis| range.contains(*axis)), "{name}");
                }
                ParameterValue::Off => assert_ne!(off, OffMeaning::NotAllowed, "{name}"),
            }
        }
    }
}
