//! The ghost of a replay: another recording of the scene.

use serde::Serialize;

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
