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
    /// By triangle: where its corners are, and the share of its mass that each has for it.
    /// Empty where no wind is felt.
    corners: Vec<[Corner; 3]>,
}

/// A corner of a triangle.
#[derive(Debug, Clone, Copy)]
struct Corner {
    place: Place,
    /// One of as many as there are triangles at it.
    share_max: f32,
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
    pub(crate) fn find_corners(&mut self, bodies: &Bodies, triangles: &[[u32; 3]]) {
        let corner = |particle: u32| Corner {
            place: bodies.place(particle),
            share_max: 1.0 / self.triangles_at[particle as usize],
        };
        self.corners = triangles.iter().map(|corners| corners.map(corner)).collect();
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
    pub(crate) fn blow(&self, bodies: &mut Bodies, breeze: &Breeze) {
        for corner in self.corners.iter().flatten() {
            bodies.set_wind(corner.place, [0.0; 3]);
        }
        let third = 1.0 / (3.0 * if breeze.is_first { 1.0 } else { breeze.h });
        for corners in &self.corners {
            let vector = |axes: [f32; 3]| Vec3::from_array(axes);
            let [a, b, c] = corners.map(|corner| vector(bodies.position(corner.place)));
            let [da, db, dc] = corners.map(|corner| vector(bodies.displacement(corner.place)));
            let relative = vector(breeze.velocity) - (da + db + dc) * third;
            // Twice the area times the normal.
            let area_normal = (b - a).cross(c - a);
            let pressure = 0.5 * breeze.drag * relative.dot(area_normal).abs();
            // A triangle whose state is no longer finite must not reach its neighbours.
            if !relative.is_finite() || !area_normal.is_finite() {
                continue;
            }
            for Corner { place, share_max } in corners {
                let share = pressure * breeze.h * bodies.inverse_mass(*place) / 3.0;
                let share = if share < *share_max { share } else { *share_max };
                let gain = vector(bodies.wind(*place)) + relative * share;
                bodies.set_wind(*place, gain.to_array());
            }
        }
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
