//! Shows a running simulation in a browser, and lets it be touched.
//!
//! A [`Source`] (a live node, or a recording) feeds a [`Hub`]; the hub serves any number of pages
//! over sockets, and hands their commands to the source. `PROTOCOL.md` beside this crate is what
//! both ends of a socket go by; [`wire`] is its binary half, [`message`] its text half.
//!
//! ```
//! use viewer_bridge::wire::{Message, Pins, Stamp, decode};
//!
//! let pins = Pins { stamp: Stamp { epoch: 1, step: 60 }, held: vec![[3, 1]] };
//! assert_eq!(decode(&pins.encode())?, Message::Pins(pins));
//! # Ok::<(), viewer_bridge::wire::DecodeError>(())
//! ```
#![forbid(unsafe_code)]

mod foxglove_server;
pub mod limits;
pub mod message;
pub mod pages;
pub mod scene;
pub mod shown_state;
mod socket;
pub mod source;
pub mod wire;

pub use foxglove_server::{FoxgloveOptions, FoxgloveServer, FoxgloveServerError, Recording};
pub use pages::hub::Hub;
pub use pages::server::{Server, ServerOptions};
pub use source::Source;
