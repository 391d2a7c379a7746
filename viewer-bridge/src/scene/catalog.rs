//! The scenes that every node knows by name.

use serde::Serialize;

use crate::scene::summary::SceneSummary;

/// A scene of the picker.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SceneEntry {
    /// Its name.
    pub name: &'static str,
    /// Steps per second.
    pub rate_hz: u32,
    /// 2 or 3.
    pub dimensions: u32,
    /// What it is, in one line.
    pub text: &'static str,
}

/// The texts that `sim-node` is built with. A test compares the names with what it lists.
const SCENES: [(&str, &str); 14] = [
    ("curtain", include_str!("../../../sim-node/scenes/curtain.toml")),
    ("rope", include_str!("../../../sim-node/scenes/rope.toml")),
    ("flag", include_str!("../../../sim-node/scenes/flag.toml")),
    ("ragdoll", include_str!("../../../sim-node/scenes/ragdoll.toml")),
    ("spider-web", include_str!("../../../sim-node/scenes/spider-web.toml")),
    ("rope-bridge", include_str!("../../../sim-node/scenes/rope-bridge.toml")),
    ("elastic-mesh", include_str!("../../../sim-node/scenes/elastic-mesh.toml")),
    ("tearable-cloth", include_str!("../../../sim-node/scenes/tearable-cloth.toml")),
    ("spring-cloth", include_str!("../../../sim-node/scenes/spring-cloth.toml")),
    ("carried-cloth", include_str!("../../../sim-node/scenes/carried-cloth.toml")),
    ("drop-box", include_str!("../../../sim-node/scenes/drop-box.toml")),
    ("drop-box-braced", include_str!("../../../sim-node/scenes/drop-box-braced.toml")),
    ("pendulum", include_str!("../../../sim-node/scenes/pendulum.toml")),
    ("free-fall", include_str!("../../../sim-node/scenes/free-fall.toml")),
];

/// All of them, in the order of the picker.
pub fn all() -> Vec<SceneEntry> {
    SCENES.iter().map(|(name, text)| entry(name, text)).collect()
}

/// Whether a node knows a scene of that name.
pub fn is_known(name: &str) -> bool {
    SCENES.iter().any(|(known, _)| *known == name)
}

fn entry(name: &'static str, text: &'static str) -> SceneEntry {
    let summary = SceneSummary::read(text);
    SceneEntry {
        name,
        rate_hz: summary.rate_hz,
        dimensions: if summary.is_planar { 2 } else { 3 },
        text: text.lines().next().unwrap_or_default().trim_start_matches(['#', ' ']),
    }
}
