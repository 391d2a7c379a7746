//! Distance constraints: their definition in a scene, their order, and their projection.

pub(crate) mod builder;
pub(crate) mod column_writer;
pub(crate) mod columns;
pub(crate) mod families;
pub(crate) mod fields;
pub(crate) mod order;
pub(crate) mod parameters;
pub(crate) mod projection;
pub(crate) mod projection_block;
pub(crate) mod separation;
pub(crate) mod tether_pull;
pub(crate) mod tethers;

use serde::{Deserialize, Serialize};

/// What a constraint is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum ConstraintKind {
    /// Between direct neighbours.
    #[default]
    Structural = 0,
    /// Across a diagonal.
    Shear = 1,
    /// Between next neighbours but one.
    Bend = 2,
    /// Acts only when longer than its rest length.
    Tether = 3,
}

impl ConstraintKind {
    /// The kind of that number, if there is one.
    pub fn from_number(number: u32) -> Option<Self> {
        [Self::Structural, Self::Shear, Self::Bend, Self::Tether].get(number as usize).copied()
    }
}

/// A constraint as the scene defines it. Its index is its position in the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Constraint {
    /// Index of the first particle.
    pub a: u32,
    /// Index of the second particle.
    pub b: u32,
    /// Rest length in the scene's unit, >= 0.
    pub rest_length: f32,
    /// Compliance in m/N (xpbd) or stiffness 0..=1 (pbd).
    pub compliance: f32,
    /// Its purpose.
    pub kind: ConstraintKind,
}
