//! Obstacles: colliders as the particles of one substep meet them.

use glam::Vec3;
use sim_scene::scene::SceneCollider;

use super::colliders::Collider;
use super::contact_substep::{ContactSubstep, Interval};
use super::path::{LanePath, SubstepPath};
use super::solid::{Solid, solids};
use super::zone::Zone;
use crate::kernels::lanes::Lanes;
use crate::kernels::vectors::{cross, difference, dot, scaled, splat, sum, sum_of_magnitudes};

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
    /// True if both velocities are 0.
    pub(crate) is_still: bool,
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

/// The solids of a collider in their pose at load.
#[derive(Debug)]
pub(crate) struct SolidsAtLoad([Option<Solid>; OBSTACLES_PER_COLLIDER]);

impl SolidsAtLoad {
    pub(crate) fn new(scene: &SceneCollider, is_planar: bool) -> Self {
        if scene.mesh.as_ref().is_some_and(|mesh| !mesh.is_solid) {
            return Self(Default::default());
        }
        let interval = Interval { start: 0.0, end: 0.0 };
        let substep =
            ContactSubstep { h: 1.0, rest_speed: 0.0, gain: Vec3::ZERO, interval, is_planar };
        Self(solids(&Collider::new(0, scene), &substep))
    }

    /// Depth of a position inside a solid. None if it is outside, or inside by no more than rounding.
    pub(crate) fn depth(&self, position: [f32; 3]) -> Option<f32> {
        let path = SubstepPath { start: Vec3::from_array(position), displacement: Vec3::ZERO };
        self.0.iter().flatten().find_map(|solid| {
            let (start, displacement) = (path.start.to_array(), [0.0; 3]);
            let depth = match solid {
                Solid::Mesh(mesh) if solid.zone().may_meet(start, displacement) => {
                    mesh.depth(path.start)
                }
                Solid::Mesh(_) => None,
                convex => convex.hit(&path).map(|hit| hit.depth),
            };
            depth.filter(|depth| *depth > rounding(&(&path).into(), solid.reach()))
        })
    }
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
            is_still: [collider.linear, collider.angular] == [Vec3::ZERO; 2],
            pivot: collider.pivot(substep.interval.end),
            restitution: collider.surface.restitution,
            friction: collider.surface.friction,
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
