//! PAST: announces the messages of an earlier state.

use bytes::Bytes;

use super::header::{Kind, Stamp};
use super::writer::Writer;
use crate::wire::convert::count_u32;

/// The head of an earlier state, for a page that looks back. The next `count` binary messages show it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Past {
    /// Load and step.
    pub stamp: Stamp,
    /// Number of messages that follow.
    pub count: usize,
}

impl Past {
    /// Encodes the message.
    pub fn encode(&self) -> Bytes {
        let mut writer = Writer::new(Kind::Past, self.stamp, 24);
        writer.u32(count_u32(self.count));
        writer.u32(0);
        writer.finish()
    }
}
