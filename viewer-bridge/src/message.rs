//! The text messages, as PROTOCOL.md has them.

pub(crate) mod check;
mod from_page;
pub mod parameters;
pub mod reason;
pub mod settings;
mod to_page;

pub use from_page::{Choice, Command, FromPage, Hello, Malformed};
pub use to_page::{
    Hashes, Level, Limits, Mark, MarkKind, Mode, Node, NodeState, OutcomeText, ParametersText,
    Playback, Status, Timeline, ToPage, Welcome,
};
