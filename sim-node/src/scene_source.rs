//! Where a scene comes from: built in, or a file.

use std::fs;

use anyhow::{Context, bail};
use sim_solver::{Scene, builtin};

/// Reads and checks a scene. `source` is a path if it contains `/` or ends in `.toml`, else the
/// name of a built-in scene.
pub(crate) fn load(source: &str) -> anyhow::Result<Scene> {
    if is_path(source) {
        let text = fs::read_to_string(source)
            .with_context(|| format!("{source}: cannot read the scene"))?;
        return Ok(Scene::from_toml(&text, source)?);
    }
    let Some(text) = builtin::text(source) else {
        let names: Vec<_> = builtin::names().collect();
        bail!(
            "there is no built-in scene '{source}' (allowed: {}, or a path with / or ending in .toml)",
            names.join(", ")
        );
    };
    Ok(Scene::from_toml(text, source)?)
}

/// Whether a scene is a file, and not built in.
#[allow(clippy::case_sensitive_file_extension_comparisons, reason = "exactly the documented rule")]
pub(crate) fn is_path(source: &str) -> bool {
    source.contains('/') || source.ends_with(".toml")
}
