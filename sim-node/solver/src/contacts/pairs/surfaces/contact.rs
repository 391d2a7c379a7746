//! The law of a contact between a particle and a triangle.

use glam::Vec3;

use super::super::push::Push;
use crate::kernels::lanes::PackedParticle;

/// A particle and a point of a triangle that must stay a distance apart in a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct SurfaceContact {
    /// The particle, and the corners of the triangle.
    pub(super) slots: [u32; 4],
    /// By corner: its share of the point.
    pub(super) weights: [f32; 3],
    /// Unit vector from the point to the side of the particle.
    pub(super) normal: Vec3,
    /// Distance along the normal, > 0.
    pub(super) distance: f32,
}

impl SurfaceContact {
    /// Pushes the particle and the triangle apart at the ends of their paths. Momentum is kept.
    ///
    /// The law is that of two particles. The point is a particle with the mean displacement of the corners, and each
    /// of them takes its share of the push: with the weights b of the point and the inverse masses w, the sum of
    /// both is w + sum of w b^2. Friction is Coulomb's on the displacement along the triangle (Unified Particle
    /// Physics: Macklin et al. 2014, section 6.1).
    #[inline(always)]
    pub(super) fn push_apart(&self, particles: &mut [PackedParticle], friction: f32) {
        let Self { slots, weights, normal, distance } = *self;
        let [particle, a, b, c] = slots.map(|slot| particles[slot as usize]);
        let corners = [a, b, c];
        let mean = |of: fn(&PackedParticle) -> Vec3| {
            let [a, b, c] = corners.map(|corner| of(&particle) - of(&corner));
            a * weights[0] + b * weights[1] + c * weights[2]
        };
        let (start, moved) = (mean(position), mean(displacement));
        let inverse_masses = corners.map(|corner| corner.0[3]);
        let mut weight = particle.0[3];
        for corner in 0..3 {
            weight += inverse_masses[corner] * weights[corner] * weights[corner];
        }
        let old = distance - normal.dot(start);
        let out = normal.dot(moved);
        let depth = old - out;
        // False for NaN.
        let is_touching = depth > 0.0 && weight > 0.0;
        if !is_touching {
            return;
        }
        let push = Push::new(depth, old, distance);
        let slide = moved - normal * out;
        let slide_length = slide.dot(slide).sqrt();
        let grip = friction * push.displacement;
        let stopped = if grip < slide_length { grip / slide_length } else { 1.0 };
        let correction = (normal * push.displacement - slide * stopped) / weight;
        let shift = normal * (push.position / weight);
        let mut shares = [particle.0[3], 0.0, 0.0, 0.0];
        for corner in 0..3 {
            shares[corner + 1] = -(inverse_masses[corner] * weights[corner]);
        }
        for (slot, share) in slots.into_iter().zip(shares) {
            let particle = &mut particles[slot as usize].0;
            for axis in 0..3 {
                particle[axis] += shift[axis] * share;
                particle[axis + 4] += correction[axis] * share;
            }
        }
    }
}

fn position(particle: &PackedParticle) -> Vec3 {
    let PackedParticle([x, y, z, ..]) = *particle;
    Vec3::new(x, y, z)
}

fn displacement(particle: &PackedParticle) -> Vec3 {
    let PackedParticle([_, _, _, _, x, y, z, _]) = *particle;
    Vec3::new(x, y, z)
}
