//! Measures of a run: time, memory and quality of motion.

pub(crate) mod clock;
pub(crate) mod memory;
pub(crate) mod quality;
