//! The law of a contact between two particles.

use super::push::Push;
use crate::kernels::lanes::{PackedParticle, axes, map_axes};
use crate::kernels::vectors::dot;

/// A pair of particles that must stay a distance apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair {
    pub(super) slots: [u32; 2],
    /// Distance of the centres, > 0.
    pub(super) distance: f32,
    /// The pairs are resolved in ascending order of this number.
    pub(super) key: u8,
}

impl Pair {
    /// Returns true if the ends of the paths are nearer than `factor` times the contact distance.
    #[inline(always)]
    pub(super) fn is_near(&self, particles: &[PackedParticle], factor: f32) -> bool {
        let [a, b] = self.slots.map(|slot| &particles[slot as usize].0);
        let apart = axes(|axis| (b[axis] - a[axis]) + (b[axis + 4] - a[axis + 4]));
        let reach = factor * self.distance;
        dot(apart, apart) < reach * reach
    }

    /// Pushes the particles apart at the ends of their paths. Momentum is kept.
    ///
    /// The approach of this substep is taken from the displacements, so the particles go on with a
    /// common velocity along the normal. Overlap from before the substep is taken from the displacements up
    /// to a small part of the distance, which lets stacks rest. The rest moves the positions, a part in
    /// each substep, because as a displacement it would be thrown out. Friction is Coulomb's on the
    /// tangential displacement (Unified Particle Physics: Macklin et al. 2014, section 6.1).
    #[inline(always)]
    pub(super) fn push_apart(&self, particles: &mut [PackedParticle], friction: f32) {
        let [a, b] = self.slots.map(|slot| particles[slot as usize].0);
        let start = axes(|axis| b[axis] - a[axis]);
        let moved = axes(|axis| b[axis + 4] - a[axis + 4]);
        let end = axes(|axis| start[axis] + moved[axis]);
        let squared = dot(end, end);
        let t = self.distance;
        let weight = a[3] + b[3];
        // False for NaN.
        let is_touching = squared < t * t && squared > 0.0 && weight > 0.0;
        if !is_touching {
            return;
        }
        let length = squared.sqrt();
        // t^2 - length^2, without the rounding of the sum start + moved.
        let gap = t * t - dot(start, start);
        let depth = (gap - dot(axes(|axis| start[axis] + end[axis]), moved)) / (t + length);
        let depth = if depth > 0.0 { depth } else { 0.0 };
        let push = Push::new(depth, gap / (t + dot(start, start).sqrt()), t);
        let normal = map_axes(end, |axis| axis / length);
        let out = dot(normal, moved);
        let slide = axes(|axis| moved[axis] - normal[axis] * out);
        let slide_length = dot(slide, slide).sqrt();
        let grip = friction * push.displacement;
        let stopped = if grip < slide_length { grip / slide_length } else { 1.0 };
        let correction = axes(|axis| normal[axis] * push.displacement - slide[axis] * stopped);
        let shares = [a[3] / weight, -(b[3] / weight)];
        for (slot, share) in self.slots.into_iter().zip(shares) {
            let particle = &mut particles[slot as usize].0;
            for axis in 0..3 {
                particle[axis] -= normal[axis] * push.position * share;
                particle[axis + 4] -= correction[axis] * share;
            }
        }
    }
}
