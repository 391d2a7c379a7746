//! A line of particles.

use serde::Serialize;
use sim_types::ConstraintKind;

use super::builder::{ConstraintBuilder, ParticleBuilder, interpolate};
use super::pinned::is_pinned_end;
use crate::constraints::families::Family;
use crate::scene::definition::decimal;

/// A line of particles. Constraint i joins the particles i and i + 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rope {
    /// Number of particles, at least 2.
    pub count: u32,
    /// Position of the first particle.
    #[serde(with = "decimal::vector")]
    pub from: [f32; 3],
    /// Position of the last particle.
    #[serde(with = "decimal::vector")]
    pub to: [f32; 3],
}

impl Rope {
    pub(super) fn particle_count(&self) -> u64 {
        u64::from(self.count)
    }

    pub(super) fn constraint_count(&self) -> u64 {
        u64::from(self.count) - 1
    }

    pub(super) fn build_particles(&self, builder: &mut ParticleBuilder<'_>) {
        for index in 0..self.count {
            let share = f64::from(index) / f64::from(self.count - 1);
            let position = interpolate(self.from, self.to, share);
            builder.particle(position, |word| is_pinned_end(word, index, self.count));
        }
    }

    pub(super) fn build_constraints(&self, builder: &mut ConstraintBuilder<'_>) {
        builder.sheet(self.count, 1);
        for index in 0..self.count - 1 {
            let family = Family::Horizontal.group(0, index as usize);
            builder.family_link([index, index + 1], ConstraintKind::Structural, family);
        }
    }
}
