//! The sources: a live node or a recording.

mod feed;
pub mod live;
pub mod replay;

pub use feed::Source;
