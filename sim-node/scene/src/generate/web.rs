//! A spider's web.

use glam::{DVec3, Vec3};
use sim_types::ConstraintKind;

use super::builder::{ConstraintBuilder, ParticleBuilder, round};
use crate::fields::{Fields, printed};
use crate::rotation::rotation_about;

/// A web. The hub is particle 0, followed by the rings from the inside outwards, each spoke by
/// spoke. The constraints follow in the same order, two each: along the spoke from the inner ring,
/// then along the ring to the next spoke.
#[derive(Debug, Clone, PartialEq)]
pub struct Web {
    /// Position of the hub.
    pub center: [f32; 3],
    /// Radius of the outermost ring, > 0.
    pub radius: f32,
    /// Number of spokes, at least 3.
    pub spokes: u32,
    /// Number of rings, at least 1.
    pub rings: u32,
    /// Normal of the web's plane. The first spoke points towards x, or towards z if the normal is
    /// nearly parallel to x.
    pub normal: [f32; 3],
}

/// Words for the pinned particles, the default first.
pub(crate) const PIN_WORDS: [&str; 3] = ["rim", "hub", "none"];

impl Web {
    /// Returns a web with the defaults.
    pub(super) fn blank() -> Self {
        Self { center: [0.0; 3], radius: 1.0, spokes: 3, rings: 1, normal: [0.0, 0.0, 1.0] }
    }

    pub(super) fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.vector("center", &mut self.center);
        fields.size("radius", &mut self.radius);
        fields.count("spokes", &mut self.spokes, 3);
        fields.count("rings", &mut self.rings, 1);
        fields.value("normal", &mut self.normal, |at| at.normal(), printed);
    }

    pub(super) fn particle_count(&self) -> u64 {
        1 + u64::from(self.spokes) * u64::from(self.rings)
    }

    pub(super) fn constraint_count(&self) -> u64 {
        2 * u64::from(self.spokes) * u64::from(self.rings)
    }

    pub(super) fn build_particles(&self, builder: &mut ParticleBuilder<'_>) {
        builder.particle(self.center, |word| word == "hub");
        for ring in 1..=self.rings {
            for spoke in 0..self.spokes {
                let position = self.position(ring, spoke);
                builder.particle(position, |word| word == "rim" && ring == self.rings);
            }
        }
    }

    pub(super) fn build_constraints(&self, builder: &mut ConstraintBuilder<'_>) {
        for ring in 1..=self.rings {
            for spoke in 0..self.spokes {
                let here = self.index(ring, spoke);
                builder.link([self.index(ring - 1, spoke), here], ConstraintKind::Structural);
                let next = self.index(ring, (spoke + 1) % self.spokes);
                builder.link([here, next], ConstraintKind::Structural);
            }
        }
    }

    fn index(&self, ring: u32, spoke: u32) -> u32 {
        if ring == 0 { 0 } else { 1 + (ring - 1) * self.spokes + spoke }
    }

    fn position(&self, ring: u32, spoke: u32) -> [f32; 3] {
        let vector = |axes: [f32; 3]| Vec3::from_array(axes).as_dvec3();
        let normal = vector(self.normal).normalize();
        let first = if normal.x.abs() < 0.9 { DVec3::X } else { DVec3::Z };
        let first = (first - normal * normal.dot(first)).normalize();
        let angle = std::f64::consts::TAU * f64::from(spoke) / f64::from(self.spokes);
        let radius = f64::from(self.radius) * f64::from(ring) / f64::from(self.rings);
        let arm = rotation_about(normal, angle) * (first * radius);
        (vector(self.center) + arm).to_array().map(round)
    }
}
