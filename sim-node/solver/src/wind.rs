//! Air: the force of the wind on the triangles of a surface.

use glam::Vec3;

use crate::bodies::{Bodies, Place};
use crate::scene::Wind;

/// What the surface of a scene feels of the air. Empty where there is no surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Air {
    gust: f32,
    /// Steps from one gust to the next, at least 1.
    gust_period_steps: u64,
    /// By particle: triangles that have it as a corner.
    triangles_at: Vec<f32>,
    /// By particle: what its triangles ask of it, side by side. Empty where no wind is felt.
    corners: Vec<Corner>,
}

/// A particle as a corner of triangles, in the running substep.
#[derive(Debug, Clone, Copy)]
struct Corner {
    place: Place,
    position: Vec3,
    /// The displacement, or the velocity in the first substep.
    displacement: Vec3,
    inverse_mass: f32,
    /// The share of its mass that each of its triangles has.
    share_max: f32,
    /// The velocity that it gets.
    gain: Vec3,
}

/// The air of one substep.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Breeze {
    /// Gust included.
    pub(crate) velocity: [f32; 3],
    /// In kg/m^3.
    pub(crate) drag: f32,
    /// Seconds.
    pub(crate) h: f32,
    /// It is that of the first substep of a step: bodies have velocities in the place of
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
        let mut triangles_at = vec![0.0; particles];
        for corner in triangles.iter().flatten() {
            triangles_at[*corner as usize] += 1.0;
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
            triangles_at,
            corners: Vec::new(),
        }
    }

    /// Whether there is anything that could feel it.
    pub(crate) fn has_surface(&self) -> bool {
        !self.triangles_at.is_empty()
    }

    /// Finds the corners among the bodies.
    pub(crate) fn find_corners(&mut self, bodies: &Bodies) {
        let corner = |(particle, triangles): (u32, &f32)| Corner {
            place: bodies.place(particle),
            position: Vec3::ZERO,
            displacement: Vec3::ZERO,
            inverse_mass: 0.0,
            share_max: 1.0 / triangles,
            gain: Vec3::ZERO,
        };
        self.corners = (0..).zip(&self.triangles_at).map(corner).collect();
    }

    /// How strong the wind is in a step: 1 + gust tri(t), tri being a triangle wave that begins at
    /// 0, rises to 1, falls to -1 and comes back, worked out from whole steps.
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

    /// Works out what the air gives each particle in a substep.
    ///
    /// With A the area, n the normal and u the wind less the mean velocity of the corners, a
    /// triangle feels the force drag A |u n| u on both faces alike; each corner takes a third. A
    /// corner shares its mass among its triangles, and none of them may give it more than u times
    /// its share: however large the force, a triangle never overtakes the wind.
    pub(crate) fn blow(&mut self, bodies: &mut Bodies, triangles: &[[u32; 3]], breeze: &Breeze) {
        for corner in &mut self.corners {
            corner.position = Vec3::from_array(bodies.position(corner.place));
            corner.displacement = Vec3::from_array(bodies.displacement(corner.place));
            corner.inverse_mass = bodies.inverse_mass(corner.place);
            corner.gain = Vec3::ZERO;
        }
        for triangle in triangles {
            self.blow_at(triangle.map(|corner| corner as usize), breeze);
        }
        for corner in &self.corners {
            bodies.set_wind(corner.place, corner.gain.to_array());
        }
    }

    fn blow_at(&mut self, corners: [usize; 3], breeze: &Breeze) {
        let [a, b, c] = corners.map(|corner| &self.corners[corner]);
        let mean = (a.displacement + b.displacement + c.displacement) * breeze.third();
        let relative = Vec3::from_array(breeze.velocity) - mean;
        // Twice the area times the normal.
        let area_normal = (b.position - a.position).cross(c.position - a.position);
        // Of the force on a third of the area, times the time.
        let pressure = relative.dot(area_normal).abs() * (breeze.drag * breeze.h * (0.5 / 3.0));
        // A triangle whose state is no longer finite must not reach its neighbours.
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

impl Breeze {
    /// What brings the sum of three displacements to the mean of three velocities.
    fn third(&self) -> f32 {
        if self.is_first { 1.0 / 3.0 } else { 1.0 / (3.0 * self.h) }
    }
}

#[cfg(test)]
mod tests {
    //! The wave of a gust against its corners.
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
