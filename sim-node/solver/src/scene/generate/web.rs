//! A spider's web.

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::{Builder, Pinned, decimal, round};
use crate::frame::rotation_about;
use sim_types::ConstraintKind;

/// A web: the hub is particle 0, then come the rings from the inside, each spoke by spoke.
/// Constraints ring by ring and spoke by spoke: along the spoke from the ring within, then along
/// the ring to the next spoke.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Web {
    /// Position of the hub.
    #[serde(with = "decimal::vector")]
    pub center: [f32; 3],
    /// Of the outermost ring, > 0.
    #[serde(with = "decimal::number")]
    pub radius: f32,
    /// At least 3.
    pub spokes: u32,
    /// At least 1.
    pub rings: u32,
    /// Of the plane that it lies in; the first spoke is towards x, or z for a web across x.
    #[serde(with = "decimal::vector")]
    pub normal: [f32; 3],
}

/// The words for pinned particles of a web.
pub(crate) const PINS: [&str; 3] = ["rim", "hub", "none"];

impl Web {
    pub(super) fn particle_count(&self) -> u64 {
        1 + u64::from(self.spokes) * u64::from(self.rings)
    }

    pub(super) fn constraint_count(&self) -> u64 {
        2 * u64::from(self.spokes) * u64::from(self.rings)
    }

    pub(super) fn build(&self, builder: &mut Builder<'_>) {
        builder.particle(self.center, self.is_pinned(builder.pinned(), 0));
        for ring in 1..=self.rings {
            for spoke in 0..self.spokes {
                let is_pinned = self.is_pinned(builder.pinned(), self.index(ring, spoke));
                builder.particle(self.position(ring, spoke), is_pinned);
            }
        }
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

    fn is_pinned(&self, pinned: &Pinned, index: u32) -> bool {
        match pinned {
            Pinned::Word("rim") => index > (self.rings - 1) * self.spokes,
            Pinned::Word("hub") => index == 0,
            Pinned::Word(_) => false,
            Pinned::List(list) => list.binary_search(&index).is_ok(),
        }
    }
}
