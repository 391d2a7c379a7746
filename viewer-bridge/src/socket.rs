//! The rules that every WebSocket keeps, whichever protocol it carries.

pub(crate) mod descriptors;
pub(crate) mod guard;
pub(crate) mod listen;
pub(crate) mod lobby;
mod local_address;
pub(crate) mod peer;
mod rate_limit;
mod throttle;
