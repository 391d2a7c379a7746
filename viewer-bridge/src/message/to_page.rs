//! Messages from the server to a page.

use std::collections::BTreeMap;

use serde::{Serialize, Serializer};
use sim_contract::ParameterValues;

use super::from_page::Choice;
use super::refusal::Refusal;
use super::timeline::{GhostText, HistoryText, Playback, Timeline};
use crate::limits;
use crate::scene::catalog::SceneEntry;
use crate::scene::summary::ColliderSurface;

/// A message to a page.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ToPage {
    /// The answer to the first message of the page.
    Hello(Box<Welcome>),
    /// The state of the node.
    Node(Node),
    /// The parameters of the scene.
    Parameters(Box<ParametersText>),
    /// The answer to a command.
    Outcome(OutcomeText),
    /// The scene is back at its beginning.
    Reset {
        /// First step that shows it.
        step: u64,
    },
    /// The number of pages has changed.
    Clients {
        /// Number of pages, including the receiver.
        count: usize,
    },
    /// A message for the user.
    Notice {
        /// Its severity.
        level: Level,
        /// The message.
        text: String,
    },
    /// The contents of a recording.
    Timeline(Box<Timeline>),
    /// The playback of a recording.
    Playback(Playback),
    /// The ghost of a recording.
    Ghost(GhostText),
    /// The past of a live simulation.
    History(HistoryText),
    /// The recording that the bridge makes.
    Recording(RecordingText),
    /// The newest change of the page that it can undo.
    Undoable {
        /// Kind of change.
        what: Option<Undoable>,
    },
}

impl ToPage {
    /// Encodes the message as JSON.
    ///
    /// # Panics
    /// Never: every message consists of numbers and text, which have a JSON form.
    pub fn to_json(&self) -> String {
        #[allow(clippy::expect_used, reason = "a miss is a fault of these types")]
        serde_json::to_string(self).expect("a message has a JSON form")
    }
}

/// Kind of source.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// A node, or another owner of its services.
    Live,
    /// A recording.
    Replay,
}

/// The server's half of the greeting.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Welcome {
    /// Protocol number.
    pub protocol: u32,
    /// Version of the program.
    pub version: &'static str,
    /// Number of the page.
    pub client: u32,
    /// Kind of source.
    pub mode: Mode,
    /// Format in which the page receives positions.
    pub format: Choice,
    /// Scenes that can be loaded.
    pub scenes: Vec<SceneEntry>,
    /// Names of the recordings that a replay can open instead, newest first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<String>,
    /// Limits that the page must keep.
    pub limits: PageLimits,
}

/// Limits that a page must keep: constants of [`crate::limits`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[allow(missing_docs, reason = "the constants of the same names have the documentation")]
pub struct PageLimits {
    pub message_bytes: usize,
    pub messages_per_second: u32,
    pub clients: usize,
    pub frames_unacknowledged: u32,
    pub constraints_per_cut: usize,
    pub grabs_per_client: usize,
    pub particles_inspected: usize,
    pub steps_at_once: u32,
    pub frames_per_second: u32,
}

impl Default for PageLimits {
    fn default() -> Self {
        Self {
            message_bytes: limits::MESSAGE_SIZE_BYTES_MAX,
            messages_per_second: limits::MESSAGES_PER_SECOND_MAX,
            clients: limits::CLIENTS_MAX,
            frames_unacknowledged: limits::FRAMES_UNACKNOWLEDGED_MAX,
            constraints_per_cut: limits::CONSTRAINTS_PER_CUT_MAX,
            grabs_per_client: limits::GRABS_PER_CLIENT_MAX,
            particles_inspected: limits::PARTICLES_INSPECTED_MAX,
            steps_at_once: limits::STEPS_AT_ONCE_MAX,
            frames_per_second: limits::FRAMES_PER_SECOND_MAX,
        }
    }
}

/// Presence of a node.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NodeState {
    /// No node has been seen yet.
    #[default]
    None,
    /// The node runs.
    Alive,
    /// The node ended or was killed.
    Lost,
}

/// The state of the node.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Node {
    /// Presence of a node.
    pub state: NodeState,
    /// The same for the user, with the remedy.
    pub text: String,
    /// Number of the run, 16 hexadecimal digits.
    pub run_id: Option<String>,
    /// Name of the scene.
    pub scene: Option<String>,
    /// "xpbd" or "pbd".
    pub method: Option<&'static str>,
    /// Steps per second.
    pub rate_hz: u32,
    /// The node waits for `resume` or `step`.
    pub is_paused: bool,
    /// A recording plays on the node's services.
    pub is_replay: bool,
    /// Requested simulated seconds per second.
    pub time_scale: f64,
    /// Process of the node.
    pub process_id: Option<u32>,
}

/// The parameters of the scene; `None` without a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParametersText {
    /// The values are certain. Those of a recording before format 3 are not: it lacks parameters,
    /// and the values are those of its scene.
    pub is_complete: bool,
    /// Present values.
    pub values: Option<ParameterValues>,
    /// Values of the scene.
    pub initial: Option<ParameterValues>,
    /// Friction and restitution of each collider in the scene. COLLIDERS has the present ones.
    pub initial_colliders: Vec<ColliderSurface>,
}

impl ParametersText {
    /// The message without a scene.
    pub(crate) const UNKNOWN: Self =
        Self { is_complete: false, values: None, initial: None, initial_colliders: Vec::new() };
}

/// Fate of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// At least one of its parts was applied, or it has none.
    Applied,
    /// No part was applied.
    Rejected,
    /// Not known.
    Unanswered,
}

/// The answer to a command.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutcomeText {
    /// The client's number for the command.
    pub id: Option<u32>,
    /// Type of the command.
    pub kind: &'static str,
    /// Fate of the command.
    pub status: Status,
    /// First step that shows its effect.
    pub step: Option<u64>,
    /// Number of its parts that were applied.
    pub applied: u32,
    /// Number of its parts that were rejected.
    pub rejected: u32,
    /// Reason of the first rejection; "" in JSON if there is none.
    #[serde(serialize_with = "name_or_empty")]
    pub reason: Option<Refusal>,
    /// A sentence for the user, or "".
    pub text: String,
    /// Step whose state is shown or put in place. Only the answers to `look`, `rewind` and `undo` have it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state_step: Option<u64>,
}

#[allow(
    clippy::ref_option,
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes the field by reference"
)]
fn name_or_empty<S: Serializer>(
    reason: &Option<Refusal>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(reason.map_or("", Refusal::name))
}

impl OutcomeText {
    /// The answer to a command whose parts have no outcome yet.
    pub(crate) fn pending(id: Option<u32>, kind: &'static str) -> Self {
        Self {
            id,
            kind,
            status: Status::Applied,
            step: None,
            applied: 0,
            rejected: 0,
            reason: None,
            text: String::new(),
            state_step: None,
        }
    }

    /// The answer to a command that the bridge itself has applied.
    pub(crate) fn applied(id: Option<u32>, kind: &'static str) -> Self {
        Self { applied: 1, ..Self::pending(id, kind) }
    }

    /// The answer to a command that was refused before it reached a node.
    pub fn refused(id: Option<u32>, kind: &'static str, reason: Refusal) -> Self {
        let mut outcome = Self { status: Status::Rejected, ..Self::pending(id, kind) };
        outcome.reject_part(reason);
        outcome
    }

    /// Counts a rejected part.
    pub(crate) fn reject_part(&mut self, reason: Refusal) {
        self.rejected += 1;
        self.explain(reason);
    }

    /// Gives the reason, unless the outcome already has one.
    pub(crate) fn explain(&mut self, reason: Refusal) {
        if self.reason.is_none() {
            self.reason = Some(reason);
            self.text = reason.text(self.kind).into_owned();
        }
    }
}

/// A change that a page can undo.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Undoable {
    /// A drag of a particle, from the grab on.
    Drag,
    /// A move of a collider or an anchor.
    Carry,
    /// A stroke of the brush, or one push.
    Brush,
    /// A pin.
    Pin,
    /// The removal of a pin.
    Unpin,
    /// A cut: one stroke.
    Cut,
    /// A reset.
    Reset,
    /// A change of parameters.
    Set,
    /// A load of a scene.
    Load,
    /// Going on from an earlier state.
    Rewind,
}

impl Undoable {
    /// Name for the user.
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Drag => "the drag",
            Self::Carry => "the move of a solid or an anchor",
            Self::Brush => "the push",
            Self::Pin => "the pin",
            Self::Unpin => "the removal of a pin",
            Self::Cut => "the cut",
            Self::Reset => "the reset",
            Self::Set => "the change of parameters",
            Self::Load => "the load of another scene",
            Self::Rewind => "the jump to an earlier state",
        }
    }
}

/// Severity of a message for the user.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Information.
    Info,
    /// Something may be unexpected.
    Warning,
    /// Something is wrong.
    Error,
}

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
