//! Programs to compare the solver with.

pub(crate) mod naive;
pub(crate) mod reference;
