//! The correction of positions by the rounding that is left after contacts.

use glam::Vec3;

use crate::contacts::hit::LaneHit;
use crate::contacts::obstacle::rounding;
use crate::contacts::path::{LanePath, SubstepPath};
use crate::contacts::solid::Solid;
use crate::contacts::solid::lane_solid::LaneSolid;
use crate::kernels::lanes::{Lanes8, Wide};
use crate::kernels::vectors::{lane_of, load, scaled, select, set_lane, store, sum};

/// Eight particles that have advanced, in contact or not.
#[derive(Clone, Copy)]
pub(super) struct Advanced<'a, W> {
    /// Positions, and the displacements by which the particles came there.
    pub(super) path: LanePath<W>,
    /// 1 for a particle in contact, else 0.
    pub(super) touched: &'a Lanes8,
}

/// Positions of particles, where those in contact have left the solid if they were inside by no more than
/// a rounding.
#[inline(always)]
pub(super) fn corrected<W: Wide>(solid: &Solid, particles: &Advanced<'_, W>) -> [W; 3] {
    match solid {
        Solid::HalfSpace(half_space) => corrected_lanes(half_space, solid.reach(), particles),
        Solid::Sphere(sphere) => corrected_lanes(sphere, solid.reach(), particles),
        Solid::Capsule { .. } | Solid::Box { .. } => {
            let (mut starts, mut displacements) = ([[0.0; 8]; 3], [[0.0; 8]; 3]);
            store(particles.path.start, &mut starts);
            store(particles.path.displacement, &mut displacements);
            for lane in (0..8).filter(|lane| particles.touched[*lane] > 0.0) {
                let path = LanePath {
                    start: lane_of(&starts, lane),
                    displacement: lane_of(&displacements, lane),
                };
                set_lane(&mut starts, lane, corrected_one(solid, &path));
            }
            load(&starts)
        }
        Solid::Mesh(_) => particles.path.start,
    }
}

#[inline(always)]
fn corrected_lanes<W: Wide>(
    solid: &impl LaneSolid,
    reach: f32,
    Advanced { path, touched }: &Advanced<'_, W>,
) -> [W; 3] {
    let zero = W::splat(0.0);
    let is_touched = zero.is_below(W::load(touched, 0));
    let at_end = LanePath { displacement: [zero; 3], ..*path };
    if !W::any(W::both(solid.is_inside(&at_end), is_touched)) {
        return path.start;
    }
    let LaneHit { is_hit, normal, depth } = solid.hit(&at_end);
    let is_rounding = depth.is_at_most(rounding(path, reach));
    let is_corrected = W::both(W::both(is_hit, is_touched), is_rounding);
    select(is_corrected, sum(path.start, scaled(normal, depth)), path.start)
}

#[inline(never)]
fn corrected_one(solid: &Solid, path: &LanePath<f32>) -> [f32; 3] {
    let start = Vec3::from_array(path.start);
    match solid.hit(&SubstepPath { start, displacement: Vec3::ZERO }) {
        Some(hit) if hit.depth <= rounding(path, solid.reach()) => {
            (start + hit.normal * hit.depth).to_array()
        }
        _ => path.start,
    }
}
