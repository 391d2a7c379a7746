//! The messages in shared memory: plain data with a fixed layout.

pub(crate) mod collider;
pub(crate) mod command;
pub(crate) mod forces;
pub(crate) mod member_changes;
pub(crate) mod outcome;
pub(crate) mod parameters;
pub(crate) mod ready;
pub(crate) mod restore;
pub(crate) mod snapshot;
pub(crate) mod status;
pub(crate) mod tears;
pub(crate) mod topology;
pub(crate) mod update;
