//! Air that moves, and how much of it a surface feels.

use serde::{Deserialize, Serialize};

use super::check::{Range32, Reader};
use super::file::{Number, Vector};
use super::{SceneError, decimal};

/// Air that moves. A triangle of area A and normal n feels the force drag A |u n| u, u being the
/// wind less the mean velocity of its corners; each corner takes a third.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Wind {
    /// Per second; default 0: still air.
    #[serde(with = "decimal::vector")]
    pub velocity: [f32; 3],
    /// Half the density of the air times the drag coefficient, in kg/m^3, >= 0; default 0.6.
    #[serde(with = "decimal::number")]
    pub drag: f32,
    /// How much the velocity swells and ebbs, as a share of it, 0..=1; default 0.
    #[serde(with = "decimal::number")]
    pub gust: f32,
    /// Seconds from one gust to the next, > 0; default 4.
    #[serde(with = "decimal::number")]
    pub gust_period: f32,
}

impl Default for Wind {
    /// Still air at sea level around a flat plate.
    fn default() -> Self {
        Self { velocity: [0.0; 3], drag: 0.6, gust: 0.0, gust_period: 4.0 }
    }
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileWind {
    velocity: Option<Vector>,
    drag: Option<Number>,
    gust: Option<Number>,
    gust_period: Option<Number>,
}

impl Reader<'_> {
    pub(super) fn wind(&self, file: &FileWind) -> Result<Wind, SceneError> {
        let default = Wind::default();
        let number_or = |field, number: &Option<Number>, range, default| {
            number.as_ref().map_or(Ok(default), |number| self.ranged(field, number, range))
        };
        Ok(Wind {
            velocity: self.vector_or("wind.velocity", file.velocity.as_ref(), default.velocity)?,
            drag: number_or("wind.drag", &file.drag, Range32::AT_LEAST_ZERO, default.drag)?,
            gust: number_or("wind.gust", &file.gust, Range32::SHARE, default.gust)?,
            gust_period: number_or(
                "wind.gust_period",
                &file.gust_period,
                Range32::PERIOD,
                default.gust_period,
            )?,
        })
    }
}
