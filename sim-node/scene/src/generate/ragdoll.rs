//! A human figure of 15 particles and 20 sticks.

use glam::{DVec3, Vec3};
use sim_types::ConstraintKind;

use super::builder::{ConstraintBuilder, ParticleBuilder, round};
use crate::fields::Fields;

/// A standing human figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Ragdoll {
    /// Point between the feet.
    pub origin: [f32; 3],
    /// Height from the feet to the top of the head, > 0.
    pub height: f32,
}

/// Words for the pinned particles, the default first.
pub(crate) const PIN_WORDS: [&str; 3] = ["none", "head", "hands"];

/// Positions of the particles, sideways and up, as fractions of the height. Left is towards -x.
const PLACES: [(f64, f64); 15] = [
    (0.0, 1.0),    // 0 head
    (0.0, 0.85),   // 1 neck
    (-0.12, 0.82), // 2 left shoulder
    (0.12, 0.82),  // 3 right shoulder
    (-0.17, 0.62), // 4 left elbow
    (0.17, 0.62),  // 5 right elbow
    (-0.2, 0.44),  // 6 left hand
    (0.2, 0.44),   // 7 right hand
    (0.0, 0.53),   // 8 pelvis
    (-0.08, 0.5),  // 9 left hip
    (0.08, 0.5),   // 10 right hip
    (-0.09, 0.27), // 11 left knee
    (0.09, 0.27),  // 12 right knee
    (-0.09, 0.0),  // 13 left foot
    (0.09, 0.0),   // 14 right foot
];

/// Pairs of particles that a bone joins.
const BONES: [[u32; 2]; 14] = [
    [0, 1],
    [1, 2],
    [1, 3],
    [2, 4],
    [4, 6],
    [3, 5],
    [5, 7],
    [1, 8],
    [8, 9],
    [8, 10],
    [9, 11],
    [11, 13],
    [10, 12],
    [12, 14],
];

/// Braces that keep the trunk and the head in shape.
const BRACES: [[u32; 2]; 6] = [[2, 3], [9, 10], [2, 9], [3, 10], [0, 2], [0, 3]];

impl Ragdoll {
    /// Returns a figure with the defaults.
    pub(super) fn blank() -> Self {
        Self { origin: [0.0; 3], height: 1.0 }
    }

    pub(super) fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.vector("origin", &mut self.origin);
        fields.size("height", &mut self.height);
    }

    pub(super) fn particle_count() -> u64 {
        PLACES.len() as u64
    }

    pub(super) fn constraint_count() -> u64 {
        (BONES.len() + BRACES.len()) as u64
    }

    pub(super) fn build_particles(&self, builder: &mut ParticleBuilder<'_>) {
        let origin = Vec3::from_array(self.origin).as_dvec3();
        let up = builder.up();
        for (index, (side, height)) in (0_u32..).zip(PLACES) {
            let place = origin + (DVec3::X * side + up * height) * f64::from(self.height);
            builder.particle(place.to_array().map(round), |word| match word {
                "head" => index == 0,
                "hands" => index == 6 || index == 7,
                _ => false,
            });
        }
    }

    pub(super) fn build_constraints(builder: &mut ConstraintBuilder<'_>) {
        for bone in BONES {
            builder.link(bone, ConstraintKind::Structural);
        }
        for brace in BRACES {
            builder.link(brace, ConstraintKind::Shear);
        }
    }
}
