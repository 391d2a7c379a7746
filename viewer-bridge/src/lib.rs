//! Shows a running simulation or a recording in a browser and in Foxglove viewers, and lets their users
//! interact with it.
//!
//! A [`Source`] (a live node, or a recording) publishes updates to [`Sinks`]; each [`sink::Sink`]
//! translates them into the protocol of its clients. Commands of the clients return to the source as
//! requests. `PROTOCOL.md` beside this crate specifies the protocol with the pages: [`wire`] is its
//! binary half, [`message`] its text half.
//!
//! ```
//! use viewer_bridge::wire::{FlaggedParticle, Message, Pins, Stamp, decode};
//!
//! let stamp = Stamp { epoch: 1, step: 60 };
//! let pins = Pins { stamp, particles: vec![FlaggedParticle { particle: 3, flags: 1 }] };
//! assert_eq!(decode(&pins.encode())?, Message::Pins(pins));
//! # Ok::<(), viewer_bridge::wire::DecodeError>(())
//! ```
#![forbid(unsafe_code)]

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

pub use foxglove_server::{
    FoxgloveOptions, FoxglovePermission, FoxgloveServer, FoxgloveServerError,
};
pub use pages::hub::Hub;
pub use pages::recordings::Recordings;
pub use pages::replays::Replays;
pub use pages::server::{Server, ServerOptions};
pub use shutdown::Shutdown;
pub use sink::Sinks;
pub use socket::descriptors::open_files_warning;
pub use socket::guard::TokenDemand;
pub use source::Source;
pub use source::recording_files::newest_recording;
pub use source::recording_times::RecordingTimes;
