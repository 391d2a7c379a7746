//! Parameters in Foxglove's form: a name and a plain value.
//!
//! A parameter that is off has the value "off", because clients never see a parameter without a value.
//! A softness has one name for all constraints and one for each kind.

use foxglove::websocket::{Parameter, ParameterType, ParameterValue};
use sim_contract::{ConstraintKind, PlainF32, Reason, SettingKind, SettingValue};

use crate::message::Command;
use crate::message::parameters::{Limit, Parameters, PerKind};
use crate::message::settings::{SETTINGS, ValueKind};

/// Value of a parameter that is off.
const OFF: &str = "off";
/// Value of a softness that was not set: each constraint has its own.
const OWN: &str = "as in the scene";
const KINDS: [ConstraintKind; 4] = [
    ConstraintKind::Structural,
    ConstraintKind::Shear,
    ConstraintKind::Bend,
    ConstraintKind::Tether,
];

/// Lists all parameters with their values.
pub(super) fn list(parameters: &Parameters) -> Vec<Parameter> {
    SETTINGS.iter().flat_map(|setting| named(setting.name, parameters)).collect()
}

/// Lists the parameters of one setting.
fn named(name: &str, all: &Parameters) -> Vec<Parameter> {
    let one = |value| vec![Parameter { name: name.to_owned(), ..value }];
    match name {
        "gravity" => one(vector(all.gravity)),
        "wind_velocity" => one(vector(all.wind_velocity)),
        "wind_drag" => one(number(all.wind_drag)),
        "damping" => one(number(all.damping)),
        "substeps" => one(whole(all.substeps)),
        "iterations" => one(whole(all.iterations)),
        "relaxation" => one(number(all.relaxation)),
        "max_stretch" => one(limit(all.max_stretch, OFF)),
        "tear_stretch" => one(limit(all.tear_stretch, OFF)),
        "tear_distance" => one(limit(all.tear_distance, OFF)),
        "tear_force" => one(limit(all.tear_force, OFF)),
        "max_speed" => one(number(all.max_speed)),
        "time_scale" => one(number(all.time_scale)),
        "compliance" => per_kind(name, &all.compliance),
        "stiffness" => per_kind(name, &all.stiffness),
        _ => Vec::new(),
    }
}

fn per_kind(name: &str, values: &PerKind) -> Vec<Parameter> {
    let each = [values.structural, values.shear, values.bend, values.tether];
    let common = if each.iter().all(|value| *value == each[0]) { each[0] } else { None };
    let mut parameters = vec![Parameter { name: name.to_owned(), ..limit(common, OWN) }];
    parameters.extend(KINDS.iter().zip(each).map(|(kind, value)| Parameter {
        name: format!("{name}.{}", kind.name()),
        ..limit(value, OWN)
    }));
    parameters
}

fn unnamed(r#type: Option<ParameterType>, value: ParameterValue) -> Parameter {
    Parameter { name: String::new(), r#type, value: Some(value) }
}

fn number(value: PlainF32) -> Parameter {
    unnamed(Some(ParameterType::Float64), ParameterValue::Float64(plain(value)))
}

fn whole(value: PlainF32) -> Parameter {
    #[allow(clippy::cast_possible_truncation, reason = "the node accepts whole numbers up to 1000")]
    let value = value.0 as i64;
    unnamed(None, ParameterValue::Integer(value))
}

fn vector(value: [PlainF32; 3]) -> Parameter {
    let axes = value.map(|axis| ParameterValue::Float64(plain(axis)));
    unnamed(Some(ParameterType::Float64Array), ParameterValue::Array(axes.into()))
}

fn limit(value: Limit, absent: &str) -> Parameter {
    let absent = || unnamed(None, ParameterValue::String(absent.to_owned()));
    value.map_or_else(absent, number)
}

/// Returns the f64 with the same decimals as the f32: 0.1, not 0.10000000149.
fn plain(value: PlainF32) -> f64 {
    value.0.to_string().parse().unwrap_or(f64::from(value.0))
}

/// Creates the command that sets a parameter.
pub(super) fn command(parameter: &Parameter) -> Result<Command, Reason> {
    let (name, kind) = match parameter.name.split_once('.') {
        None => (parameter.name.as_str(), None),
        Some((name, kind)) => (name, Some(kind)),
    };
    let setting = SETTINGS.iter().find(|setting| setting.name == name);
    let setting = setting.ok_or(Reason::UnknownParameter)?;
    let constraint_kind = match kind.map(SettingKind::from_name) {
        None => None,
        Some(known @ SettingKind::Known(_)) if setting.per_kind => Some(known),
        Some(_) => return Err(Reason::UnknownParameter),
    };
    let value = match (&parameter.value, setting.value) {
        (Some(ParameterValue::String(word)), _) if word == OFF && setting.off => SettingValue::Off,
        (Some(ParameterValue::Array(axes)), ValueKind::Vector) => {
            let [x, y, z] = axes.as_slice() else { return Err(Reason::OutOfRange) };
            SettingValue::Vector([number_of(x)?, number_of(y)?, number_of(z)?])
        }
        (Some(value), ValueKind::Number | ValueKind::Whole) => {
            SettingValue::Number(number_of(value)?)
        }
        _ => return Err(Reason::OutOfRange),
    };
    Ok(Command::Set { parameter: name.to_owned(), value, constraint_kind })
}

#[allow(clippy::cast_possible_truncation, reason = "the value is rounded once, here")]
fn number_of(value: &ParameterValue) -> Result<f32, Reason> {
    match value {
        ParameterValue::Integer(number) => Ok(*number as f32),
        ParameterValue::Float64(number) => Ok(*number as f32),
        _ => Err(Reason::OutOfRange),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value_of(name: &str, parameters: &Parameters) -> ParameterValue {
        let all = list(parameters);
        all.into_iter().find(|one| one.name == name).unwrap().value.unwrap()
    }

    fn asked(name: &str, value: ParameterValue) -> Result<Command, Reason> {
        command(&Parameter { name: name.to_owned(), r#type: None, value: Some(value) })
    }

    #[test]
    fn every_parameter_is_listed_and_can_be_set_to_its_own_value() {
        let all = list(&Parameters::default());
        for setting in SETTINGS {
            let listed = all.iter().find(|one| one.name == setting.name);
            let listed = listed.unwrap_or_else(|| panic!("{} is not listed", setting.name));
            let is_own = listed.value == Some(ParameterValue::String(OWN.to_owned()));
            assert_eq!(command(listed).is_ok(), !is_own, "{}", setting.name);
        }
    }

    #[test]
    fn numbers_have_the_decimals_of_the_scene() {
        let mut parameters = Parameters::default();
        assert_eq!(value_of("tear_force", &parameters), ParameterValue::String(OFF.to_owned()));
        parameters.tear_force = Some(PlainF32(0.1));
        assert_eq!(value_of("tear_force", &parameters), ParameterValue::Float64(0.1));
        let gravity = [0.0, -9.81, 0.0].map(ParameterValue::Float64);
        assert_eq!(value_of("gravity", &parameters), ParameterValue::Array(gravity.into()));
        assert_eq!(value_of("substeps", &parameters), ParameterValue::Integer(4));
        parameters.compliance.bend = Some(PlainF32(0.5));
        assert_eq!(value_of("compliance.bend", &parameters), ParameterValue::Float64(0.5));
        assert_eq!(value_of("compliance", &parameters), ParameterValue::String(OWN.to_owned()));
    }

    #[test]
    fn a_value_becomes_a_command() {
        let set = |parameter: &str, value, constraint_kind| Command::Set {
            parameter: parameter.to_owned(),
            value,
            constraint_kind,
        };
        let axes = vec![
            ParameterValue::Integer(0),
            ParameterValue::Float64(-1.5),
            ParameterValue::Integer(0),
        ];
        let value = SettingValue::Vector([0.0, -1.5, 0.0]);
        assert_eq!(asked("gravity", ParameterValue::Array(axes)), Ok(set("gravity", value, None)));
        let off = ParameterValue::String(OFF.to_owned());
        assert_eq!(asked("tear_force", off), Ok(set("tear_force", SettingValue::Off, None)));
        let kind = Some(SettingKind::Known(ConstraintKind::Shear));
        let value = SettingValue::Number(0.5);
        let command = asked("stiffness.shear", ParameterValue::Float64(0.5));
        assert_eq!(command, Ok(set("stiffness", value, kind)));
    }

    #[test]
    fn a_wrong_name_or_value_is_refused() {
        let number = || ParameterValue::Float64(1.0);
        for name in ["", "dance", "damping.shear", "stiffness.silk", "stiffness."] {
            assert_eq!(asked(name, number()), Err(Reason::UnknownParameter), "{name}");
        }
        let word = |word: &str| ParameterValue::String(word.to_owned());
        for (name, value) in [
            ("gravity", number()),
            ("gravity", ParameterValue::Array(vec![number(), number()])),
            ("damping", word("much")),
            ("substeps", word(OFF)),
            ("stiffness", word(OWN)),
            ("damping", ParameterValue::Bool(true)),
        ] {
            assert_eq!(asked(name, value), Err(Reason::OutOfRange), "{name}");
        }
        let absent = Parameter { name: "damping".to_owned(), r#type: None, value: None };
        assert_eq!(command(&absent), Err(Reason::OutOfRange));
    }
}
