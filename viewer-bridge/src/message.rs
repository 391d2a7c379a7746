//! The text messages of the protocol with the pages, as `PROTOCOL.md` describes them.

mod command;
mod from_page;
mod refusal;
mod timeline;
mod to_page;

pub use command::{Brush, Command, CommandKind, Malformed, Object, ObjectKind, parse_published};
pub use from_page::{Choice, FromPage, Hello};
pub use refusal::Refusal;
pub use timeline::{
    GhostState, GhostText, Hashes, HistoryText, Mark, MarkKind, Playback, Timeline, Toward,
};
pub use to_page::{
    Level, Mode, Node, NodeState, OutcomeText, PageLimits, ParametersText, RecordingState,
    RecordingText, Status, ToPage, Undoable, Welcome,
};
