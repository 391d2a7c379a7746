//! Colliders and anchors that a page can carry.

use serde::Deserialize;

/// Kind of object that a page can carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ObjectKind {
    /// A collider of the scene.
    Collider,
    /// An anchor of the scene, with its particles.
    Anchor,
}

/// An object that a page can carry, by its index among its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Object {
    /// A collider.
    Collider(u32),
    /// An anchor.
    Anchor(u32),
}

impl ObjectKind {
    /// Returns the object of this kind with an index.
    pub fn at(self, index: u32) -> Object {
        match self {
            Self::Collider => Object::Collider(index),
            Self::Anchor => Object::Anchor(index),
        }
    }
}
