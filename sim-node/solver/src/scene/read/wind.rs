//! The table `[wind]`.

use serde::Deserialize;
use sim_types::NumberRange;

use super::reader::{PERIOD, Reader};
use super::value::{Number, TableKeys, Vector};
use crate::scene::definition::wind::Wind;
use crate::scene::error::SceneError;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileWind {
    velocity: Option<Vector>,
    drag: Option<Number>,
    gust: Option<Number>,
    gust_period: Option<Number>,
}

impl TableKeys for FileWind {}

impl Reader<'_> {
    /// Checks the table `[wind]`.
    pub(super) fn wind(&self, file: &FileWind) -> Result<Wind, SceneError> {
        let default = Wind::default();
        let number_or = |field, number: &Option<Number>, range, default| {
            number.as_ref().map_or(Ok(default), |number| self.ranged(field, number, range))
        };
        Ok(Wind {
            velocity: self.vector_or("wind.velocity", file.velocity.as_ref(), default.velocity)?,
            drag: number_or("wind.drag", &file.drag, NumberRange::AT_LEAST_ZERO, default.drag)?,
            gust: number_or("wind.gust", &file.gust, NumberRange::SHARE, default.gust)?,
            gust_period: number_or(
                "wind.gust_period",
                &file.gust_period,
                PERIOD,
                default.gust_period,
            )?,
        })
    }
}
