//! Real-time scheduling of the loop and of the solver's threads, a CPU for the loop, and locked memory.
//!
//! A run without them works, only with more lateness. So each one that the system refuses is reported
//! with its cure, and is an error only if the options require it.

pub(crate) mod cpus;
mod memory;
pub(crate) mod preparation;
mod refused;
pub(crate) mod rest;
pub(crate) mod scheduling;

use serde::Serialize;

/// Options of real time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct RealTimeOptions {
    /// Priority of SCHED_FIFO, 1 to 99. `None` asks for no real-time scheduling and no locked memory.
    pub(crate) priority: Option<u8>,
    /// Makes a refusal of the system an error.
    pub(crate) is_required: bool,
    /// CPU that the loop runs on. With a priority, the default is the last allowed one.
    pub(crate) cpu: Option<usize>,
}

/// Real-time properties that a run has obtained.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct RealTime {
    /// Priority of SCHED_FIFO.
    pub(crate) fifo_priority: Option<u8>,
    /// CPU that the loop runs on.
    pub(crate) cpu: Option<usize>,
    pub(crate) is_memory_locked: bool,
}
