//! Messages about a recording: its contents, its playback and its ghost.

use serde::{Deserialize, Serialize};
use sim_contract::Action;

use crate::limits::COMMANDS_PER_MARK_MAX;

/// The contents of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Timeline {
    /// Name of the file.
    pub file: String,
    /// Name of the scene.
    pub scene: String,
    /// Steps per second.
    pub rate_hz: u32,
    /// First recorded step.
    pub first_step: u64,
    /// Last recorded step.
    pub last_step: u64,
    /// Simulated time of the first step, in s.
    pub first_time_s: f64,
    /// Simulated time of the last step, in s.
    pub last_time_s: f64,
    /// Events, ascending by step; at most [`crate::limits::MARKS_MAX`].
    pub marks: Vec<Mark>,
    /// Result of the check of the recorded hashes.
    pub hashes: Hashes,
    /// The same for the user.
    pub hash_text: String,
    /// The place where the file ends, and the remedy, for the user; empty if it is complete.
    pub incomplete: String,
}

/// Events of one kind at a place on the timeline.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Mark {
    /// Kind of event.
    pub kind: MarkKind,
    /// Step of the first one.
    pub step: u64,
    /// Number of events.
    pub count: u32,
    /// The distinct commands among them, in order of first occurrence; at most
    /// [`COMMANDS_PER_MARK_MAX`]. A `mark` includes its text.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub commands: Vec<String>,
}

impl Mark {
    /// A mark of `count` events other than commands.
    pub(crate) fn new(kind: MarkKind, step: u64, count: u32) -> Self {
        Self { kind, step, count, commands: Vec::new() }
    }

    /// An applied command.
    pub(crate) fn from_action(action: &Action, step: u64) -> Self {
        let kind = match action {
            Action::Pin { .. } | Action::Unpin { .. } => MarkKind::Pin,
            _ => MarkKind::Command,
        };
        let command = match action {
            Action::Mark { text } => format!("mark: {}", text.as_str()),
            _ => action.kind_name().to_owned(),
        };
        Self { kind, step, count: 1, commands: vec![command] }
    }

    /// Adds the events of another mark of this kind.
    pub(crate) fn merge(&mut self, other: Self) {
        self.step = self.step.min(other.step);
        self.count = self.count.saturating_add(other.count);
        for command in other.commands {
            if self.commands.len() < COMMANDS_PER_MARK_MAX && !self.commands.contains(&command) {
                self.commands.push(command);
            }
        }
    }
}

/// Kind of event in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum MarkKind {
    /// Constraints tore.
    Tear,
    /// Particles were pinned or unpinned.
    Pin,
    /// Other commands were applied.
    Command,
    /// Steps began late.
    Late,
}

impl MarkKind {
    /// Number of kinds.
    pub(crate) const COUNT: usize = 4;
}

/// The past of a live simulation that pages can look back at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HistoryText {
    /// Oldest kept step of the load, if a state is kept. The newest one is that of the newest frame.
    pub first_step: Option<u64>,
    /// Events, ascending by step; at most [`crate::limits::HISTORY_MARKS_MAX`].
    pub marks: Vec<Mark>,
    /// The reason for the user, if no state is kept.
    pub text: String,
}

/// The side of a step on which a kept state is searched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Toward {
    /// The last kept state at or before the step.
    #[default]
    Before,
    /// The first kept state at or after the step.
    After,
}

/// Result of the comparison of each recorded state with its recorded hash.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Hashes {
    /// The check is not finished.
    Checking,
    /// Every state that could be checked has its hash.
    Verified,
    /// At least one state has another hash.
    Diverged,
    /// The recording has no hashes.
    Absent,
}

/// The playback of a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Playback {
    /// Time advances.
    pub is_playing: bool,
    /// Simulated seconds per second.
    pub rate: f32,
    /// The playback starts again at its end.
    pub is_looping: bool,
    /// First and last step of the loop; `None` if it is the whole recording.
    pub loop_steps: Option<[u64; 2]>,
    /// Step on show.
    pub step: u64,
    /// Simulated time on show, in s.
    pub time_s: f64,
}

/// The recording whose states are shown as a ghost, and the result of its comparison.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct GhostText {
    /// The stage of the comparison.
    pub state: GhostState,
    /// Name of the recording, if one is chosen.
    pub name: Option<String>,
    /// Name of the one on the command line, which pages can choose beside those of the folder.
    pub given: Option<String>,
    /// The result so far for the user; empty without a ghost.
    pub text: String,
    /// The first step of both recordings at which they differ in a bit.
    pub first_different_step: Option<u64>,
}

/// Stage of the comparison with a ghost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum GhostState {
    /// No ghost is chosen.
    #[default]
    None,
    /// The file is being opened.
    Opening,
    /// The steps that both have are being compared.
    Comparing,
    /// All steps that both have are equal.
    Equal,
    /// A step differs.
    Different,
    /// The recordings cannot be compared further.
    Failed,
}
