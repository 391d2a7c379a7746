//! Explicit particles and constraints of a scene.

use serde::Serialize;

use super::decimal;
use super::limits::Limits;
use super::softness::Softness;
use sim_types::ConstraintKind;

/// An explicit particle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SceneParticle {
    /// Relative to the scene's origin.
    #[serde(with = "decimal::vector")]
    pub position: [f32; 3],
    /// In kg, > 0. A pinned particle keeps its mass for a later unpin.
    #[serde(with = "decimal::number")]
    pub mass: f32,
    /// Fixed at its position.
    pub pinned: bool,
    /// In unit/s; 0 if pinned.
    #[serde(with = "decimal::vector")]
    pub velocity: [f32; 3],
}

/// An explicit constraint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SceneConstraint {
    /// Indices of two different particles.
    pub particles: [u32; 2],
    /// In the scene's unit, >= 0.
    #[serde(with = "decimal::number")]
    pub rest_length: f32,
    /// Role of the constraint.
    pub kind: ConstraintKind,
    /// Softness in the measure of the scene's method.
    #[serde(flatten)]
    pub softness: Softness,
    /// Limits that replace the scene's. Infinity is off.
    #[serde(flatten)]
    pub limits: Limits,
}
