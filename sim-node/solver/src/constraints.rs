//! Distance constraints and bends: their definition in a scene, their order, and their projection.

pub(crate) mod bends;
pub(crate) mod builder;
pub(crate) mod column_writer;
pub(crate) mod columns;
pub(crate) mod families;
pub(crate) mod fields;
pub(crate) mod incidence;
pub(crate) mod order;
pub(crate) mod parameters;
pub(crate) mod projection;
pub(crate) mod projection_block;
pub(crate) mod separation;
pub(crate) mod sides;
pub(crate) mod tether_pull;
pub(crate) mod tethers;

use sim_types::ConstraintKind;

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
