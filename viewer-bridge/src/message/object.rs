//! Things that a page carries.

use serde::Deserialize;

/// Kind of thing that a page carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ObjectKind {
    /// A collider of the scene.
    Collider,
    /// An anchor of the scene, with its particles.
    Anchor,
}

/// A thing that a page carries, by its index among its kind.
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
