//! The row of `/parameters`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::ParameterValues;

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

/// The schema of the values, because [`ParameterValues`] does not depend on schemars.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct ValuesSchema {
    gravity: [f32; 3],
    damping: f32,
    wind_velocity: [f32; 3],
    wind_drag: f32,
    substeps: u32,
    iterations: u32,
    relaxation: f32,
    max_stretch: Option<f32>,
    tear_stretch: Option<f32>,
    tear_distance: Option<f32>,
    tear_force: Option<f32>,
    max_speed: f32,
    time_scale: f32,
    compliance: PerKindSchema,
    stiffness: PerKindSchema,
    contact: Option<f32>,
    contact_friction: f32,
    bending: Option<f32>,
    bending_by_block: Vec<BlockValueSchema>,
}

/// The schema of a value for one generated block.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct BlockValueSchema {
    block: u32,
    value: f32,
}

/// The schema of a value for each kind of constraint. `null` means that each constraint has its own.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct PerKindSchema {
    structural: Option<f32>,
    shear: Option<f32>,
    bend: Option<f32>,
    tether: Option<f32>,
}

#[cfg(test)]
mod tests {
    use sim_contract::BlockValue;

    use super::*;

    #[test]
    fn parameters_survive_a_round_trip_through_json_bit_for_bit() {
        let values = ParameterValues {
            gravity: [0.1, -9.81, 1e-40],
            tear_force: Some(0.3),
            max_speed: f32::INFINITY,
            bending_by_block: vec![BlockValue { block: 3, value: 0.1 }],
            ..ParameterValues::default()
        };
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
