//! The row of `/parameters`.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use serde_json::Map;
use sim_contract::{
    ConstraintKind, OffMeaning, PARAMETERS, ParameterInfo, ParameterValues, Parts, ValueForm,
};

/// The values of all parameters, at the start and after each change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParametersRow {
    /// The first step with these values. They apply until the next row.
    pub step: u64,
    /// The values, named as in commands. `null` means off.
    #[serde(flatten)]
    #[schemars(with = "ValuesSchema")]
    pub values: ParameterValues,
}

/// The schema of the values, from the table of parameters.
struct ValuesSchema;

impl JsonSchema for ValuesSchema {
    fn schema_name() -> Cow<'static, str> {
        "ParameterValues".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let number = generator.subschema_for::<f32>();
        let optional = generator.subschema_for::<Option<f32>>();
        let kinds = ConstraintKind::ALL.map(|kind| (kind.name().to_owned(), optional.clone()));
        let kinds = object(kinds.into());
        let of_parameter = |info: &ParameterInfo| {
            let schema = match (info.parts, info.form, info.off) {
                (Parts::Colliders, ..) => return None,
                (Parts::Kinds, ..) => kinds.clone(),
                (_, ValueForm::Vector, _) => generator.subschema_for::<[f32; 3]>(),
                (_, ValueForm::Whole, _) => generator.subschema_for::<u32>(),
                (_, _, OffMeaning::NotAllowed | OffMeaning::Zero) => number.clone(),
                _ => optional.clone(),
            };
            Some((info.name.to_owned(), schema))
        };
        let mut properties: Vec<_> = PARAMETERS.iter().filter_map(of_parameter).collect();
        let blocks = generator.subschema_for::<Vec<BlockValueSchema>>();
        properties.push(("bending_by_block".to_owned(), blocks));
        object(properties)
    }
}

/// An object with all these properties.
fn object(properties: Vec<(String, Schema)>) -> Schema {
    let names: Vec<_> = properties.iter().map(|(name, _)| name.clone()).collect();
    let properties: Map<_, _> =
        properties.into_iter().map(|(name, schema)| (name, schema.to_value())).collect();
    json_schema!({ "type": "object", "properties": properties, "required": names })
}

/// The schema of a value for one generated block.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct BlockValueSchema {
    block: u32,
    value: f32,
}

#[cfg(test)]
mod tests {
    use sim_contract::{BlockValue, Parameter};

    use super::*;

    #[test]
    fn parameters_survive_a_round_trip_through_json_bit_for_bit() {
        let mut values = ParameterValues::default()
            .with(Parameter::Gravity, [0.1, -9.81, 1e-40])
            .with(Parameter::TearForce, 0.3)
            .with(Parameter::MaxSpeed, f32::INFINITY);
        values.bending_by_block.push(BlockValue { block: 3, value: 0.1 });
        let row = ParametersRow { step: 12, values };
        let text = serde_json::to_string(&row).unwrap();
        assert!(
            text.starts_with(r#"{"step":12,"gravity":[0.1,-9.81,1e-40],"damping":0.0"#),
            "{text}"
        );
        assert!(
            text.contains(r#""tear_distance":null,"tear_force":0.3,"max_speed":"inf""#),
            "{text}"
        );
        assert!(
            text.ends_with(r#""bending":null,"bending_by_block":[{"block":3,"value":0.1}]}"#),
            "{text}"
        );
        assert_eq!(serde_json::from_str::<ParametersRow>(&text).unwrap(), row);
    }
}
