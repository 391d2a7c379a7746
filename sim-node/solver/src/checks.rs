//! Checks of numbers from outside.

use sim_types::{COORDINATE_MAX, Method, Reason};

/// Properties of a scene against which values are checked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context {
    pub(crate) method: Method,
    pub(crate) is_planar: bool,
}

/// Returns true if no coordinate exceeds [`COORDINATE_MAX`].
pub(crate) fn is_near(coordinates: &[f32]) -> bool {
    coordinates.iter().all(|coordinate| coordinate.abs() <= COORDINATE_MAX)
}

pub(crate) fn check_finite(numbers: &[f32]) -> Result<(), Reason> {
    let is_finite = numbers.iter().all(|number| number.is_finite());
    if is_finite { Ok(()) } else { Err(Reason::NonFinite) }
}
