//! The keys for limits, in the scene's settings and in constraints.

use sim_types::Parameter;

use super::reader::Reader;
use super::value::Number;
use crate::scene::definition::limits::Limits;
use crate::scene::error::SceneError;

/// The keys for limits.
pub(super) struct FileLimits<'a> {
    pub(super) max_stretch: Option<&'a Number>,
    pub(super) tear_stretch: Option<&'a Number>,
    pub(super) tear_distance: Option<&'a Number>,
    pub(super) tear_force: Option<&'a Number>,
}

impl Reader<'_> {
    pub(super) fn limits(
        &self,
        field: impl Fn(&str) -> String,
        file: &FileLimits<'_>,
    ) -> Result<Limits, SceneError> {
        let limit = |number: Option<&Number>, parameter: Parameter| {
            number.map(|number| self.limit(&field(parameter.name()), number, parameter)).transpose()
        };
        Ok(Limits {
            max_stretch: limit(file.max_stretch, Parameter::MaxStretch)?,
            tear_stretch: limit(file.tear_stretch, Parameter::TearStretch)?,
            tear_distance: limit(file.tear_distance, Parameter::TearDistance)?,
            tear_force: limit(file.tear_force, Parameter::TearForce)?,
        })
    }
}
