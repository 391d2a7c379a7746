//! A line of particles.

use glam::Vec3;
use sim_types::ConstraintKind;

use super::builder::{ConstraintBuilder, ParticleBuilder, interpolate, round};
use super::pinned::is_pinned_end;
use crate::constraints::bends::families::BendFamily;
use crate::constraints::bends::{Bend, BendShape, SECOND_DIFFERENCE};
use crate::constraints::families::Family;
use crate::fields::{Fields, RIGIDITY};

/// A line of particles. Constraint i joins the particles i and i + 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Rope {
    /// Number of particles, at least 2.
    pub count: u32,
    /// Position of the first particle.
    pub from: [f32; 3],
    /// Position of the last particle.
    pub to: [f32; 3],
    /// Bending rigidity EI in N m^2, >= 0, if it has any.
    pub bending: Option<f32>,
}

impl Rope {
    /// Returns a rope with the defaults.
    pub(crate) fn blank() -> Self {
        Self { count: 2, from: [0.0; 3], to: [0.0; 3], bending: None }
    }

    pub(super) fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.count("count", &mut self.count, 2);
        fields.point("from", &mut self.from);
        fields.point("to", &mut self.to);
        fields.optional_number("bending", &mut self.bending, RIGIDITY);
    }

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

    /// Returns the distance of neighbours.
    pub fn spacing(&self) -> f64 {
        let [from, to] = [self.from, self.to].map(|end| Vec3::from_array(end).as_dvec3());
        from.distance(to) / f64::from(self.count - 1)
    }

    pub(super) fn bend_count(&self) -> u64 {
        if self.bending.is_some() { u64::from(self.count).saturating_sub(2) } else { 0 }
    }

    /// Appends a bend at each particle between two others.
    pub(super) fn build_bends(&self, builder: &mut ConstraintBuilder<'_>) {
        let Some(rigidity) = self.bending else { return };
        let geometry = round(self.spacing().powi(3));
        for index in builder.first..builder.first + self.count.saturating_sub(2) {
            let bend = Bend {
                particles: [index, index + 1, index + 2, index + 1],
                coefficients: SECOND_DIFFERENCE,
                geometry,
                rigidity,
                shape: BendShape::Line,
                block: None,
            };
            let family = BendFamily::Across.group(0, (index - builder.first) as usize);
            builder.model.push_bend(bend, Some(family));
        }
    }
}
