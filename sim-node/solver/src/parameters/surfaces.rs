//! The surfaces of colliders: friction and restitution, which can change while a scene runs.

use serde::{Deserialize, Serialize};
use sim_types::Parameter;

use crate::checks::Context;
use crate::scene::definition::collider::SceneCollider;

/// Friction and restitution of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct ColliderSurface {
    /// Coulomb's coefficient, >= 0.
    pub(crate) friction: f32,
    /// Fraction of the approach speed that a particle keeps, 0..=1.
    pub(crate) restitution: f32,
}

/// The surface of each collider. Empty in a keyframe from before surfaces could change.
#[derive(Debug, Default, PartialEq)]
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

    pub(crate) fn from_all(all: Vec<ColliderSurface>) -> Self {
        Self(all)
    }

    /// By collider.
    pub(crate) fn all(&self) -> &[ColliderSurface] {
        &self.0
    }

    /// Returns true if particles bounce off any collider.
    pub(crate) fn have_bounces(&self) -> bool {
        self.0.iter().any(|one| one.restitution > 0.0)
    }

    /// Changes the surface of one collider, or of all.
    pub(crate) fn set(&mut self, collider: Option<u32>, change: impl Fn(&mut ColliderSurface)) {
        match collider {
            Some(collider) => change(&mut self.0[collider as usize]),
            None => self.0.iter_mut().for_each(change),
        }
    }

    /// Returns true if a scene can have these surfaces.
    pub(crate) fn are_valid(&self, context: Context<'_>) -> bool {
        let is_valid = |one: &ColliderSurface| {
            Parameter::Friction.info().range.contains(one.friction)
                && Parameter::Restitution.info().range.contains(one.restitution)
        };
        let is_of_scene = self.0.is_empty() || self.0.len() as u64 == context.size.colliders;
        is_of_scene && self.0.iter().all(is_valid)
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
