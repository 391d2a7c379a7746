//! The surfaces of colliders: friction and restitution, which can change while a scene runs.

use serde::{Deserialize, Serialize};
use sim_scene::scene::SceneCollider;
use sim_types::{Parameter, Part, Setting};

use crate::checks::Context;

/// Friction and restitution of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct ColliderSurface {
    /// Coulomb's coefficient, >= 0.
    pub(crate) friction: f32,
    /// Fraction of the approach speed that a particle keeps, 0..=1.
    pub(crate) restitution: f32,
}

/// The surface of each collider.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Surfaces(Vec<ColliderSurface>);

impl From<&SceneCollider> for ColliderSurface {
    fn from(collider: &SceneCollider) -> Self {
        Self { friction: collider.friction, restitution: collider.restitution }
    }
}

impl Surfaces {
    pub(crate) fn new(colliders: &[SceneCollider]) -> Self {
        Self(colliders.iter().map(ColliderSurface::from).collect())
    }

    /// By collider.
    pub(crate) fn all(&self) -> &[ColliderSurface] {
        &self.0
    }

    /// Returns true if particles bounce off any collider.
    pub(crate) fn have_bounces(&self) -> bool {
        self.0.iter().any(|one| one.restitution > 0.0)
    }

    /// Stores a checked friction or restitution of one collider, or of all.
    pub(crate) fn set(&mut self, setting: Setting) {
        let surfaces = match setting.part {
            Part::Collider(collider) => std::slice::from_mut(&mut self.0[collider as usize]),
            _ => &mut self.0[..],
        };
        for surface in surfaces {
            *match setting.parameter {
                Parameter::Friction => &mut surface.friction,
                _ => &mut surface.restitution,
            } = setting.value.number().unwrap_or(0.0);
        }
    }

    /// Returns true if a scene can have these surfaces.
    pub(crate) fn are_valid(&self, context: Context<'_>) -> bool {
        let is_valid = |one: &ColliderSurface| {
            Parameter::Friction.info().range.contains(one.friction)
                && Parameter::Restitution.info().range.contains(one.restitution)
        };
        self.0.len() as u64 == context.size.colliders && self.0.iter().all(is_valid)
    }
}

impl Clone for Surfaces {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }

    /// Allocates nothing if both belong to the same scene.
    fn clone_from(&mut self, source: &Self) {
        self.0.clone_from(&source.0);
    }
}
