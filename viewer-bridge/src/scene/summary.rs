//! The part of a scene's TOML that a viewer needs.
//!
//! The node has checked the text. A missing or malformed field means its default here, never an error:
//! it is a label or a value to show.

use serde::Deserialize;
use sim_contract::PlainF32;

use crate::message::parameters::{Limit, Parameters};

/// The part of a scene that a viewer needs.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSummary {
    /// Name.
    pub name: String,
    /// Unit of lengths.
    pub unit: String,
    /// Direction of up: "y", "-y" or "z".
    pub up: String,
    /// The scene has two dimensions.
    pub is_planar: bool,
    /// Steps per second.
    pub rate_hz: u32,
    /// Values of the parameters.
    pub parameters: Parameters,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Text {
    name: String,
    unit: Option<String>,
    up: Option<String>,
    dimensions: Option<u32>,
    gravity: Option<[f32; 3]>,
    solver: Solver,
    wind: Option<Wind>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Solver {
    rate_hz: Option<u32>,
    substeps: Option<u32>,
    iterations: Option<u32>,
    damping: Option<f32>,
    relaxation: Option<f32>,
    max_speed: Option<f32>,
    max_stretch: Option<f32>,
    tear_stretch: Option<f32>,
    tear_distance: Option<f32>,
    tear_force: Option<f32>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Wind {
    velocity: Option<[f32; 3]>,
    drag: Option<f32>,
}

/// Steps per second of a scene that does not set them.
const RATE_HZ_DEFAULT: u32 = 240;

impl SceneSummary {
    /// Parses a scene. A text that is not TOML is a scene without a name.
    pub fn parse(text: &str) -> Self {
        let text: Text = toml::from_str(text).unwrap_or_default();
        Self {
            parameters: parameters(&text),
            is_planar: text.dimensions == Some(2),
            rate_hz: text.solver.rate_hz.unwrap_or(RATE_HZ_DEFAULT),
            name: text.name,
            unit: text.unit.unwrap_or_else(|| "m".to_owned()),
            up: text.up.unwrap_or_else(|| "y".to_owned()),
        }
    }
}

fn parameters(text: &Text) -> Parameters {
    let (solver, defaults) = (&text.solver, Parameters::default());
    let number = |value: Option<f32>, default| value.map_or(default, PlainF32);
    let whole = |value: Option<u32>, default| value.map_or(default, |one| PlainF32(one as f32));
    let limit = |value: Option<f32>| -> Limit { value.map(PlainF32) };
    let wind = text.wind.as_ref();
    Parameters {
        gravity: text.gravity.map_or(defaults.gravity, |gravity| gravity.map(PlainF32)),
        damping: number(solver.damping, defaults.damping),
        wind_velocity: wind
            .and_then(|wind| wind.velocity)
            .map_or(defaults.wind_velocity, |velocity| velocity.map(PlainF32)),
        wind_drag: number(wind.and_then(|wind| wind.drag), defaults.wind_drag),
        substeps: whole(solver.substeps, defaults.substeps),
        iterations: whole(solver.iterations, defaults.iterations),
        relaxation: number(solver.relaxation, defaults.relaxation),
        max_speed: number(solver.max_speed, defaults.max_speed),
        max_stretch: limit(solver.max_stretch),
        tear_stretch: limit(solver.tear_stretch),
        tear_distance: limit(solver.tear_distance),
        tear_force: limit(solver.tear_force),
        ..defaults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_is_not_toml_is_a_scene_without_a_name() {
        let summary = SceneSummary::parse("][");
        assert_eq!((summary.name.as_str(), summary.parameters), ("", Parameters::default()));
    }

    #[test]
    fn parameters_are_read_from_the_text() {
        let text = "
            name = 'a'
            dimensions = 2
            gravity = [0, -1.5, 0]
            [solver]
            substeps = 7
            tear_force = 20
            [wind]
            velocity = [1, 0, 0]";
        let summary = SceneSummary::parse(text);
        assert!(summary.is_planar);
        assert_eq!(summary.parameters.gravity[1], PlainF32(-1.5));
        assert_eq!(summary.parameters.substeps, PlainF32(7.0));
        assert_eq!(summary.parameters.tear_force, Some(PlainF32(20.0)));
        assert_eq!(summary.parameters.wind_velocity[0], PlainF32(1.0));
    }
}
