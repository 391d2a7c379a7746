//! The air around the surface of a scene.

use sim_scene::scene::Wind;

/// The air around the surface of a scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct Air {
    gust: f32,
    /// Period of the gusts in steps, at least 1.
    gust_period_steps: u64,
}

impl Air {
    pub(crate) fn new(wind: Option<Wind>, rate_hz: u32) -> Self {
        let wind = wind.unwrap_or_default();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 1e6 s of 1e5 steps each"
        )]
        let period = (f64::from(wind.gust_period) * f64::from(rate_hz)).round() as u64;
        Self { gust: wind.gust, gust_period_steps: period.max(1) }
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
}

#[cfg(test)]
mod tests {
    //! The triangle wave of a gust at its corners.
    use super::*;

    #[test]
    fn a_gust_is_a_triangle_wave_of_its_period() {
        let wind = Wind { gust: 0.5, gust_period: 2.0, ..Wind::default() };
        let air = Air::new(Some(wind), 100);
        for (step, expected) in
            [(0, 1.0), (25, 1.25), (50, 1.5), (100, 1.0), (150, 0.5), (200, 1.0), (2050, 1.5)]
        {
            let strength = air.strength(step);
            assert!((strength - expected).abs() < 1e-6, "step {step}: {strength}");
        }
    }
}
