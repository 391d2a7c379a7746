//! The law of a contact between a particle and a driven body.

use glam::Vec3;

use super::driven_body::DrivenBody;
use crate::contacts::hit::Hit;

/// A particle inside a body.
pub(super) struct BodyContact {
    /// Position at the start of the substep.
    pub(super) start: Vec3,
    pub(super) displacement: Vec3,
    /// Displacement before any constraint or contact.
    pub(super) predicted: Vec3,
    /// 0 for a fixed particle.
    pub(super) inverse_mass: f32,
    pub(super) hit: Hit,
    /// Bound on the rounding of the depth.
    pub(super) rounding: f32,
}

/// Material of a body in a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodySurface {
    pub(super) restitution: f32,
    pub(super) friction: f32,
    /// Approaches up to this distance do not bounce.
    pub(super) rest_distance: f32,
}

/// Effect of a contact on its particle.
pub(super) struct BodyResponse {
    /// Where the particle ends.
    pub(super) end: Vec3,
    /// Displacement with which it continues.
    pub(super) displacement: Vec3,
    /// Impulse on the body, times the length of the substep.
    pub(super) impulse: Vec3,
    /// Arm of the impulse about the center of the body.
    pub(super) arm: Vec3,
}

/// Resolves a contact: body and particle exchange an impulse, after which they no longer approach.
///
/// Along a direction u, a unit impulse changes their relative velocity by w + 1/M + (r x u)^T I^-1 (r x u)
/// (Detailed Rigid Body Simulation: Mueller et al. 2020, section 3.3). Along the normal it ends the approach,
/// and adds the bounce of the predicted approach. Friction ends the sliding with at most friction times
/// the impulse of the depth gained in this substep. What is left of the depth moves the particle only, and adds no
/// speed.
pub(super) fn resolve(
    body: &mut DrivenBody,
    surface: &BodySurface,
    contact: &BodyContact,
) -> BodyResponse {
    let BodyContact { start, displacement, predicted, inverse_mass, hit, rounding } = *contact;
    let Hit { normal, depth } = hit;
    let point = start + displacement + normal * depth;
    let arm = body.arm(point);
    let carried = body.displacement_at(arm);
    let relative = displacement - carried;
    let out = relative.dot(normal);
    let closing = if out < 0.0 { -out } else { 0.0 };
    let compliance = body.inverse_mass_along(arm, normal);
    let weight = inverse_mass + compliance;
    let approach = (carried - predicted).dot(normal);
    let bounce =
        if surface.rest_distance < approach { surface.restitution * approach } else { 0.0 };

    let sliding = relative - normal * out;
    let slide = sliding.length();
    let gained = if closing < depth + rounding { closing } else { depth + rounding };
    let friction = if slide > 0.0 {
        let direction = sliding / slide;
        let limit = surface.friction * gained / weight;
        let stop = slide / (inverse_mass + body.inverse_mass_along(arm, direction));
        direction * if limit < stop { limit } else { stop }
    } else {
        Vec3::ZERO
    };

    let pressure = closing / weight;
    let impulse = normal * (pressure + bounce / weight) - friction;
    body.receive(-impulse, arm);
    let left_depth = depth - compliance * pressure;
    let push = if left_depth > 0.0 && inverse_mass > 0.0 { left_depth } else { 0.0 };
    BodyResponse {
        end: start + displacement + normal * push - friction * inverse_mass,
        displacement: displacement + impulse * inverse_mass,
        impulse: -impulse,
        arm,
    }
}

/// Holds a particle that has no room: it goes where `held` leads, and shares its motion with the body.
pub(super) fn hold(body: &mut DrivenBody, contact: &BodyContact, held: Vec3) -> BodyResponse {
    let BodyContact { start, displacement, inverse_mass, .. } = *contact;
    let end = start + held;
    let arm = body.arm(end);
    let closing = displacement - body.displacement_at(arm);
    // No direction gives the body more than this.
    let length = closing.length();
    let weight = if length > 0.0 {
        inverse_mass + body.inverse_mass_along(arm, closing / length)
    } else {
        inverse_mass + body.inverse_mass()
    };
    let impulse = closing / weight;
    body.receive(impulse, arm);
    BodyResponse { end, displacement: displacement - impulse * inverse_mass, impulse, arm }
}
