//! Messages about the recording that the bridge makes for its pages.

use std::collections::BTreeMap;

use serde::Serialize;

/// The recording that the bridge makes, or the last one that it made.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RecordingText {
    /// State of the work on it.
    pub state: RecordingState,
    /// An explanation for the user, or "".
    pub text: String,
    /// Name under which the finished recording can be opened.
    pub name: Option<String>,
    /// Its file on the host of the bridge.
    pub path: Option<String>,
    /// Time since the start, in s.
    pub seconds: f64,
    /// Number of recorded snapshots.
    pub snapshots: u64,
    /// Size of the file so far.
    pub size_bytes: u64,
    /// Number of missing messages, for topics that have any.
    pub lost: BTreeMap<String, u64>,
}

/// State of a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RecordingState {
    /// The bridge makes no recordings; the text says why.
    #[default]
    Unavailable,
    /// There is none yet.
    Idle,
    /// It is being made.
    Recording,
    /// Its end is being written.
    Finishing,
    /// It is complete.
    Finished,
    /// It failed; the text says why.
    Failed,
}
