//! Services and their reading and writing ends: the only files that name iceoryx2 beside the messages.

pub(crate) mod domain;
pub(crate) mod latch;
pub(crate) mod port;
pub(crate) mod reader;
pub(crate) mod service;
pub(crate) mod services;
pub(crate) mod session;
pub(crate) mod wake;
pub(crate) mod writer;
