//! The part of a scene that a viewer needs.

use std::ops::Range;

use serde::Serialize;
use sim_contract::ParameterValues;
use sim_solver::Scene;
use sim_solver::scene::{ColliderMeshes, SceneCollider, ScenePoses, Shape, Up};

use crate::limits::SHAPES_MAX;
use crate::wire::ShapeText;

/// Friction and restitution of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ColliderSurface {
    /// Coulomb's coefficient.
    pub friction: f32,
    /// Fraction of the approach speed with which a particle bounces.
    pub restitution: f32,
}

/// The part of a scene that a viewer needs.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneSummary {
    /// Name.
    pub name: String,
    /// Unit of lengths.
    pub unit: String,
    /// Direction of up.
    pub up: Up,
    /// The scene has two dimensions.
    pub is_planar: bool,
    /// Steps per second.
    pub rate_hz: u32,
    /// Values of the parameters.
    pub parameters: ParameterValues,
    /// Friction and restitution of each collider.
    pub surfaces: Vec<ColliderSurface>,
    /// Triangles of the colliders that are meshes.
    pub collider_meshes: ColliderMeshes,
    /// The generated shapes, at most [`SHAPES_MAX`]. The load says which of them have bends.
    pub shapes: Vec<ShapeText>,
    /// The colliders and anchors at load.
    pub poses: ScenePoses,
}

impl SceneSummary {
    /// Reads a scene's TOML text. Returns `None` for the text of another version, or one that is not a
    /// scene: a viewer shows its particles without labels.
    pub fn from_toml(text: &str) -> Option<Self> {
        let scene = Scene::from_toml(text, "").ok()?;
        Some(Self {
            parameters: scene.parameter_values(),
            surfaces: scene.colliders.iter().map(surface).collect(),
            collider_meshes: scene.collider_meshes(),
            shapes: scene.shapes().take(SHAPES_MAX).map(shape_text).collect(),
            poses: ScenePoses::new(&scene),
            name: scene.name,
            unit: scene.unit,
            up: scene.up,
            is_planar: scene.dimensions == 2,
            rate_hz: scene.solver.rate_hz,
        })
    }
}

impl Default for SceneSummary {
    /// The summary of an unreadable scene.
    fn default() -> Self {
        Self {
            name: String::new(),
            unit: "m".to_owned(),
            up: Up::default(),
            is_planar: false,
            rate_hz: 0,
            parameters: ParameterValues::default(),
            surfaces: Vec::new(),
            collider_meshes: ColliderMeshes::new(),
            shapes: Vec::new(),
            poses: ScenePoses::default(),
        }
    }
}

fn shape_text((shape, particles): (&Shape, Range<u64>)) -> ShapeText {
    ShapeText {
        shape: shape.name().to_owned(),
        first: particles.start,
        count: particles.end - particles.start,
        has_bends: false,
    }
}

fn surface(collider: &SceneCollider) -> ColliderSurface {
    ColliderSurface { friction: collider.friction, restitution: collider.restitution }
}

#[cfg(test)]
mod tests {
    use sim_contract::Parameter;

    use super::*;

    #[test]
    fn a_text_that_is_not_a_scene_has_no_summary() {
        assert_eq!(SceneSummary::from_toml("]["), None);
    }

    #[test]
    fn labels_and_parameters_are_read_from_the_text() {
        let text = "
            version = 1
            name = 'a'
            dimensions = 2
            up = '-y'
            gravity = [0, -1.5, 0]
            [[particle]]
            position = [0, 0, 0]
            [solver]
            substeps = 7
            tear_force = 20
            [wind]
            velocity = [1, 0, 0]";
        let summary = SceneSummary::from_toml(text).unwrap();
        assert_eq!((summary.name.as_str(), summary.up, summary.is_planar), ("a", Up::MinusY, true));
        let parameters = summary.parameters;
        assert_eq!(parameters.vector(Parameter::Gravity)[1], -1.5);
        assert_eq!(parameters.count(Parameter::Substeps), 7);
        assert_eq!(parameters.optional(Parameter::TearForce), Some(20.0));
        assert_eq!(parameters.vector(Parameter::WindVelocity)[0], 1.0);
    }

    #[test]
    fn the_shapes_of_a_scene_follow_its_explicit_particles() {
        let text = "
            version = 1
            [[particle]]
            position = [0, 0, 0]
            [[generate]]
            shape = 'rope'
            count = 5
            from = [0, 1, 0]
            to = [1, 1, 0]
            [[generate]]
            shape = 'bridge'
            from = [0, 0, 0]
            to = [3, 0, 0]
            planks = 4
            width = 1";
        let shapes = SceneSummary::from_toml(text).unwrap().shapes;
        let shapes: Vec<_> =
            shapes.iter().map(|one| (one.shape.as_str(), one.first, one.count)).collect();
        assert_eq!(shapes, [("rope", 1, 5), ("bridge", 6, 8)]);
    }
}
