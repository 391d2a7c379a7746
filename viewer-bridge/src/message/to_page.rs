//! What a page is told.

mod timeline;

use serde::Serialize;

pub use timeline::{Hashes, Mark, MarkKind, Playback, Timeline};

use super::Choice;
use crate::limits;
use crate::message::parameters::Parameters;
use crate::message::reason;
use crate::message::settings::SettingEntry;
use crate::scene::catalog::SceneEntry;

/// A message to a page.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ToPage {
    /// The answer to its first message.
    Hello(Box<Welcome>),
    /// Whether there is a node, and how it stands.
    Node(Node),
    /// The parameters of the scene.
    Parameters(Box<ParametersText>),
    /// What became of a command.
    Outcome(OutcomeText),
    /// The scene begins anew.
    Reset {
        /// The step that shows its initial state.
        step: u64,
    },
    /// How many pages there are.
    Clients {
        /// This one included.
        count: usize,
    },
    /// Something to show to the user.
    Notice {
        /// How bad it is.
        level: Level,
        /// What to show.
        text: String,
    },
    /// What a recording holds.
    Timeline(Box<Timeline>),
    /// How a recording is played.
    Playback(Playback),
}

impl ToPage {
    /// As JSON.
    pub fn to_json(&self) -> String {
        // Numbers and texts always have a JSON form.
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// What feeds the server.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// A node, or whatever else owns its name.
    Live,
    /// A recording.
    Replay,
}

/// The server's side of the greeting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Welcome {
    /// Number of the protocol.
    pub protocol: u32,
    /// Version of the program.
    pub version: &'static str,
    /// Number of the page.
    pub client: u32,
    /// What feeds the server.
    pub mode: Mode,
    /// How the page will get positions.
    pub format: Choice,
    /// What can be loaded.
    pub scenes: Vec<SceneEntry>,
    /// What can be set.
    pub settings: &'static [SettingEntry],
    /// What a page has to keep to.
    pub limits: Limits,
}

/// What a page has to keep to: the constants of [`crate::limits`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[allow(missing_docs, reason = "named as the constants, which say what they are")]
pub struct Limits {
    pub message_bytes: usize,
    pub messages_per_second: u32,
    pub clients: usize,
    pub frames_unacknowledged: u32,
    pub constraints_per_cut: usize,
    pub particles_held: usize,
    pub steps_at_once: u32,
    pub frames_per_second: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            message_bytes: limits::MESSAGE_SIZE_BYTES_MAX,
            messages_per_second: limits::MESSAGES_PER_SECOND_MAX,
            clients: limits::CLIENTS_MAX,
            frames_unacknowledged: limits::FRAMES_UNACKNOWLEDGED_MAX,
            constraints_per_cut: limits::CONSTRAINTS_PER_CUT_MAX,
            particles_held: limits::PARTICLES_HELD_MAX,
            steps_at_once: limits::STEPS_AT_ONCE_MAX,
            frames_per_second: limits::FRAMES_PER_SECOND_MAX,
        }
    }
}

/// Whether there is a node.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NodeState {
    /// None has been seen.
    #[default]
    None,
    /// It runs.
    Alive,
    /// It ended, or was killed.
    Lost,
}

/// Whether there is a node, and how it stands.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Node {
    /// Whether there is one.
    pub state: NodeState,
    /// The same for the user, with what to do.
    pub text: String,
    /// 16 hexadecimal digits.
    pub run_id: Option<String>,
    /// Name of the scene.
    pub scene: Option<String>,
    /// "xpbd" or "pbd".
    pub method: Option<&'static str>,
    /// Steps per second.
    pub rate_hz: u32,
    /// Whether it waits for `resume` or `step`.
    pub is_paused: bool,
    /// Whether a recording is played.
    pub is_replay: bool,
    /// The pace that is asked for.
    pub time_scale: f64,
    /// The process.
    pub process_id: Option<u32>,
}

/// The parameters of the scene; none without a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParametersText {
    /// Whether every command that changed them was seen.
    pub is_complete: bool,
    /// As they are.
    pub values: Option<Parameters>,
    /// As the scene has them.
    pub initial: Option<Parameters>,
}

/// Whether a command took effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// At least one of its parts, or nothing was to do.
    Applied,
    /// None of it.
    Rejected,
    /// Not known.
    Unanswered,
}

/// What became of a command.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutcomeText {
    /// The page's number for it.
    pub id: Option<u32>,
    /// Its word.
    pub kind: &'static str,
    /// Whether it took effect.
    pub status: Status,
    /// The first step that shows it.
    pub step: Option<u64>,
    /// How many of its parts were applied.
    pub applied: u32,
    /// How many were rejected.
    pub rejected: u32,
    /// Word of the first rejection, or "".
    pub reason: &'static str,
    /// A sentence for the user, or "".
    pub text: String,
}

impl OutcomeText {
    /// The outcome of what was refused before it reached a node; `reason` is its word.
    pub fn refused(id: Option<u32>, kind: &'static str, reason: &'static str) -> Self {
        Self {
            id,
            kind,
            status: Status::Rejected,
            step: None,
            applied: 0,
            rejected: 1,
            reason,
            text: reason::text(reason).to_owned(),
        }
    }
}

/// How bad something is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Good to know.
    Info,
    /// Something may not be as expected.
    Warning,
    /// Something is not.
    Error,
}
