//! A bridge of planks on two ropes.

use glam::{DVec3, Vec3};
use sim_types::ConstraintKind;

use super::builder::{ConstraintBuilder, ParticleBuilder, interpolate, round};
use super::pinned::is_pinned_end;
use crate::fields::Fields;

/// Planks across the line between two points. Plank i joins the particles 2 i (left) and 2 i + 1
/// (right). The constraints follow plank by plank: the plank, then to the next plank left, right
/// and both diagonals.
#[derive(Debug, Clone, PartialEq)]
pub struct Bridge {
    /// Middle of the first plank.
    pub from: [f32; 3],
    /// Middle of the last plank.
    pub to: [f32; 3],
    /// Number of planks, at least 2.
    pub planks: u32,
    /// Length of a plank, > 0. Planks are level and perpendicular to the bridge.
    pub width: f32,
}

impl Bridge {
    /// Returns a bridge with the defaults.
    pub(super) fn blank() -> Self {
        Self { from: [0.0; 3], to: [0.0; 3], planks: 2, width: 1.0 }
    }

    pub(super) fn fields(&mut self, fields: &mut Fields<'_>) {
        if fields.is_planar() {
            let problem = "a bridge needs 3 dimensions (allowed: all other shapes)";
            fields.error("shape", problem);
        }
        fields.point("from", &mut self.from);
        fields.point("to", &mut self.to);
        fields.count("planks", &mut self.planks, 2);
        fields.size("width", &mut self.width);
    }

    pub(super) fn particle_count(&self) -> u64 {
        2 * u64::from(self.planks)
    }

    pub(super) fn constraint_count(&self) -> u64 {
        5 * u64::from(self.planks) - 4
    }

    pub(super) fn build_particles(&self, builder: &mut ParticleBuilder<'_>) {
        let side = self.side(builder.up());
        for plank in 0..self.planks {
            let share = f64::from(plank) / f64::from(self.planks - 1);
            let middle = Vec3::from_array(interpolate(self.from, self.to, share)).as_dvec3();
            for arm in [-side, side] {
                let position = (middle + arm).to_array().map(round);
                builder.particle(position, |word| is_pinned_end(word, plank, self.planks));
            }
        }
    }

    pub(super) fn build_constraints(&self, builder: &mut ConstraintBuilder<'_>) {
        for plank in 0..self.planks {
            let (left, right) = (2 * plank, 2 * plank + 1);
            builder.link([left, right], ConstraintKind::Structural);
            if plank + 1 == self.planks {
                break;
            }
            builder.link([left, left + 2], ConstraintKind::Structural);
            builder.link([right, right + 2], ConstraintKind::Structural);
            builder.link([left, right + 2], ConstraintKind::Shear);
            builder.link([right, left + 2], ConstraintKind::Shear);
            builder.triangle([left, right, right + 2]);
            builder.triangle([left, right + 2, left + 2]);
        }
    }

    /// Returns the vector from the middle of a plank to its right end. The planks of a vertical
    /// bridge lie along x.
    fn side(&self, up: DVec3) -> DVec3 {
        let vector = |axes: [f32; 3]| Vec3::from_array(axes).as_dvec3();
        let across = (vector(self.to) - vector(self.from)).cross(up);
        let across = if across.dot(across) > 0.0 { across.normalize() } else { DVec3::X };
        across * (f64::from(self.width) / 2.0)
    }
}
