//! Parameters as Foxglove has them: a name and a plain value. What is switched off has the value
//! "off": one without a value would not be told to anybody. A softness has a name for each kind of
//! constraints, and one for all.

use foxglove::websocket::{Parameter, ParameterType, ParameterValue as FoxgloveValue};
use sim_contract::{ConstraintKind, KindFilter, ParameterValue, PlainF32};

use crate::message::Command;
use crate::message::parameters::{Limit, Parameters, PerKind};
use crate::message::settings::{SETTINGS, ValueKind};

/// The value of what is switched off.
const OFF: &str = "off";
/// The value of a softness that was not set: each constraint has its own.
const OWN: &str = "as in the scene";
const KINDS: [ConstraintKind; 4] = [
    ConstraintKind::Structural,
    ConstraintKind::Shear,
    ConstraintKind::Bend,
    ConstraintKind::Tether,
];

/// All parameters with their values.
pub(super) fn list(parameters: &Parameters) -> Vec<Parameter> {
    SETTINGS.iter().flat_map(|setting| named(setting.name, parameters)).collect()
}

/// The parameters of one setting.
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
    let of = [values.structural, values.shear, values.bend, values.tether];
    let common = if of.iter().all(|value| *value == of[0]) { of[0] } else { None };
    let mut parameters = vec![Parameter { name: name.to_owned(), ..limit(common, OWN) }];
    parameters.extend(KINDS.iter().zip(of).map(|(kind, value)| Parameter {
        name: format!("{name}.{}", kind.name()),
        ..limit(value, OWN)
    }));
    parameters
}

fn unnamed(r#type: Option<ParameterType>, value: FoxgloveValue) -> Parameter {
    Parameter { name: String::new(), r#type, value: Some(value) }
}

fn number(value: PlainF32) -> Parameter {
    unnamed(Some(ParameterType::Float64), FoxgloveValue::Float64(plain(value)))
}

fn whole(value: PlainF32) -> Parameter {
    #[allow(clippy::cast_possible_truncation, reason = "the node has only whole ones up to 1000")]
    let value = value.0 as i64;
    unnamed(None, FoxgloveValue::Integer(value))
}

fn vector(value: [PlainF32; 3]) -> Parameter {
    let axes = value.map(|axis| FoxgloveValue::Float64(plain(axis)));
    unnamed(Some(ParameterType::Float64Array), FoxgloveValue::Array(axes.into()))
}

fn limit(value: Limit, absent: &str) -> Parameter {
    let absent = || unnamed(None, FoxgloveValue::String(absent.to_owned()));
    value.map_or_else(absent, number)
}

/// The f64 that is written like the f32: 0.1, not 0.10000000149.
fn plain(value: PlainF32) -> f64 {
    value.0.to_string().parse().unwrap_or(f64::from(value.0))
}

/// The command that gives a parameter a value. `Err` is the word of a reason.
pub(super) fn command(parameter: &Parameter) -> Result<Command, &'static str> {
    let (name, kind) = match parameter.name.split_once('.') {
        None => (parameter.name.as_str(), None),
        Some((name, kind)) => (name, Some(kind)),
    };
    let setting = SETTINGS.iter().find(|setting| setting.name == name);
    let setting = setting.ok_or("unknown_parameter")?;
    let constraint_kind = match kind.map(KindFilter::from_name) {
        None => None,
        Some(known @ KindFilter::Known(_)) if setting.per_kind => Some(known),
        Some(_) => return Err("unknown_parameter"),
    };
    let value = match (&parameter.value, setting.value) {
        (Some(FoxgloveValue::String(word)), _) if word == OFF && setting.off => ParameterValue::Off,
        (Some(FoxgloveValue::Array(axes)), ValueKind::Vector) => {
            let [x, y, z] = axes.as_slice() else { return Err("out_of_range") };
            ParameterValue::Vector([single(x)?, single(y)?, single(z)?])
        }
        (Some(value), ValueKind::Number | ValueKind::Whole) => {
            ParameterValue::Number(single(value)?)
        }
        _ => return Err("out_of_range"),
    };
    Ok(Command::Set { parameter: name.to_owned(), value, constraint_kind })
}

#[allow(clippy::cast_possible_truncation, reason = "this is the one rounding to f32")]
fn single(value: &FoxgloveValue) -> Result<f32, &'static str> {
    match value {
        FoxgloveValue::Integer(number) => Ok(*number as f32),
        FoxgloveValue::Float64(number) => Ok(*number as f32),
        _ => Err("out_of_range"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value_of(name: &str, parameters: &Parameters) -> FoxgloveValue {
        let all = list(parameters);
        all.into_iter().find(|one| one.name == name).unwrap().value.unwrap()
    }

    fn asked(name: &str, value: FoxgloveValue) -> Result<Command, &'static str> {
        command(&Parameter { name: name.to_owned(), r#type: None, value: Some(value) })
    }

    #[test]
    fn every_setting_is_listed_and_can_be_set_to_what_it_is() {
        let all = list(&Parameters::default());
        for setting in SETTINGS {
            let listed = all.iter().find(|one| one.name == setting.name);
            let listed = listed.unwrap_or_else(|| panic!("{} is not listed", setting.name));
            let is_own = listed.value == Some(FoxgloveValue::String(OWN.to_owned()));
            assert_eq!(command(listed).is_ok(), !is_own, "{}", setting.name);
        }
    }

    #[test]
    fn numbers_are_those_of_the_scene_in_plain_decimals() {
        let mut parameters = Parameters::default();
        assert_eq!(value_of("tear_force", &parameters), FoxgloveValue::String(OFF.to_owned()));
        parameters.tear_force = Some(PlainF32(0.1));
        assert_eq!(value_of("tear_force", &parameters), FoxgloveValue::Float64(0.1));
        let gravity = [0.0, -9.81, 0.0].map(FoxgloveValue::Float64);
        assert_eq!(value_of("gravity", &parameters), FoxgloveValue::Array(gravity.into()));
        assert_eq!(value_of("substeps", &parameters), FoxgloveValue::Integer(4));
        parameters.compliance.bend = Some(PlainF32(0.5));
        assert_eq!(value_of("compliance.bend", &parameters), FoxgloveValue::Float64(0.5));
        assert_eq!(value_of("compliance", &parameters), FoxgloveValue::String(OWN.to_owned()));
    }

    #[test]
    fn a_value_becomes_a_command() {
        let set = |parameter: &str, value, constraint_kind| Command::Set {
            parameter: parameter.to_owned(),
            value,
            constraint_kind,
        };
        let axes = vec![
            FoxgloveValue::Integer(0),
            FoxgloveValue::Float64(-1.5),
            FoxgloveValue::Integer(0),
        ];
        let value = ParameterValue::Vector([0.0, -1.5, 0.0]);
        assert_eq!(asked("gravity", FoxgloveValue::Array(axes)), Ok(set("gravity", value, None)));
        let off = FoxgloveValue::String(OFF.to_owned());
        assert_eq!(asked("tear_force", off), Ok(set("tear_force", ParameterValue::Off, None)));
        let kind = Some(KindFilter::Known(ConstraintKind::Shear));
        let value = ParameterValue::Number(0.5);
        let command = asked("stiffness.shear", FoxgloveValue::Float64(0.5));
        assert_eq!(command, Ok(set("stiffness", value, kind)));
    }

    #[test]
    fn a_wrong_name_or_value_is_refused() {
        let number = || FoxgloveValue::Float64(1.0);
        for name in ["", "dance", "damping.shear", "stiffness.silk", "stiffness."] {
            assert_eq!(asked(name, number()), Err("unknown_parameter"), "{name}");
        }
        let word = |word: &str| FoxgloveValue::String(word.to_owned());
        for (name, value) in [
            ("gravity", number()),
            ("gravity", FoxgloveValue::Array(vec![number(), number()])),
            ("damping", word("much")),
            ("substeps", word(OFF)),
            ("stiffness", word(OWN)),
            ("damping", FoxgloveValue::Bool(true)),
        ] {
            assert_eq!(asked(name, value), Err("out_of_range"), "{name}");
        }
        let absent = Parameter { name: "damping".to_owned(), r#type: None, value: None };
        assert_eq!(command(&absent), Err("out_of_range"));
    }
}
