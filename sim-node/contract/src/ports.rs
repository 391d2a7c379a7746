//! Services, readers and writers. Of the files elsewhere, only those of `domain`, `owner.rs`, `owner/repetition.rs`,
//! `client/latch.rs` and `client/watch.rs` name iceoryx2.

pub(crate) mod connection;
pub(crate) mod domain;
pub(crate) mod leftovers;
pub(crate) mod memory;
pub(crate) mod mirror;
pub(crate) mod port;
pub(crate) mod raw;
pub(crate) mod reader;
pub(crate) mod service;
pub(crate) mod services;
pub(crate) mod session;
pub(crate) mod source;
pub(crate) mod wake;
pub(crate) mod writer;
