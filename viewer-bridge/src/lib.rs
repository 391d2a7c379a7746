//! Shows a running simulation or a recording in a browser and in Foxglove viewers, and lets their users
//! interact with it.
//!
//! A [`Source`] (a live node, or a recording) publishes updates to [`Sinks`]; each [`sink::Sink`]
//! translates them into the protocol of its clients. Commands of the clients return to the source as
//! requests. `PROTOCOL.md` beside this crate specifies the protocol with the pages: [`wire`] is its
//! binary half, [`message`] its text half.
//!
//! ```
//! use viewer_bridge::wire::{FlaggedParticle, Kind, Pins, Stamp};
//!
//! let stamp = Stamp { epoch: 1, step: 60 };
//! let pins = Pins { stamp, particles: vec![FlaggedParticle { particle: 3, flags: 1 }] };
//! let message = pins.encode();
//! assert_eq!(message.len(), 32);
//! assert_eq!(message[..2], (Kind::Pins as u16).to_le_bytes());
//! ```
#![forbid(unsafe_code)]

// The decoder of the tests names this crate as other crates do.
#[cfg(test)]
extern crate self as viewer_bridge;

mod foxglove_server;
pub mod limits;
pub mod message;
pub mod pages;
pub mod request;
pub mod scene;
mod shutdown;
pub mod sink;
mod socket;
pub mod source;
pub mod wire;
#[cfg(test)]
#[path = "../tests/wire_decoder.rs"]
mod wire_decoder;

pub use foxglove_server::{
    FoxgloveOptions, FoxglovePermission, FoxgloveServer, FoxgloveServerError,
};
pub use pages::hub::Hub;
pub use pages::recordings::Recordings;
pub use pages::replays::Replays;
pub use pages::server::{Server, ServerOptions};
pub use shutdown::Shutdown;
pub use sink::Sinks;
pub use socket::guard::TokenDemand;
pub use socket::listen::open_files_warning;
pub use source::Source;
pub use source::recording_files::newest_recording;
pub use source::recording_times::RecordingTimes;
