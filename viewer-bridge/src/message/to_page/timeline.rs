//! What a recording holds, and how it is played.

use serde::Serialize;

/// What a recording holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timeline {
    /// Name of the file.
    pub file: String,
    /// Name of the scene.
    pub scene: String,
    /// Steps per second.
    pub rate_hz: u32,
    /// The first recorded step.
    pub first_step: u64,
    /// The last recorded step.
    pub last_step: u64,
    /// Simulated time of the first step, in s.
    pub first_time_s: f64,
    /// Simulated time of the last step, in s.
    pub last_time_s: f64,
    /// What happened, ascending by step; at most [`crate::limits::MARKS_MAX`].
    pub marks: Vec<Mark>,
    /// Whether its states have their recorded hashes.
    pub hashes: Hashes,
    /// The same for the user.
    pub hash_text: String,
}

/// Something that happened in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Mark {
    /// What.
    pub kind: MarkKind,
    /// When.
    pub step: u64,
    /// How many.
    pub count: u32,
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MarkKind {
    /// Constraints tore.
    Tear,
    /// Particles were pinned or unpinned.
    Pin,
    /// Other commands.
    Command,
    /// Late steps.
    Late,
}

/// Whether every recorded state has the hash that was recorded with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Hashes {
    /// It is being read, from the start of the server on.
    Checking,
    /// All that could be checked have.
    Verified,
    /// At least one has not.
    Diverged,
    /// The recording has none.
    Absent,
}

/// How a recording is played.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Playback {
    /// Whether it goes on.
    pub is_playing: bool,
    /// Simulated time per time.
    pub rate: f32,
    /// Whether it begins again at its end.
    pub is_looping: bool,
    /// Where it is.
    pub step: u64,
    /// The same in s.
    pub time_s: f64,
}
