//! Checks of numbers from outside.

use sim_scene::checks::StepSize;
use sim_types::{Method, Reason};

/// Properties of a scene against which values are checked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context<'a> {
    pub(crate) method: Method,
    pub(crate) is_planar: bool,
    pub(crate) has_bends: bool,
    /// By generated block: it has bends.
    pub(crate) bent_blocks: &'a [bool],
    pub(crate) size: StepSize,
}

pub(crate) fn check_finite(numbers: &[f32]) -> Result<(), Reason> {
    let is_finite = numbers.iter().all(|number| number.is_finite());
    if is_finite { Ok(()) } else { Err(Reason::NonFinite) }
}
