//! When a constraint stops stretching, and when it tears.

use serde::Serialize;

use super::check::{Range32, Reader};
use super::file::{FileConstraint, FileSolver, Number};
use super::{SceneError, decimal};

/// When a constraint stops stretching, and when it tears. In a scene, `None` is off; in a
/// constraint, `None` is the scene's limit and infinity is off.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Limits {
    /// Largest length / rest length, > 1: kept after the soft passes, at full stiffness.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub max_stretch: Option<f32>,
    /// Length / rest length above which it tears, > 1.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_stretch: Option<f32>,
    /// Length beyond the rest length above which it tears, in the scene's unit, >= 0.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_distance: Option<f32>,
    /// Force above which it tears, in N, > 0.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_force: Option<f32>,
}

impl Limits {
    /// These limits, and the other's where these have none; `None` is off.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            max_stretch: self.max_stretch.or(other.max_stretch),
            tear_stretch: self.tear_stretch.or(other.tear_stretch),
            tear_distance: self.tear_distance.or(other.tear_distance),
            tear_force: self.tear_force.or(other.tear_force),
        }
    }
}

/// The keys of the limits, as they are written in a scene.
struct FileLimits<'a> {
    max_stretch: &'a Option<Number>,
    tear_stretch: &'a Option<Number>,
    tear_distance: &'a Option<Number>,
    tear_force: &'a Option<Number>,
}

impl Reader<'_> {
    pub(super) fn scene_limits(&self, file: &FileSolver) -> Result<Limits, SceneError> {
        let FileSolver { max_stretch, tear_stretch, tear_distance, tear_force, .. } = file;
        let file = FileLimits { max_stretch, tear_stretch, tear_distance, tear_force };
        self.limits(|key| format!("solver.{key}"), &file)
    }

    pub(super) fn constraint_limits(
        &self,
        index: usize,
        file: &FileConstraint,
    ) -> Result<Limits, SceneError> {
        let FileConstraint { max_stretch, tear_stretch, tear_distance, tear_force, .. } = file;
        let file = FileLimits { max_stretch, tear_stretch, tear_distance, tear_force };
        self.limits(|key| format!("constraint[{index}].{key}"), &file)
    }

    fn limits(
        &self,
        field: impl Fn(&str) -> String,
        file: &FileLimits<'_>,
    ) -> Result<Limits, SceneError> {
        let limit = |key: &str, number: &Option<Number>, range| match number {
            Some(number) => self.limit(&field(key), number, range).map(Some),
            None => Ok(None),
        };
        Ok(Limits {
            max_stretch: limit("max_stretch", file.max_stretch, Range32::RATIO)?,
            tear_stretch: limit("tear_stretch", file.tear_stretch, Range32::RATIO)?,
            tear_distance: limit("tear_distance", file.tear_distance, Range32::DISTANCE_LIMIT)?,
            tear_force: limit("tear_force", file.tear_force, Range32::FORCE_LIMIT)?,
        })
    }

    /// A number of a range, or infinity.
    pub(super) fn limit(
        &self,
        field: &str,
        number: &Number,
        range: Range32,
    ) -> Result<f32, SceneError> {
        if *number.get_ref() == f64::INFINITY {
            return Ok(f32::INFINITY);
        }
        self.ranged(field, number, range)
    }
}
