//! Constraints and bends as a scene defines them, and what follows from their definition.

pub mod bends;
pub mod families;
pub mod incidence;
pub mod sides;

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
