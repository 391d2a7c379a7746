//! The text messages of the protocol with the pages, as `PROTOCOL.md` describes them.

mod command;
mod from_page;
mod ghost;
mod recording;
mod refusal;
mod timeline;
mod to_page;

pub use command::{Brush, Command, CommandKind, Malformed, Object, ObjectKind, parse_published};
pub use from_page::{Choice, FromPage, Hello};
pub use ghost::{GhostState, GhostText};
pub use recording::{RecordingState, RecordingText};
pub use refusal::Refusal;
pub use timeline::{Hashes, HistoryText, Mark, MarkKind, Playback, Timeline, Toward};
pub use to_page::{
    Level, Mode, Node, NodeState, OutcomeText, PageLimits, ParametersText, Status, ToPage,
    Undoable, Welcome,
};
