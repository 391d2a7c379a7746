//! The rules that every WebSocket keeps, whichever protocol it carries.

pub(crate) mod guard;
pub(crate) mod listen;
pub(crate) mod peer;
pub(crate) mod pending_connections;
mod rate_limit;
