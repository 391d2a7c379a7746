//! Reads scenes: built-in ones, and files.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use sim_contract::SCENE_SIZE_BYTES_MAX;
use sim_solver::{Scene, builtin};

/// Reads and checks a scene. `source` is a path if it contains `/` or ends in `.toml`, else the
/// name of a built-in scene.
pub(crate) fn load(source: &str) -> anyhow::Result<Scene> {
    if is_path(source) {
        let text = read(source).with_context(|| format!("{source}: cannot read the scene"))?;
        return Ok(Scene::from_toml_with_files(&text, source, &|path| read_beside(source, path))?);
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

/// Returns `true` if the scene is a file, not a built-in one.
#[allow(clippy::case_sensitive_file_extension_comparisons, reason = "exactly the documented rule")]
pub(crate) fn is_path(source: &str) -> bool {
    source.contains('/') || source.ends_with(".toml")
}

/// Reads a file named in a scene, relative to the file of the scene.
fn read_beside(scene: &str, path: &str) -> Result<String, String> {
    let folder = Path::new(scene).parent().unwrap_or(Path::new(""));
    read(folder.join(path)).map_err(|error| format!("{error:#}"))
}

/// Reads a regular file of the size of a scene. A running node must not wait for a pipe or read a
/// device.
pub(crate) fn read(path: impl AsRef<Path>) -> anyhow::Result<String> {
    let path = path.as_ref();
    if !std::fs::metadata(path)?.is_file() {
        bail!("it is not a regular file");
    }
    let mut text = String::new();
    let limit = SCENE_SIZE_BYTES_MAX as u64;
    let length = File::open(path)?.take(limit + 1).read_to_string(&mut text)?;
    if length as u64 > limit {
        bail!("it is longer than {limit} bytes");
    }
    Ok(text)
}
