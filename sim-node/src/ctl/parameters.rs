//! `ctl get`: the parameters of the simulation.

use anyhow::bail;
use serde_json::{Map, Value};
use sim_contract::{
    Client, NodeStatus, OffMeaning, Parameter, ParameterValue, Part, Parts, Setting,
};

use crate::args::CtlArgs;
use crate::output;
use crate::output::{Align, Table};

/// Key of the bending of blocks in JSON.
const BY_BLOCK: &str = "bending_by_block";
const BENDING: &str = "bending";

/// Prints one parameter, or all of them.
pub(super) fn print(
    client: &mut Client,
    args: &CtlArgs,
    parameter: Option<Parameter>,
) -> anyhow::Result<()> {
    let Some(parameters) = client.parameters(args.timeout())? else {
        bail!("the node published no parameters within {:?}; is it stopped?", args.timeout());
    };
    let mut values = parameters.values;
    // A replay publishes the parameters of the recorded run, but goes at its own rate.
    if let Some(status) = client.status(args.timeout())?.filter(NodeStatus::is_replay) {
        values = values.with(Parameter::TimeScale, to_f32(status.time_scale));
    }
    let is_asked = |name: &str| parameter.is_none_or(|parameter| parameter.name() == name);
    // Those of colliders are published with them.
    let of_colliders_step = match parameter.map(|parameter| parameter.info().parts) {
        Some(Parts::None | Parts::Kinds | Parts::Blocks) => 0,
        Some(Parts::Colliders) | None => client.colliders(args.timeout())?.header.step,
    };
    let step = parameters.header.step.max(of_colliders_step);
    if args.json {
        let mut object = Map::from_iter([("step".to_owned(), step.into())]);
        if let Value::Object(values) = serde_json::to_value(values)? {
            // Blocks have their values in a list of their own.
            let is_value = |name: &str| is_asked(name) || name == BY_BLOCK && is_asked(BENDING);
            object.extend(values.into_iter().filter(|(name, _)| is_value(name)));
        }
        for (name, values) in of_colliders(client, args, parameter)? {
            object.insert(name.to_owned(), values.into());
        }
        return output::json(&Value::Object(object));
    }
    let mut table = Table::new([
        ("parameter", Align::Left),
        ("constraints", Align::Left),
        ("value", Align::Left),
        ("unit", Align::Left),
    ]);
    let settings = values.settings();
    for setting in settings.iter().filter(|setting| is_asked(setting.parameter.name())) {
        table.add(cells(setting));
    }
    for (name, values) in of_colliders(client, args, parameter)? {
        for (collider, value) in values.iter().enumerate() {
            let part = format!("collider {collider}");
            table.add([name.to_owned(), part, value.to_string(), String::new()]);
        }
    }
    output::text(&format!("since step {step}\n{}", table.text()))
}

/// The parameters of colliders, each with its values by collider.
fn of_colliders(
    client: &mut Client,
    args: &CtlArgs,
    asked: Option<Parameter>,
) -> anyhow::Result<Vec<(&'static str, Vec<f32>)>> {
    let is_asked = |one: Parameter| asked.is_none_or(|asked| asked == one);
    if asked.is_some_and(|asked| asked.info().parts != Parts::Colliders) {
        return Ok(Vec::new());
    }
    let colliders = client.colliders(args.timeout())?.colliders;
    let (friction, restitution) =
        colliders.iter().map(|one| (one.friction, one.restitution)).unzip();
    let all = [(Parameter::Friction, friction), (Parameter::Restitution, restitution)];
    let all = all.into_iter().filter(|(parameter, _)| is_asked(*parameter));
    Ok(all.map(|(parameter, values)| (parameter.name(), values)).collect())
}

#[allow(clippy::cast_possible_truncation, reason = "parameters are f32")]
fn to_f32(value: f64) -> f32 {
    value as f32
}

/// Name, kind of constraints or block, value and unit.
fn cells(setting: &Setting) -> [String; 4] {
    let info = setting.parameter.info();
    let (value, unit) = match (setting.value, info.off) {
        (ParameterValue::Off, OffMeaning::OwnOfEach) => ("as loaded".to_owned(), ""),
        (ParameterValue::Off, _) => (setting.value.to_string(), ""),
        (value, _) => (value.to_string(), info.unit),
    };
    let part = match setting.part {
        Part::All => String::new(),
        part => part.to_string(),
    };
    [info.name.to_owned(), part, value, unit.to_owned()]
}

#[cfg(test)]
mod tests {
    use sim_contract::ConstraintKind;

    use super::*;

    #[test]
    fn values_are_shown_as_ctl_set_accepts_them() {
        let cells = |parameter, part, value| cells(&Setting { parameter, part, value }).join("|");
        let gravity = ParameterValue::Vector([0.0, -9.81, 0.0]);
        assert_eq!(cells(Parameter::Gravity, Part::All, gravity), "gravity||0 -9.81 0|m/s²");
        assert_eq!(cells(Parameter::TearForce, Part::All, ParameterValue::Off), "tear_force||off|");
        let shear = Part::Kind(ConstraintKind::Shear);
        let number = ParameterValue::Number(1e-4);
        assert_eq!(cells(Parameter::Compliance, shear, number), "compliance|shear|0.0001|m/N");
        let off = ParameterValue::Off;
        assert_eq!(cells(Parameter::Compliance, shear, off), "compliance|shear|as loaded|");
        let of_block = cells(Parameter::Bending, Part::Block(1), number);
        assert_eq!(of_block, "bending|block 1|0.0001|N m");
    }
}
