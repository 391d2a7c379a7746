//! Parameters in Foxglove's form: a name and a plain value.
//!
//! A parameter that is off has the value "off", because clients never see a parameter without a value.
//! A softness has one name for all constraints and one for each kind. `bending` has one name for all bends, and
//! `bending.1` is that of the bends of the generated block 1.

use foxglove::websocket::{
    Parameter as NamedValue, ParameterType, ParameterValue as FoxgloveValue,
};
use sim_contract::{
    ConstraintKind, KindFilter, OffMeaning, Parameter, ParameterInfo, ParameterValue,
    ParameterValues, Reason, ValueForm,
};

use crate::message::Command;

/// Value of a parameter that is off.
const OFF: &str = "off";
/// Value of a softness that was not set: each constraint has its own.
const OWN_OF_EACH: &str = "as in the scene";

/// Lists all parameters with their values, except those of colliders, which are in `/colliders`.
pub(super) fn list(values: &ParameterValues) -> Vec<NamedValue> {
    let of_scene = Parameter::ALL.into_iter().filter(|one| !one.info().is_per_collider);
    of_scene.flat_map(|parameter| named_values(parameter, values)).collect()
}

/// Lists the values of one parameter: one, or one for all kinds of constraints and one for each; of `bending`,
/// one for all bends, and one for each block with a value of its own.
fn named_values(parameter: Parameter, values: &ParameterValues) -> Vec<NamedValue> {
    let info = parameter.info();
    if !info.is_per_kind {
        let mut list = vec![named(info.name, info, values.get(parameter, None))];
        if parameter == Parameter::Bending {
            list.extend(
                values.bending_by_block.iter().map(|one| {
                    named(&block_name(one.block), info, ParameterValue::Number(one.value))
                }),
            );
        }
        return list;
    }
    let each = ConstraintKind::ALL.map(|kind| values.get(parameter, Some(kind)));
    let is_same = each.iter().all(|value| *value == each[0]);
    let common = if is_same { each[0] } else { ParameterValue::Off };
    let mut list = vec![named(info.name, info, common)];
    list.extend(
        ConstraintKind::ALL
            .iter()
            .zip(each)
            .map(|(kind, value)| named(&format!("{}.{}", info.name, kind.name()), info, value)),
    );
    list
}

/// Returns the blocks of `old` that have no bending of their own any more, with that of all bends.
pub(super) fn ended_blocks(old: &[NamedValue], new: &ParameterValues) -> Vec<NamedValue> {
    let info = Parameter::Bending.info();
    let is_listed =
        |name: &str| new.bending_by_block.iter().any(|one| block_name(one.block) == name);
    let ended = old.iter().map(|one| one.name.as_str());
    let ended = ended.filter(|name| is_block_name(name) && !is_listed(name));
    ended.map(|name| named(name, info, new.get(Parameter::Bending, None))).collect()
}

fn block_name(block: u32) -> String {
    format!("{}.{block}", Parameter::Bending.name())
}

fn is_block_name(name: &str) -> bool {
    name.split_once('.').is_some_and(|(name, _)| name == Parameter::Bending.name())
}

fn named(name: &str, info: &ParameterInfo, value: ParameterValue) -> NamedValue {
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
    NamedValue { name: name.to_owned(), r#type, value: Some(value) }
}

/// Returns the f64 with the same decimals as the f32: 0.1, not 0.10000000149.
fn same_decimals(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// Creates the command that sets a parameter.
pub(super) fn command(named: &NamedValue) -> Result<Command, Reason> {
    let (name, part) = match named.name.split_once('.') {
        None => (named.name.as_str(), None),
        Some((name, part)) => (name, Some(part)),
    };
    let info = Parameter::from_name(name).ok_or(Reason::UnknownParameter)?.info();
    let index = |part: &str| part.parse().map(Some).map_err(|_| Reason::UnknownParameter);
    let (mut constraint_kind, mut block, mut collider) = (None, None, None);
    match part.map(|part| (part, KindFilter::from_name(part))) {
        None => {}
        Some((part, _)) if info.parameter == Parameter::Bending => block = index(part)?,
        Some((part, _)) if info.is_per_collider => collider = index(part)?,
        Some((_, known @ KindFilter::Known(_))) if info.is_per_kind => {
            constraint_kind = Some(known);
        }
        Some(_) => return Err(Reason::UnknownParameter),
    }
    let can_be_off =
        matches!(info.off, OffMeaning::Zero | OffMeaning::NoLimit | OffMeaning::Absent);
    let value = match (&named.value, info.form) {
        (Some(FoxgloveValue::String(word)), _) if word == OFF && can_be_off => ParameterValue::Off,
        (Some(FoxgloveValue::Array(axes)), ValueForm::Vector) => {
            let [x, y, z] = axes.as_slice() else { return Err(Reason::OutOfRange) };
            ParameterValue::Vector([number(x)?, number(y)?, number(z)?])
        }
        (Some(value), ValueForm::Number | ValueForm::Whole) => {
            ParameterValue::Number(number(value)?)
        }
        _ => return Err(Reason::OutOfRange),
    };
    Ok(Command::Set {
        parameter: name.to_owned(),
        value,
        constraint_kind,
        block,
        collider,
        stroke: None,
    })
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
    use sim_contract::BlockValue;

    use super::*;

    fn value_of(name: &str, values: &ParameterValues) -> FoxgloveValue {
        let all = list(values);
        all.into_iter().find(|one| one.name == name).unwrap().value.unwrap()
    }

    fn command_for(name: &str, value: FoxgloveValue) -> Result<Command, Reason> {
        command(&NamedValue { name: name.to_owned(), r#type: None, value: Some(value) })
    }

    #[test]
    fn every_parameter_is_listed_and_can_be_set_to_its_own_value() {
        let all = list(&ParameterValues::default());
        for parameter in Parameter::ALL {
            let name = parameter.name();
            let is_per_collider = parameter.info().is_per_collider;
            assert_eq!(all.iter().any(|one| one.name == name), !is_per_collider, "{name}");
            if is_per_collider {
                continue;
            }
            let listed = all.iter().find(|one| one.name == name);
            let listed = listed.unwrap_or_else(|| panic!("{name} is not listed"));
            let is_own = listed.value == Some(FoxgloveValue::String(OWN_OF_EACH.to_owned()));
            assert_eq!(command(listed).is_ok(), !is_own, "{name}");
        }
    }

    #[test]
    fn numbers_have_the_decimals_of_the_scene() {
        let mut values = ParameterValues::default();
        assert_eq!(value_of("tear_force", &values), FoxgloveValue::String(OFF.to_owned()));
        values.tear_force = Some(0.1);
        assert_eq!(value_of("tear_force", &values), FoxgloveValue::Float64(0.1));
        let gravity = [0.0, -9.81, 0.0].map(FoxgloveValue::Float64);
        assert_eq!(value_of("gravity", &values), FoxgloveValue::Array(gravity.into()));
        assert_eq!(value_of("substeps", &values), FoxgloveValue::Integer(4));
        values.compliance.bend = Some(0.5);
        assert_eq!(value_of("compliance.bend", &values), FoxgloveValue::Float64(0.5));
        let own = FoxgloveValue::String(OWN_OF_EACH.to_owned());
        assert_eq!(value_of("compliance", &values), own);
        values.bending_by_block.push(BlockValue { block: 3, value: 0.25 });
        assert_eq!(value_of("bending", &values), own);
        assert_eq!(value_of("bending.3", &values), FoxgloveValue::Float64(0.25));
        let old = list(&values);
        values.bending_by_block.clear();
        values.bending = Some(0.5);
        let ended = ended_blocks(&old, &values);
        let [ended] = &ended[..] else { panic!("{ended:?}") };
        assert_eq!(
            (ended.name.as_str(), &ended.value),
            ("bending.3", &Some(FoxgloveValue::Float64(0.5)))
        );
        assert!(ended_blocks(&old[..old.len() - 1], &values).is_empty());
    }

    #[test]
    fn a_value_becomes_a_command() {
        let set = |parameter: &str, value, constraint_kind| Command::Set {
            parameter: parameter.to_owned(),
            value,
            constraint_kind,
            block: None,
            collider: None,
            stroke: None,
        };
        let axes = vec![
            FoxgloveValue::Integer(0),
            FoxgloveValue::Float64(-1.5),
            FoxgloveValue::Integer(0),
        ];
        let value = ParameterValue::Vector([0.0, -1.5, 0.0]);
        let command = command_for("gravity", FoxgloveValue::Array(axes));
        assert_eq!(command, Ok(set("gravity", value, None)));
        let off = FoxgloveValue::String(OFF.to_owned());
        let command = command_for("tear_force", off);
        assert_eq!(command, Ok(set("tear_force", ParameterValue::Off, None)));
        let kind = Some(KindFilter::Known(ConstraintKind::Shear));
        let value = ParameterValue::Number(0.5);
        let command = command_for("stiffness.shear", FoxgloveValue::Float64(0.5));
        assert_eq!(command, Ok(set("stiffness", value, kind)));
        let command = command_for("bending.12", FoxgloveValue::Float64(0.5));
        let of_part = |parameter: &str, block, collider| Command::Set {
            parameter: parameter.to_owned(),
            value,
            constraint_kind: None,
            block,
            collider,
            stroke: None,
        };
        assert_eq!(command, Ok(of_part("bending", Some(12), None)));
        let command = command_for("friction.12", FoxgloveValue::Float64(0.5));
        assert_eq!(command, Ok(of_part("friction", None, Some(12))));
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
            assert_eq!(command_for(name, number()), Err(Reason::UnknownParameter), "{name}");
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
            assert_eq!(command_for(name, value), Err(Reason::OutOfRange), "{name}");
        }
        let absent = NamedValue { name: "damping".to_owned(), r#type: None, value: None };
        assert_eq!(command(&absent), Err(Reason::OutOfRange));
    }
}
