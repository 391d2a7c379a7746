//! The wind on the triangles of a surface.

use crate::kernels::lanes::Lanes;
use crate::kernels::vectors::{cross, difference, dot, masked, scaled, splat, sum};

/// The wind in one substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WindStep {
    /// Velocity, gust included.
    pub(crate) velocity: [f32; 3],
    /// In kg/m^3.
    pub(crate) drag: f32,
    /// Seconds.
    pub(crate) h: f32,
    /// True in the first substep of a step, where particles have velocities in the place of
    /// displacements.
    pub(crate) is_first: bool,
}

/// A corner of one triangle or eight.
#[derive(Clone, Copy)]
pub(crate) struct Corner<L> {
    pub(crate) position: [L; 3],
    /// Displacement, or velocity in the first substep.
    pub(crate) displacement: [L; 3],
}

/// The wind on one triangle or eight.
///
/// The force on a triangle is drag A |u n| u on both faces alike, a third of it on each corner. A is the
/// area, n the normal, and u the wind less the mean velocity of the corners. A corner divides its mass
/// among its triangles, and each adds at most u times its fraction, so a triangle never overtakes the
/// wind, however large the force.
#[derive(Clone, Copy)]
pub(crate) struct TriangleWind<L> {
    /// u; 0 where the state is not finite.
    pub(crate) relative: [L; 3],
    /// Impulse on a third of the area, per unit of u: drag A |u n| h / 3.
    pub(crate) pressure: L,
}

impl WindStep {
    /// The wind on triangles with these corners.
    #[inline(always)]
    pub(crate) fn on_triangle<L: Lanes>(&self, [a, b, c]: [Corner<L>; 3]) -> TriangleWind<L> {
        let displacements = sum(sum(a.displacement, b.displacement), c.displacement);
        let mean = scaled(displacements, L::splat(self.mean_factor()));
        let relative = difference(splat(self.velocity), mean);
        // Twice the area times the normal.
        let area_normal =
            cross(difference(b.position, a.position), difference(c.position, a.position));
        let factor = L::splat(self.drag * self.h * (0.5 / 3.0));
        let pressure = dot(relative, area_normal).abs() * factor;
        // A triangle whose state is not finite must not affect its neighbours.
        let is_finite = pressure.is_at_most(L::splat(f32::MAX));
        TriangleWind { relative: masked(relative, is_finite), pressure }
    }

    /// Factor from the sum of three displacements to the mean of three velocities.
    fn mean_factor(&self) -> f32 {
        if self.is_first { 1.0 / 3.0 } else { 1.0 / (3.0 * self.h) }
    }
}

impl<L: Lanes> TriangleWind<L> {
    /// Velocity that a corner gains. `share_max` is the fraction of its mass that belongs to the triangle.
    #[inline(always)]
    pub(crate) fn gain(&self, inverse_mass: L, share_max: L) -> [L; 3] {
        let share = self.pressure * inverse_mass;
        scaled(self.relative, L::select(share.is_below(share_max), share, share_max))
    }
}
