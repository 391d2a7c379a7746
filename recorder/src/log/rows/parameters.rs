//! The row of `/parameters`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_contract::ParameterValues;

use super::json::JsonNumber;

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
    gravity: [JsonNumber; 3],
    damping: JsonNumber,
    wind_velocity: [JsonNumber; 3],
    wind_drag: JsonNumber,
    substeps: u32,
    iterations: u32,
    relaxation: JsonNumber,
    max_stretch: Option<JsonNumber>,
    tear_stretch: Option<JsonNumber>,
    tear_distance: Option<JsonNumber>,
    tear_force: Option<JsonNumber>,
    max_speed: JsonNumber,
    time_scale: JsonNumber,
    compliance: PerKindSchema,
    stiffness: PerKindSchema,
}

/// The schema of a value for each kind of constraint. `null` means that each constraint has its own.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct PerKindSchema {
    structural: Option<JsonNumber>,
    shear: Option<JsonNumber>,
    bend: Option<JsonNumber>,
    tether: Option<JsonNumber>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_survive_a_round_trip_through_json_bit_for_bit() {
        let values = ParameterValues {
            gravity: [0.1, -9.81, 1e-40],
            tear_force: Some(0.3),
            max_speed: f32::INFINITY,
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
        assert_eq!(serde_json::from_str::<ParametersRow>(&text).unwrap(), row);
    }
}
