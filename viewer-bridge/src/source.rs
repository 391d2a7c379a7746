//! The sources: a live node or a recording.

mod feed;
pub mod live;
pub(crate) mod recording_files;
pub mod recording_times;
pub mod replay;
pub mod shown_state;
pub mod thread;

pub use feed::Source;
