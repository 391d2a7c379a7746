//! The built-in scenes, which every node knows by name.

use serde::Serialize;
use sim_solver::builtin;

use super::summary::SceneSummary;

/// A scene in the picker of a page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SceneEntry {
    /// Name.
    pub name: &'static str,
    /// Steps per second.
    pub rate_hz: u32,
    /// Number of dimensions: 2 or 3.
    pub dimensions: u32,
    /// Description in one line.
    pub text: &'static str,
}

/// All built-in scenes, in the order of the picker.
pub fn all() -> Vec<SceneEntry> {
    builtin::names().map(entry).collect()
}

/// Returns whether a built-in scene has this name.
pub fn is_known(name: &str) -> bool {
    builtin::text(name).is_some()
}

#[allow(clippy::expect_used, reason = "a miss is a fault of the built-in scenes")]
fn entry(name: &'static str) -> SceneEntry {
    let summary = builtin::text(name).and_then(SceneSummary::from_toml);
    let summary = summary.expect("a built-in scene is valid");
    SceneEntry {
        name,
        rate_hz: summary.rate_hz,
        dimensions: if summary.is_planar { 2 } else { 3 },
        text: builtin::summary(name).expect("a built-in scene has a description"),
    }
}
