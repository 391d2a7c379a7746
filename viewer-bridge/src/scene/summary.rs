//! What a viewer needs of a scene's TOML.
//!
//! The node has checked the text and written out every default; what is missing or strange here
//! means the default, and never an error: it is a label or a value to show.

use serde::Deserialize;
use serde::de::IgnoredAny;
use sim_contract::PlainF32;

use crate::message::parameters::{Limit, Parameters};
use crate::wire::Grid;

/// A scene as a viewer sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSummary {
    /// Its name.
    pub name: String,
    /// Unit of lengths.
    pub unit: String,
    /// "y", "-y" or "z".
    pub up: String,
    /// Whether it lies in the plane.
    pub is_planar: bool,
    /// Steps per second.
    pub rate_hz: u32,
    /// Whether it has generated tethers.
    pub has_tethers: bool,
    /// Whether constraints tear by themselves.
    pub is_tearable: bool,
    /// Its parameters.
    pub parameters: Parameters,
    /// The particles of its sheets.
    pub grids: Vec<Grid>,
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
    particle: Vec<IgnoredAny>,
    constraint: Vec<Limits>,
    generate: Vec<Generator>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Solver {
    rate_hz: Option<u32>,
    substeps: Option<u32>,
    iterations: Option<u32>,
    damping: Option<f32>,
    relaxation: Option<f32>,
    tethers: bool,
    max_speed: Option<f32>,
    max_stretch: Option<f32>,
    #[serde(flatten)]
    limits: Limits,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
#[allow(clippy::struct_field_names, reason = "named as in the text")]
struct Limits {
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

#[derive(Debug, Default, Deserialize)]
#[serde(default)]
struct Generator {
    shape: String,
    columns: Option<u32>,
    rows: Option<u32>,
    count: Option<u32>,
    tear_stretch: Option<f32>,
}

impl Limits {
    fn is_any(&self) -> bool {
        let all = [self.tear_stretch, self.tear_distance, self.tear_force];
        all.into_iter().flatten().any(f32::is_finite)
    }
}

/// Steps per second of a scene that does not say.
const RATE_HZ_DEFAULT: u32 = 240;

impl SceneSummary {
    /// Reads a scene; what is no TOML is a scene without a name.
    pub fn read(text: &str) -> Self {
        let text: Text = toml::from_str(text).unwrap_or_default();
        let is_tearable = text.solver.limits.is_any()
            || text.constraint.iter().any(Limits::is_any)
            || text.generate.iter().any(|one| one.tear_stretch.is_some());
        Self {
            parameters: parameters(&text),
            grids: grids(&text),
            is_planar: text.dimensions == Some(2),
            rate_hz: text.solver.rate_hz.unwrap_or(RATE_HZ_DEFAULT),
            has_tethers: text.solver.tethers,
            is_tearable,
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
        tear_stretch: limit(solver.limits.tear_stretch),
        tear_distance: limit(solver.limits.tear_distance),
        tear_force: limit(solver.limits.tear_force),
        ..defaults
    }
}

/// The sheets up to the first block whose size does not stand in the text.
fn grids(text: &Text) -> Vec<Grid> {
    let mut grids = Vec::new();
    let mut first = u32::try_from(text.particle.len()).unwrap_or(u32::MAX);
    for block in &text.generate {
        let count = match (block.shape.as_str(), block.columns, block.rows, block.count) {
            ("cloth" | "mesh", Some(columns), Some(rows), _) => {
                grids.push(Grid { first, columns, rows });
                columns.checked_mul(rows)
            }
            ("rope", _, _, count) => count,
            _ => None,
        };
        let Some(next) = count.and_then(|count| first.checked_add(count)) else { break };
        first = next;
    }
    grids
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_are_counted_behind_explicit_particles_and_ropes() {
        let text = "
            particle = [{ position = [0, 0, 0] }, { position = [1, 0, 0] }]
            generate = [
              { shape = 'rope', count = 5 },
              { shape = 'cloth', columns = 3, rows = 2 },
              { shape = 'web', spokes = 4 },
              { shape = 'cloth', columns = 9, rows = 9 },
            ]";
        assert_eq!(SceneSummary::read(text).grids, [Grid { first: 7, columns: 3, rows: 2 }]);
    }

    #[test]
    fn a_text_that_is_no_scene_is_one_without_a_name() {
        let summary = SceneSummary::read("][");
        assert_eq!((summary.name.as_str(), summary.parameters), ("", Parameters::default()));
    }

    #[test]
    fn parameters_are_those_of_the_text() {
        let text = "
            name = 'a'
            dimensions = 2
            gravity = [0, -1.5, 0]
            [solver]
            substeps = 7
            tear_force = 20
            tethers = true
            [wind]
            velocity = [1, 0, 0]";
        let summary = SceneSummary::read(text);
        assert!(summary.is_planar && summary.is_tearable && summary.has_tethers);
        assert_eq!(summary.parameters.gravity[1], PlainF32(-1.5));
        assert_eq!(summary.parameters.substeps, PlainF32(7.0));
        assert_eq!(summary.parameters.tear_force, Some(PlainF32(20.0)));
        assert_eq!(summary.parameters.wind_velocity[0], PlainF32(1.0));
    }
}
