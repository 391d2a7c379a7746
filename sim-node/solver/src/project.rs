//! The projection of distance constraints, and the limits of their stretch.

#![allow(clippy::inline_always, reason = "called, a gap goes through memory: 2.8 times slower")]

use std::ops::Range;

use crate::constraints::{Constraints, Rest};
use crate::particles::Particles;
use crate::scene::Method;

/// Squared lengths that have a direction and a root. Below them a pair cannot be moved along
/// itself; above them the state is no longer finite, and must not reach what is joined to it.
const LENGTH_SQUARED: std::ops::RangeInclusive<f32> = f32::MIN_POSITIVE..=f32::MAX;

/// One pass over a group.
pub(crate) fn project_group(
    particles: &mut Particles,
    constraints: &mut Constraints,
    group: Range<usize>,
    pass: Pass,
) {
    match pass.method {
        Method::Xpbd => project_compliant(particles, constraints, group, pass.relaxation),
        Method::Pbd => project_stiff(particles, constraints, group),
    }
}

/// How a pass projects.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pass {
    pub(crate) method: Method,
    /// Share of each correction that is made (xpbd; in pbd the softness has it).
    pub(crate) relaxation: f32,
}

/// Moves each constrained pair towards its rest length, in array order (Gauss-Seidel).
///
/// C = |r| - L with r = (`x_b` - `x_a`) + (`d_b` - `d_a`), w = inverse mass, a = compliance / h^2:
/// `delta_lambda` = -(C + a lambda) / (`w_a` + `w_b` + a), lambda from 0 in each substep
/// (XPBD: Macklin, Mueller, Chentanez 2016, equation 18).
fn project_compliant(
    particles: &mut Particles,
    constraints: &mut Constraints,
    group: Range<usize>,
    relaxation: f32,
) {
    let rests = constraints.pairs[group.clone()].iter().zip(&constraints.rests[group.clone()]);
    let bounds =
        constraints.softness[group.clone()].iter().zip(&constraints.pull_only[group.clone()]);
    let multipliers = &mut constraints.multipliers[group];
    for (((pair, rest), (softness, pull_only)), multiplier) in rests.zip(bounds).zip(multipliers) {
        let Some(gap) = Gap::between(particles, *pair) else { continue };
        if *pull_only && gap.length <= rest.length {
            continue;
        }
        let error = gap.error(*rest);
        // Both sides times the denominator of C: one division.
        let push = error.numerator + *softness * *multiplier * error.denominator;
        let weight = (gap.inverse_mass_sum + *softness) * error.denominator;
        let delta = relaxation * (-push / weight);
        *multiplier += delta;
        gap.close(particles, *pair, delta);
    }
}

/// As [`project_compliant`], but takes the share k' of the error away: `delta_lambda` =
/// -k' C / (`w_a` + `w_b`)
/// (Position Based Dynamics: Mueller et al. 2007, section 3.3).
fn project_stiff(particles: &mut Particles, constraints: &mut Constraints, group: Range<usize>) {
    let rests = constraints.pairs[group.clone()].iter().zip(&constraints.rests[group.clone()]);
    let bounds =
        constraints.softness[group.clone()].iter().zip(&constraints.pull_only[group.clone()]);
    let multipliers = &mut constraints.multipliers[group];
    for (((pair, rest), (share, pull_only)), multiplier) in rests.zip(bounds).zip(multipliers) {
        let Some(gap) = Gap::between(particles, *pair) else { continue };
        if *pull_only && gap.length <= rest.length {
            continue;
        }
        let error = gap.error(*rest);
        let delta = -(*share * error.numerator) / (gap.inverse_mass_sum * error.denominator);
        *multiplier += delta;
        gap.close(particles, *pair, delta);
    }
}

/// Brings each pair that is longer than its longest length back to it, at full stiffness: one pass
/// over all groups, after the soft ones.
pub(crate) fn limit_stretch(particles: &mut Particles, constraints: &Constraints) {
    for (pair, max_length) in constraints.pairs.iter().zip(&constraints.max_lengths) {
        let Some(gap) = Gap::between(particles, *pair) else { continue };
        if gap.length > *max_length {
            let error = gap.error(Rest::new(*max_length));
            let weight = gap.inverse_mass_sum * error.denominator;
            gap.close(particles, *pair, -error.numerator / weight);
        }
    }
}

/// Keeps a particle within a distance of another one, which is not moved.
pub(crate) fn pull_back(particles: &mut Particles, particle: u32, root: u32, length_max: f32) {
    let Some(gap) = Gap::between(particles, [root, particle]) else { return };
    if gap.length <= length_max {
        return;
    }
    let error = gap.error(Rest::new(length_max));
    let scale = error.numerator / (error.denominator * gap.length);
    let displacement = &mut particles.displacements[particle as usize];
    for (axis, along) in gap.separation.iter().enumerate() {
        displacement[axis] -= scale * along;
    }
}

/// The length of a constraint in the middle of a substep.
pub(crate) fn length_between(particles: &Particles, pair: [u32; 2]) -> f32 {
    let [a, b] = pair.map(|particle| particle as usize);
    let along = |axis: usize| {
        (particles.positions[b][axis] - particles.positions[a][axis])
            + (particles.displacements[b][axis] - particles.displacements[a][axis])
    };
    let separation = [0, 1, 2].map(along);
    dot(separation, separation).sqrt()
}

/// A number that is divided together with what follows.
struct Fraction {
    numerator: f32,
    /// > 0.
    denominator: f32,
}

/// The way from particle a to particle b in the middle of a substep.
struct Gap {
    /// r = `x_b` - `x_a` + `d_b` - `d_a`.
    separation: [f32; 3],
    /// |r|.
    length: f32,
    inverse_mass_sum: f32,
    /// |R|^2 of the way R = `x_b` - `x_a` at the start of the substep.
    start_squared: f32,
    /// |r|^2 - |R|^2 = (2 R + D) D, D = `d_b` - `d_a`.
    change: f32,
    /// |D|^2.
    moved_squared: f32,
}

impl Gap {
    /// `None` where a projection can do nothing: both ends are fixed, or they coincide and there
    /// is no direction.
    #[inline(always)]
    fn between(particles: &Particles, [a, b]: [u32; 2]) -> Option<Self> {
        let (a, b) = (a as usize, b as usize);
        let (position_a, position_b) = (particles.positions[a], particles.positions[b]);
        let (d_a, d_b) = (particles.displacements[a], particles.displacements[b]);
        let start = [0, 1, 2].map(|axis| position_b[axis] - position_a[axis]);
        let moved = [0, 1, 2].map(|axis| d_b[axis] - d_a[axis]);
        let separation = [0, 1, 2].map(|axis| start[axis] + moved[axis]);
        let length_squared = dot(separation, separation);
        let inverse_mass_sum = position_a[3] + position_b[3];
        if !LENGTH_SQUARED.contains(&length_squared) || inverse_mass_sum == 0.0 {
            return None;
        }
        let both = [0, 1, 2].map(|axis| start[axis] + separation[axis]);
        Some(Self {
            separation,
            length: length_squared.sqrt(),
            inverse_mass_sum,
            start_squared: dot(start, start),
            change: dot(both, moved),
            moved_squared: dot(moved, moved),
        })
    }

    /// C = |r| - L, without what a difference of two rounded lengths loses.
    ///
    /// In small substeps h^2 g is of the size of one rounding of |r|, and the force lambda / h^2
    /// would be noise. So C = ((|R|^2 - L^2) + (2 R + D) D) / (|r| + L), from |r|^2 - L^2: what the
    /// substep changes keeps all of its digits. Where D is not small against R they may cancel; the
    /// plain difference is safe there, and has as many digits.
    #[inline(always)]
    fn error(&self, rest: Rest) -> Fraction {
        if 64.0 * self.moved_squared < self.start_squared {
            let numerator = (self.start_squared - rest.square) + self.change;
            Fraction { numerator, denominator: self.length + rest.length }
        } else {
            Fraction { numerator: self.length - rest.length, denominator: 1.0 }
        }
    }

    /// `d_a` -= `w_a` lambda n, `d_b` += `w_b` lambda n, with n = r/|r|.
    #[inline(always)]
    fn close(&self, particles: &mut Particles, [a, b]: [u32; 2], lambda: f32) {
        let (a, b) = (a as usize, b as usize);
        let scale = lambda / self.length;
        let (w_a, w_b) = (particles.positions[a][3], particles.positions[b][3]);
        let (scale_a, scale_b) = (w_a * scale, w_b * scale);
        // An end without weight is left out, not moved by 0: a state that blows up gives 0 times
        // infinity, and must not reach what is held.
        if w_a != 0.0 {
            for (axis, along) in self.separation.iter().enumerate() {
                particles.displacements[a][axis] -= scale_a * along;
            }
        }
        if w_b != 0.0 {
            for (axis, along) in self.separation.iter().enumerate() {
                particles.displacements[b][axis] += scale_b * along;
            }
        }
    }
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
