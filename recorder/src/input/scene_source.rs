//! Loads scenes from built-in scenes, files and recordings.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use recorder::LogReader;
use sim_solver::{Scene, builtin};

use super::text_file::read_text_file;

/// Largest scene, in bytes, and largest file that a scene refers to.
const SCENE_SIZE_BYTES_MAX: u64 = 1 << 30;

/// Reads and validates a scene. `source` is a recording if it ends in `.mcap`, else a scene file if
/// it contains `/` or ends in `.toml`, else the name of a built-in scene.
pub(crate) fn load_scene(source: &str) -> anyhow::Result<Scene> {
    if has_extension(source, ".mcap") {
        let log = LogReader::open(Path::new(source)).with_context(|| source.to_owned())?;
        return scene_in_recording(&log).with_context(|| source.to_owned());
    }
    if source.contains('/') || has_extension(source, ".toml") {
        let text = read_text_file(Path::new(source), SCENE_SIZE_BYTES_MAX)
            .with_context(|| format!("{source}: cannot read the scene"))?;
        return Ok(Scene::from_toml_with_files(&text, source, &|path| read_beside(source, path))?);
    }
    let Some(text) = builtin::text(source) else {
        let names: Vec<_> = builtin::names().collect();
        bail!(
            "there is no built-in scene '{source}' (allowed: {}, a path with / or ending in \
             .toml, or a recording ending in .mcap)",
            names.join(", ")
        );
    };
    Ok(Scene::from_toml(text, source)?)
}

/// Reads a file that a scene refers to. `path` is relative to the scene file.
fn read_beside(scene: &str, path: &str) -> Result<String, String> {
    let folder = Path::new(scene).parent().unwrap_or(Path::new(""));
    read_text_file(&folder.join(path), SCENE_SIZE_BYTES_MAX).map_err(|error| error.to_string())
}

/// Parses the scene in a recording. Errors do not name the recording.
pub(crate) fn scene_in_recording<R: Read>(log: &LogReader<R>) -> anyhow::Result<Scene> {
    if log.scene().is_empty() {
        bail!("has no scene (attachment scene.toml)");
    }
    let text = std::str::from_utf8(log.scene()).context("its attachment scene.toml is not text")?;
    Ok(Scene::from_toml(text, "scene.toml")?)
}

/// Tests the suffix. The documented rule is case-sensitive.
pub(super) fn has_extension(source: &str, extension: &str) -> bool {
    source.ends_with(extension)
}
