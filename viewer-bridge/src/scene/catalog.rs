//! The scenes that pages can load: the built-in ones, which every node knows by name, and files that the user
//! of the viewer has named.

use std::collections::BTreeMap;
use std::path::{self, Path};

use anyhow::{Context, bail};
use serde::Serialize;
use sim_contract::Text;
use sim_host::read_scene_file;
use sim_solver::scene::is_path;
use sim_solver::{Scene, builtin};

use super::summary::SceneSummary;

/// A scene in the picker of a page.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SceneEntry {
    /// Name.
    pub name: String,
    /// Steps per second.
    pub rate_hz: u32,
    /// Number of dimensions: 2 or 3.
    pub dimensions: u32,
    /// Description in one line.
    pub text: String,
    /// Path of its picture beside the page. Scenes from files have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub picture: Option<String>,
}

/// The scenes that pages can load.
#[derive(Debug, Clone)]
pub struct Catalog {
    entries: Vec<SceneEntry>,
    /// Absolute paths of files, by the name of the scene.
    paths: BTreeMap<String, Text>,
}

impl Default for Catalog {
    /// The built-in scenes.
    fn default() -> Self {
        Self { entries: builtin::names().map(built_in_entry).collect(), paths: BTreeMap::new() }
    }
}

impl Catalog {
    /// Adds the scene in a file. Pages load it by its name, so that they learn nothing of other files.
    ///
    /// # Errors
    /// The file is no valid scene, its path is too long for a command, or the name of the scene is taken.
    pub fn add_file(&mut self, path: &Path) -> anyhow::Result<()> {
        let label = path.display().to_string();
        let source = if is_path(&label) { label.clone() } else { format!("./{label}") };
        let read = |path: &Path| read_scene_file(path).map_err(|error| error.to_string());
        let scene = Scene::load(&source, &read)?;
        let name = scene.name;
        if self.entries.iter().any(|entry| entry.name == name) {
            bail!("{label}: there is a scene '{name}' already; give this one another `name`");
        }
        let absolute = path::absolute(path).with_context(|| label.clone())?;
        let text = absolute.to_str().with_context(|| format!("{label}: the path is not UTF-8"))?;
        let text = Text::new(text).with_context(|| format!("{label}: the absolute path"))?;
        self.entries.push(SceneEntry {
            name: name.clone(),
            rate_hz: scene.solver.rate_hz,
            dimensions: scene.dimensions,
            text: label,
            picture: None,
        });
        self.paths.insert(name, text);
        Ok(())
    }

    /// The scenes, in the order of the picker.
    pub fn entries(&self) -> &[SceneEntry] {
        &self.entries
    }

    /// Returns what a node loads for the name of a scene, or `None` for an unknown name.
    pub fn source(&self, name: &str) -> Option<Text> {
        match self.paths.get(name) {
            Some(path) => Some(*path),
            None => builtin::text(name).and_then(|_| Text::new(name).ok()),
        }
    }
}

#[allow(clippy::expect_used, reason = "a miss is a fault of the built-in scenes")]
fn built_in_entry(name: &str) -> SceneEntry {
    let summary = builtin::text(name).and_then(SceneSummary::from_toml);
    let summary = summary.expect("a built-in scene is valid");
    SceneEntry {
        name: name.to_owned(),
        rate_hz: summary.rate_hz,
        dimensions: if summary.is_planar { 2 } else { 3 },
        text: builtin::summary(name).expect("a built-in scene has a description").to_owned(),
        picture: Some(format!("pictures/{name}.png")),
    }
}
