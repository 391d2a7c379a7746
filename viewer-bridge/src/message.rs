//! The text messages, as PROTOCOL.md has them.

mod from_page;
mod to_page;

pub use from_page::{Choice, Command, FromPage, Hello, Malformed};
pub use to_page::{
    Hashes, Level, Limits, Mark, MarkKind, Mode, Node, NodeState, OutcomeText, ParametersText,
    Playback, Status, Timeline, ToPage, Welcome,
};
