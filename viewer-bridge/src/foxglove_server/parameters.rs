//! Parameters in Foxglove's form: a name and a plain value.
//!
//! A parameter that is off has the value "off", because clients never see a parameter without a value.
//! A softness has one name for all constraints and one for each kind. `bending` has one name for all bends, and
//! `bending.1` is that of the bends of the generated block 1.

use foxglove::websocket::{
    Parameter as NamedValue, ParameterType, ParameterValue as FoxgloveValue,
};
use sim_contract::{
    Action, ConstraintKind, OffMeaning, PARAMETERS, Parameter, ParameterInfo, ParameterValue,
    ParameterValues, Part, Parts, Reason, ValueForm,
};

/// Value of a parameter that is off.
const OFF: &str = "off";
/// Value of a softness that was not set: each constraint has its own.
const OWN_OF_EACH: &str = "as in the scene";

/// Lists all parameters with their values, except those of colliders, which are in `/colliders`.
pub(super) fn list(values: &ParameterValues) -> Vec<NamedValue> {
    let of_scene = PARAMETERS.iter().filter(|info| info.parts == Parts::Kinds);
    let common = of_scene.map(|info| (info.parameter, Part::All, common_value(values, info)));
    let settings = values.settings().into_iter();
    let settings = settings.map(|one| (one.parameter, one.part, one.value));
    let mut all: Vec<_> = common.chain(settings).collect();
    all.sort_by_key(|(parameter, ..)| *parameter as u32);
    all.into_iter().map(|(parameter, part, value)| named(parameter, part, value)).collect()
}

/// The value that all kinds of constraints have.
fn common_value(values: &ParameterValues, info: &ParameterInfo) -> ParameterValue {
    let [first, others @ ..] =
        ConstraintKind::ALL.map(|kind| values.get(info.parameter, Part::Kind(kind)));
    if others.iter().all(|value| *value == first) { first } else { ParameterValue::Off }
}

/// Returns the blocks of `old` that have no bending of their own any more, with that of all bends.
pub(super) fn ended_blocks(old: &ParameterValues, new: &ParameterValues) -> Vec<NamedValue> {
    let is_listed = |block| new.bending_by_block.iter().any(|one| one.block == block);
    let blocks = old.bending_by_block.iter().map(|one| one.block);
    let ended = blocks.filter(|block| !is_listed(*block)).map(Part::Block);
    ended.map(|part| named(Parameter::Bending, part, new.get(Parameter::Bending, part))).collect()
}

fn named(parameter: Parameter, part: Part, value: ParameterValue) -> NamedValue {
    let info = parameter.info();
    let (r#type, value) = match value {
        ParameterValue::Off => {
            let word = if info.off == OffMeaning::OwnOfEach { OWN_OF_EACH } else { OFF };
            (None, FoxgloveValue::String(word.to_owned()))
        }
        ParameterValue::Vector(vector) => {
            let axes = vector.map(|axis| FoxgloveValue::Float64(same_decimals(axis)));
            (Some(ParameterType::Float64Array), FoxgloveValue::Array(axes.into()))
        }
        #[allow(clippy::cast_possible_truncation, reason = "counts are at most 1000")]
        ParameterValue::Number(number) if info.form == ValueForm::Whole => {
            (None, FoxgloveValue::Integer(number as i64))
        }
        ParameterValue::Number(number) => {
            (Some(ParameterType::Float64), FoxgloveValue::Float64(same_decimals(number)))
        }
    };
    NamedValue { name: parameter.path(part), r#type, value: Some(value) }
}

/// Returns the f64 with the same decimals as the f32: 0.1, not 0.10000000149.
fn same_decimals(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// Creates the action that sets a parameter.
pub(super) fn action(named: &NamedValue) -> Result<Action, Reason> {
    let (parameter, part) =
        Parameter::from_path(&named.name).map_err(|_| Reason::UnknownParameter)?;
    let info = parameter.info();
    let value = match (&named.value, info.form) {
        (Some(FoxgloveValue::String(word)), _)
            if word == OFF && info.accepts(ParameterValue::Off) =>
        {
            ParameterValue::Off
        }
        (Some(FoxgloveValue::Array(axes)), ValueForm::Vector) => {
            let [x, y, z] = axes.as_slice() else { return Err(Reason::OutOfRange) };
            ParameterValue::Vector([number(x)?, number(y)?, number(z)?])
        }
        (Some(value), ValueForm::Number | ValueForm::Whole) => {
            ParameterValue::Number(number(value)?)
        }
        _ => return Err(Reason::OutOfRange),
    };
    Ok(Action::set(parameter.name(), value).for_part(part))
}

#[allow(clippy::cast_possible_truncation, reason = "the value is rounded once, here")]
fn number(value: &FoxgloveValue) -> Result<f32, Reason> {
    match value {
        FoxgloveValue::Integer(number) => Ok(*number as f32),
        FoxgloveValue::Float64(number) => Ok(*number as f32),
        _ => Err(Reason::OutOfRange),
    }
}

#[cfg(test)]
mod tests {
    use sim_contract::Setting;

    use super::*;

    fn value_of(name: &str, values: &ParameterValues) -> FoxgloveValue {
        let all = list(values);
        all.into_iter().find(|one| one.name == name).unwrap().value.unwrap()
    }

    fn action_for(name: &str, value: FoxgloveValue) -> Result<Action, Reason> {
        action(&NamedValue { name: name.to_owned(), r#type: None, value: Some(value) })
    }

    #[test]
    fn every_parameter_is_listed_and_can_be_set_to_its_own_value() {
        let all = list(&ParameterValues::default());
        for info in PARAMETERS {
            let (name, is_per_collider) = (info.name, info.parts == Parts::Colliders);
            assert_eq!(all.iter().any(|one| one.name == name), !is_per_collider, "{name}");
            if is_per_collider {
                continue;
            }
            let listed = all.iter().find(|one| one.name == name);
            let listed = listed.unwrap_or_else(|| panic!("{name} is not listed"));
            let is_own = listed.value == Some(FoxgloveValue::String(OWN_OF_EACH.to_owned()));
            assert_eq!(action(listed).is_ok(), !is_own, "{name}");
        }
    }

    #[test]
    fn numbers_have_the_decimals_of_the_scene() {
        let values = ParameterValues::default();
        assert_eq!(value_of("tear_force", &values), FoxgloveValue::String(OFF.to_owned()));
        let mut values = values.with(Parameter::TearForce, 0.1);
        assert_eq!(value_of("tear_force", &values), FoxgloveValue::Float64(0.1));
        let gravity = [0.0, -9.81, 0.0].map(FoxgloveValue::Float64);
        assert_eq!(value_of("gravity", &values), FoxgloveValue::Array(gravity.into()));
        assert_eq!(value_of("substeps", &values), FoxgloveValue::Integer(4));
        for (parameter, part, value) in [
            (Parameter::Compliance, Part::Kind(ConstraintKind::Bend), 0.5),
            (Parameter::Bending, Part::Block(3), 0.25),
        ] {
            values.set(Setting { parameter, part, value: value.into() });
        }
        assert_eq!(value_of("compliance.bend", &values), FoxgloveValue::Float64(0.5));
        let own = FoxgloveValue::String(OWN_OF_EACH.to_owned());
        assert_eq!(value_of("compliance", &values), own);
        assert_eq!(value_of("bending", &values), own);
        assert_eq!(value_of("bending.3", &values), FoxgloveValue::Float64(0.25));
        let new = values.clone().with(Parameter::Bending, 0.5);
        let ended = ended_blocks(&values, &new);
        let [ended] = &ended[..] else { panic!("{ended:?}") };
        assert_eq!(
            (ended.name.as_str(), &ended.value),
            ("bending.3", &Some(FoxgloveValue::Float64(0.5)))
        );
        assert!(ended_blocks(&new, &new).is_empty());
    }

    #[test]
    fn a_value_becomes_an_action() {
        let axes = vec![
            FoxgloveValue::Integer(0),
            FoxgloveValue::Float64(-1.5),
            FoxgloveValue::Integer(0),
        ];
        let gravity = action_for("gravity", FoxgloveValue::Array(axes));
        assert_eq!(gravity, Ok(Action::set("gravity", [0.0, -1.5, 0.0])));
        let off = action_for("tear_force", FoxgloveValue::String(OFF.to_owned()));
        assert_eq!(off, Ok(Action::set("tear_force", ParameterValue::Off)));
        for (name, parameter, part) in [
            ("stiffness.shear", "stiffness", Part::Kind(ConstraintKind::Shear)),
            ("bending.12", "bending", Part::Block(12)),
            ("friction.12", "friction", Part::Collider(12)),
        ] {
            let action = action_for(name, FoxgloveValue::Float64(0.5));
            assert_eq!(action, Ok(Action::set(parameter, 0.5).for_part(part)));
        }
    }

    #[test]
    fn a_wrong_name_or_value_is_refused() {
        let number = || FoxgloveValue::Float64(1.0);
        for name in [
            "bending.shear",
            "friction.shear",
            "bending.-1",
            "",
            "dance",
            "damping.shear",
            "stiffness.silk",
            "stiffness.",
        ] {
            assert_eq!(action_for(name, number()), Err(Reason::UnknownParameter), "{name}");
        }
        let word = |word: &str| FoxgloveValue::String(word.to_owned());
        for (name, value) in [
            ("gravity", number()),
            ("gravity", FoxgloveValue::Array(vec![number(), number()])),
            ("damping", word("much")),
            ("substeps", word(OFF)),
            ("stiffness", word(OWN_OF_EACH)),
            ("damping", FoxgloveValue::Bool(true)),
        ] {
            assert_eq!(action_for(name, value), Err(Reason::OutOfRange), "{name}");
        }
        let absent = NamedValue { name: "damping".to_owned(), r#type: None, value: None };
        assert_eq!(action(&absent), Err(Reason::OutOfRange));
    }
}
