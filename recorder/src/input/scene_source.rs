//! Loads scenes and commands from built-in scenes, files and recordings.

use std::fs;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use recorder::{LogEnd, LogReader, Message};
use sim_solver::{Scene, builtin};

use super::command_file::{self, TimedCommand};

/// Reads and validates a scene. `source` is a recording if it ends in `.mcap`, else a scene file if
/// it contains `/` or ends in `.toml`, else the name of a built-in scene.
pub(crate) fn load_scene(source: &str) -> anyhow::Result<Scene> {
    if has_extension(source, ".mcap") {
        let log = LogReader::open(Path::new(source)).with_context(|| source.to_owned())?;
        return scene_in_recording(&log, source);
    }
    if source.contains('/') || has_extension(source, ".toml") {
        let text = fs::read_to_string(source)
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
    fs::read_to_string(folder.join(path)).map_err(|error| error.to_string())
}

/// Parses the scene in a recording.
pub(crate) fn scene_in_recording<R: Read>(log: &LogReader<R>, path: &str) -> anyhow::Result<Scene> {
    if log.scene().is_empty() {
        bail!("{path}: has no scene (attachment scene.toml)");
    }
    let text = std::str::from_utf8(log.scene())
        .with_context(|| format!("{path}: its attachment scene.toml is not text"))?;
    Ok(Scene::from_toml(text, &format!("{path}/scene.toml"))?)
}

/// Reads commands and sorts them in the order of application. They are the outcomes of a recording
/// if `source` ends in `.mcap`, else the lines of a command file.
pub(crate) fn load_commands(source: &str) -> anyhow::Result<Vec<TimedCommand>> {
    if !has_extension(source, ".mcap") {
        let text = fs::read_to_string(source)
            .with_context(|| format!("{source}: cannot read the commands"))?;
        return Ok(command_file::parse(&text, source)?);
    }
    let mut log = LogReader::open(Path::new(source)).with_context(|| source.to_owned())?;
    let mut commands = Vec::new();
    while let Some(logged) = log.next_message().with_context(|| source.to_owned())? {
        if let Message::Outcome(row) = logged.message {
            commands.push(TimedCommand {
                step: row.step,
                index: Some(row.index),
                client_id: row.client_id,
                sequence: row.sequence,
                action: row.action,
            });
        }
    }
    match log.end() {
        Some(LogEnd::Complete) | None => {}
        Some(end) => bail!("{source}: the file is {end}, so its commands are incomplete"),
    }
    command_file::sort(&mut commands);
    Ok(commands)
}

/// Tests the suffix. The documented rule is case-sensitive.
fn has_extension(source: &str, extension: &str) -> bool {
    source.ends_with(extension)
}
