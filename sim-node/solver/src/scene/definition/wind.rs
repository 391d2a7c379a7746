//! Moving air, and its effect on a surface.

use serde::Serialize;

use super::decimal;

/// Moving air. A triangle of area A and normal n experiences the force drag A |u n| u, where u is
/// the wind minus the mean velocity of the corners. Each corner takes a third of the force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Wind {
    /// In unit/s; default 0, which is still air.
    #[serde(with = "decimal::vector")]
    pub velocity: [f32; 3],
    /// Half the density of the air times the drag coefficient, in kg/m^3, >= 0; default 0.6.
    #[serde(with = "decimal::number")]
    pub drag: f32,
    /// Amplitude of the gusts as a fraction of the velocity, 0..=1; default 0.
    #[serde(with = "decimal::number")]
    pub gust: f32,
    /// Time between two gusts in seconds, > 0; default 4.
    #[serde(with = "decimal::number")]
    pub gust_period: f32,
}

impl Default for Wind {
    /// Still air at sea level around a flat plate.
    fn default() -> Self {
        Self { velocity: [0.0; 3], drag: 0.6, gust: 0.0, gust_period: 4.0 }
    }
}
