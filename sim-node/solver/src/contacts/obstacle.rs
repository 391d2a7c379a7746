//! Obstacles: colliders as the particles of one substep meet them.

use glam::Vec3;

use super::colliders::Collider;
use super::contact_substep::{ContactSubstep, Interval};
use super::path::{LanePath, SubstepPath};
use super::solid::{Solid, solids};
use super::zone::Zone;
use crate::kernels::lanes::Lanes;
use crate::kernels::vectors::{cross, difference, dot, scaled, splat, sum, sum_of_magnitudes};
use crate::scene::definition::collider::SceneCollider;

/// A collider in one substep, or one face of bounds.
#[derive(Debug, Clone)]
pub(crate) struct Obstacle {
    /// Index of the collider.
    pub(crate) collider: usize,
    pub(crate) surface: Surface,
    pub(crate) solid: Solid,
    pub(crate) zone: Zone,
}

/// Motion and material of a collider in one substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Surface {
    linear: Vec3,
    angular: Vec3,
    /// Center of the collider.
    pub(crate) pivot: Vec3,
    pub(crate) restitution: f32,
    pub(crate) friction: f32,
    /// Length of the substep in seconds.
    h: f32,
    /// Approaches up to this distance do not bounce: 2 |g| h^2, twice what gravity adds in a substep.
    pub(crate) rest_distance: f32,
    /// Gain of displacement by gravity in the substep: h^2 g.
    fall: Vec3,
}

/// Largest number of obstacles that a collider makes: bounds have six faces.
pub(crate) const OBSTACLES_PER_COLLIDER: usize = 6;

/// Replaces the obstacles by those of a substep, in the order of the scene. Driven bodies are none.
pub(crate) fn place_obstacles(
    obstacles: &mut Vec<Obstacle>,
    colliders: &[Collider],
    substep: &ContactSubstep,
) {
    obstacles.clear();
    let others = colliders.iter().enumerate().filter(|(_, collider)| collider.driven.is_none());
    for (index, collider) in others {
        let surface = Surface::new(collider, substep);
        for solid in solids(collider, substep).into_iter().flatten() {
            let zone = solid.zone();
            obstacles.push(Obstacle { collider: index, surface, solid, zone });
        }
    }
}

/// Depth of a position inside a collider at load. None if it is outside, or inside by no more than
/// rounding.
pub(crate) fn depth_at_load(
    scene: &SceneCollider,
    position: [f32; 3],
    is_planar: bool,
) -> Option<f32> {
    if scene.mesh.is_some() {
        // A mesh has no inside.
        return None;
    }
    let interval = Interval { start: 0.0, end: 0.0 };
    let substep = ContactSubstep { h: 1.0, rest_speed: 0.0, gain: Vec3::ZERO, interval, is_planar };
    let path = SubstepPath { start: Vec3::from_array(position), displacement: Vec3::ZERO };
    let solids = solids(&Collider::new(0, scene), &substep);
    let mut hits = solids.iter().flatten().filter_map(|solid| Some((solid, solid.hit(&path)?)));
    let (_, hit) =
        hits.find(|(solid, hit)| hit.depth > rounding(&(&path).into(), solid.reach()))?;
    Some(hit.depth)
}

/// Bound on the rounding of a depth after a few operations on the coordinates of a path and a solid.
/// `reach` is that of the solid.
#[inline(always)]
pub(crate) fn rounding<L: Lanes>(path: &LanePath<L>, reach: f32) -> L {
    let size = sum_of_magnitudes(path.start) + sum_of_magnitudes(path.displacement);
    L::splat(4.0 * f32::EPSILON) * (size + L::splat(reach))
}

impl Surface {
    fn new(collider: &Collider, substep: &ContactSubstep) -> Self {
        Self {
            linear: collider.linear,
            angular: collider.angular,
            pivot: collider.pivot(substep.interval.end),
            restitution: collider.restitution,
            friction: collider.friction,
            h: substep.h,
            rest_distance: substep.rest_speed * substep.h,
            fall: substep.gain * substep.h,
        }
    }

    /// Displacement, along the normal, with which a particle without loss continues after an approach A that
    /// ends below the surface.
    ///
    /// With the fall G = -h^2 g n of a substep, y^2 / 2 - G y / 2 + G x is constant in free flight, where y is
    /// the displacement along n and x the height: the energy that semi-implicit Euler keeps. From
    /// y = -A at the depth p to y on the surface, y = G / 2 + sqrt((A + G / 2)^2 - 2 G p), which is written
    /// here without cancellation. With y = A, each bounce loses G A / 2 on average.
    #[inline(always)]
    pub(crate) fn rebound<L: Lanes>(&self, approach: L, depth: L, normal: [L; 3]) -> L {
        let (one, two) = (L::splat(1.0), L::splat(2.0));
        let fall = -dot(splat(self.fall.to_array()), normal);
        let depth = L::select(depth.is_below(approach), depth, approach);
        let at_depth = approach + fall / two;
        let at_surface = (at_depth * at_depth - two * fall * depth).sqrt();
        approach + fall * (one - two * depth / (at_depth + at_surface))
    }

    /// Displacement of the collider's material at a point in the substep.
    #[inline(always)]
    pub(crate) fn displacement_at<L: Lanes>(&self, point: [L; 3]) -> [L; 3] {
        let arm = difference(point, splat(self.pivot.to_array()));
        let turning = cross(splat(self.angular.to_array()), arm);
        scaled(sum(splat(self.linear.to_array()), turning), L::splat(self.h))
    }
}
