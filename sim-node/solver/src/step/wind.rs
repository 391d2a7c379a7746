//! The force of the wind on the triangles of a surface.

use glam::Vec3;

use crate::scene::definition::wind::Wind;
use crate::store::{Location, ParticleStore};

/// The air around the surface of a scene; empty if it has no surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Air {
    gust: f32,
    /// Period of the gusts in steps, at least 1.
    gust_period_steps: u64,
    /// By particle: number of triangles of which it is a corner.
    triangle_counts: Vec<f32>,
    /// By particle: its state in the running substep. Empty in scenes without wind.
    corners: Vec<Corner>,
}

/// A particle as a corner of triangles in the running substep.
#[derive(Debug, Clone, Copy)]
struct Corner {
    location: Location,
    position: Vec3,
    /// Displacement, or velocity in the first substep.
    displacement: Vec3,
    inverse_mass: f32,
    /// Fraction of its mass that belongs to each of its triangles.
    share_max: f32,
    /// Velocity that the wind adds.
    gain: Vec3,
}

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

impl Air {
    pub(crate) fn new(
        wind: Option<Wind>,
        rate_hz: u32,
        particles: usize,
        triangles: &[[u32; 3]],
    ) -> Self {
        let wind = wind.unwrap_or_default();
        let particles = if triangles.is_empty() { 0 } else { particles };
        let mut triangle_counts = vec![0.0; particles];
        for corner in triangles.iter().flatten() {
            triangle_counts[*corner as usize] += 1.0;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 1e6 s of 1e5 steps each"
        )]
        let period = (f64::from(wind.gust_period) * f64::from(rate_hz)).round() as u64;
        Self {
            gust: wind.gust,
            gust_period_steps: period.max(1),
            triangle_counts,
            corners: Vec::new(),
        }
    }

    /// True if the scene has a surface.
    pub(crate) fn has_surface(&self) -> bool {
        !self.triangle_counts.is_empty()
    }

    /// True if the locations of the corners were looked up.
    pub(crate) fn is_located(&self) -> bool {
        !self.corners.is_empty()
    }

    /// Looks up the locations of the corners.
    pub(crate) fn locate_corners(&mut self, store: &ParticleStore) {
        let corner = |(particle, triangles): (u32, &f32)| Corner {
            location: store.location(particle),
            position: Vec3::ZERO,
            displacement: Vec3::ZERO,
            inverse_mass: 0.0,
            share_max: 1.0 / triangles,
            gain: Vec3::ZERO,
        };
        self.corners.clear();
        self.corners.extend((0..).zip(&self.triangle_counts).map(corner));
    }

    /// Factor of the wind in a step, 1 + gust tri(t). The triangle wave tri starts at 0, rises to 1,
    /// falls to -1 and returns to 0; it is computed from whole steps.
    pub(crate) fn strength(&self, scene_step: u64) -> f32 {
        let period = self.gust_period_steps;
        #[allow(clippy::cast_possible_truncation, reason = "the one rounding to the solver's f32")]
        let phase = ((scene_step % period) as f64 / period as f64) as f32;
        let wave = match phase {
            rising if rising < 0.25 => 4.0 * rising,
            falling if falling < 0.75 => 2.0 - 4.0 * falling,
            rising => 4.0 * rising - 4.0,
        };
        1.0 + self.gust * wave
    }

    /// Computes the velocity that the wind adds to each particle in a substep.
    ///
    /// The force on a triangle is drag A |u n| u on both faces alike, a third of it on each corner. A
    /// is the area, n the normal, and u the wind less the mean velocity of the corners. A corner
    /// divides its mass among its triangles, and each adds at most u times its fraction, so a
    /// triangle never overtakes the wind, however large the force.
    pub(crate) fn blow(
        &mut self,
        store: &mut ParticleStore,
        triangles: &[[u32; 3]],
        wind: &WindStep,
    ) {
        for corner in &mut self.corners {
            corner.position = Vec3::from_array(store.position(corner.location));
            corner.displacement = Vec3::from_array(store.displacement(corner.location));
            corner.inverse_mass = store.inverse_mass(corner.location);
            corner.gain = Vec3::ZERO;
        }
        for triangle in triangles {
            self.blow_at(triangle.map(|corner| corner as usize), wind);
        }
        for corner in &self.corners {
            store.set_wind(corner.location, corner.gain.to_array());
        }
    }

    fn blow_at(&mut self, corners: [usize; 3], wind: &WindStep) {
        let [a, b, c] = corners.map(|corner| &self.corners[corner]);
        let mean = (a.displacement + b.displacement + c.displacement) * wind.mean_factor();
        let relative = Vec3::from_array(wind.velocity) - mean;
        // Twice the area times the normal.
        let area_normal = (b.position - a.position).cross(c.position - a.position);
        // Impulse on a third of the area, per unit of relative velocity.
        let pressure = relative.dot(area_normal).abs() * (wind.drag * wind.h * (0.5 / 3.0));
        // A triangle whose state is not finite must not affect its neighbours.
        if !pressure.is_finite() {
            return;
        }
        for corner in corners {
            let corner = &mut self.corners[corner];
            let share = pressure * corner.inverse_mass;
            let share = if share < corner.share_max { share } else { corner.share_max };
            corner.gain += relative * share;
        }
    }
}

impl WindStep {
    /// Factor from the sum of three displacements to the mean of three velocities.
    fn mean_factor(&self) -> f32 {
        if self.is_first { 1.0 / 3.0 } else { 1.0 / (3.0 * self.h) }
    }
}

#[cfg(test)]
mod tests {
    //! The triangle wave of a gust at its corners.
    use super::*;

    #[test]
    fn a_gust_is_a_triangle_wave_of_its_period() {
        let wind = Wind { gust: 0.5, gust_period: 2.0, ..Wind::default() };
        let air = Air::new(Some(wind), 100, 0, &[]);
        for (step, expected) in
            [(0, 1.0), (25, 1.25), (50, 1.5), (100, 1.0), (150, 0.5), (200, 1.0), (2050, 1.5)]
        {
            let strength = air.strength(step);
            assert!((strength - expected).abs() < 1e-6, "step {step}: {strength}");
        }
    }
}
