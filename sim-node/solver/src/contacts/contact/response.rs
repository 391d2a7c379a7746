//! The response of particles to a contact: the push, friction and the bounce.

use crate::contacts::obstacle::Surface;
use crate::contacts::path::LanePath;
use crate::kernels::lanes::Lanes;
use crate::kernels::vectors::{difference, dot, masked, scaled, sum};

/// One particle or eight inside an obstacle.
pub(super) struct Contact<L> {
    pub(super) path: LanePath<L>,
    /// Unit vector out of the obstacle.
    pub(super) normal: [L; 3],
    pub(super) depth: L,
    /// Bound on the rounding of the depth.
    pub(super) rounding: L,
    /// Displacement that earlier contacts leave, without bounces; else that of the path.
    pub(super) before: [L; 3],
    /// Displacement before any constraint or contact.
    pub(super) predicted: [L; 3],
    /// Part of the bounce along the normal that earlier contacts with the same mesh give.
    pub(super) bounced: L,
}

/// The displacements after a contact.
pub(super) struct Response<L> {
    /// For this substep.
    pub(super) displacement: [L; 3],
    /// Displacement with which the particle continues, without bounces.
    pub(super) left: [L; 3],
    /// Displacement that the bounce adds to it.
    pub(super) bounce: [L; 3],
}

/// Pushes particles out, and computes the displacements with which they continue.
///
/// Friction acts on the displacement: the tangential part is shortened by at most friction times
/// the depth gained in this substep, so that a particle on a slope stays at rest instead of
/// creeping (Unified Particle Physics: Macklin et al. 2014, section 6.1). Restitution acts on
/// the predicted approach (Detailed Rigid Body Simulation: Mueller et al. 2020, section 3.6).
/// The push itself adds no speed.
#[inline(always)]
pub(super) fn respond<L: Lanes>(surface: &Surface, contact: &Contact<L>) -> Response<L> {
    let Contact { path, normal, depth, rounding, before, predicted, .. } = *contact;
    let zero = L::splat(0.0);
    let push = scaled(normal, depth);
    let carried = if surface.is_still {
        [zero; 3]
    } else {
        surface.displacement_at(sum(sum(path.start, path.displacement), push))
    };
    let relative = difference(before, carried);
    let out = dot(relative, normal);
    let sliding = difference(relative, scaled(normal, out));
    // A particle that rests above the surface by a rounding gains as much depth as one on it.
    let depth_max = depth + rounding;
    let gained = L::select((-out).is_below(depth_max), -out, depth_max);
    let friction = L::splat(surface.friction) * gained.masked(zero.is_below(gained));
    let slide = dot(sliding, sliding).sqrt();
    let share = L::splat(1.0) - friction / slide;
    let kept = masked(scaled(sliding, share), friction.is_below(slide));
    let bounce = if surface.restitution > 0.0 {
        let approach = dot(difference(carried, predicted), normal);
        scaled(normal, bounce(surface, contact, approach))
    } else {
        [zero; 3]
    };
    Response {
        displacement: difference(sum(path.displacement, push), difference(sliding, kept)),
        left: sum(carried, kept),
        bounce,
    }
}

/// Displacement that the bounce adds along the normal.
#[inline(always)]
fn bounce<L: Lanes>(surface: &Surface, contact: &Contact<L>, approach: L) -> L {
    let zero = L::splat(0.0);
    let is_bouncing = L::splat(surface.rest_distance).is_below(approach);
    if !L::any(is_bouncing) {
        return zero;
    }
    let Contact { normal, depth, bounced, .. } = *contact;
    let rebound = surface.rebound(approach, depth, normal);
    let bounce = (L::splat(surface.restitution) * rebound - bounced).masked(is_bouncing);
    bounce.masked(zero.is_below(bounce))
}
