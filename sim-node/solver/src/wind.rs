//! Air: the force of the wind on the triangles of a surface.

use glam::Vec3;

use crate::particles::Particles;
use crate::scene::Wind;

/// What the surface of a scene feels of the air. Empty where there is no surface.
#[derive(Debug, Clone, Default)]
pub(crate) struct Air {
    gust: f32,
    /// Steps from one gust to the next, at least 1.
    gust_period_steps: u64,
    /// By particle: triangles that have it as a corner.
    triangles_at: Vec<f32>,
    /// By particle: the velocity that the air has given it in the running substep.
    pub(crate) gains: Vec<[f32; 3]>,
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
            gains: vec![[0.0; 3]; particles],
        }
    }

    /// Whether there is anything that could feel it.
    pub(crate) fn has_surface(&self) -> bool {
        !self.gains.is_empty()
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
    pub(crate) fn blow(&mut self, particles: &Particles, triangles: &[[u32; 3]], breeze: &Breeze) {
        self.gains.fill([0.0; 3]);
        for corners in triangles {
            let corners = corners.map(|corner| corner as usize);
            let [a, b, c] = corners.map(|corner| vector(particles.positions[corner]));
            let [va, vb, vc] = corners.map(|corner| vector(particles.velocities[corner]));
            let relative = Vec3::from_array(breeze.velocity) - (va + vb + vc) * (1.0 / 3.0);
            // Twice the area times the normal.
            let area_normal = (b - a).cross(c - a);
            let pressure = 0.5 * breeze.drag * relative.dot(area_normal).abs();
            // A triangle whose state is no longer finite must not reach its neighbours.
            if !relative.is_finite() || !area_normal.is_finite() {
                continue;
            }
            for corner in
                corners.into_iter().filter(|corner| particles.positions[*corner][3] != 0.0)
            {
                let share = pressure * breeze.h * particles.positions[corner][3] / 3.0;
                let share_max = 1.0 / self.triangles_at[corner];
                let share = if share < share_max { share } else { share_max };
                let gain = &mut self.gains[corner];
                *gain = (Vec3::from_array(*gain) + relative * share).to_array();
            }
        }
    }
}

fn vector([x, y, z, _]: [f32; 4]) -> Vec3 {
    Vec3::new(x, y, z)
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
