//! The text messages of the protocol with the pages, as `PROTOCOL.md` describes them.

mod body_drive;
mod check;
mod from_page;
mod ghost;
mod object;
mod recording;
mod refusal;
mod timeline;
mod to_page;

pub use body_drive::BodyDrive;
pub use check::check;
pub use from_page::{Choice, Command, FromPage, Hello, Malformed, Wish};
pub use ghost::{GhostState, GhostText};
pub use object::{Object, ObjectKind};
pub use recording::{RecordingState, RecordingText};
pub use refusal::Refusal;
pub use timeline::{Hashes, HistoryText, Mark, MarkKind, Playback, Timeline, Toward};
pub use to_page::{
    Level, Mode, Node, NodeState, OutcomeText, PageLimits, ParametersText, Status, ToPage,
    Undoable, Welcome,
};
