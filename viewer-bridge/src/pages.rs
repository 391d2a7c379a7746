//! The pages: the sink that feeds them, and the server of their files and sockets.

pub mod assets;
pub(crate) mod connection;
mod frames;
mod history;
pub mod hub;
pub mod recordings;
pub mod replays;
pub mod server;
mod session;
