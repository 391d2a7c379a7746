//! Where a scene and commands come from: built in, a file, or a recording.

use std::fs;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, bail};
use recorder::{LogEnd, LogReader, Message};
use sim_solver::{Scene, builtin};

use crate::command_file::{self, TimedCommand};

/// Reads and checks a scene. `source` is a recording if it ends in `.mcap`, else a scene file if
/// it contains `/` or ends in `.toml`, else the name of a built-in scene.
pub(crate) fn load_scene(source: &str) -> anyhow::Result<Scene> {
    if has_extension(source, ".mcap") {
        let log = LogReader::open(Path::new(source)).with_context(|| source.to_owned())?;
        return scene_of(&log, source);
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

/// Reads a file that a scene names, relative to the scene's own.
fn read_beside(scene: &str, path: &str) -> Result<String, String> {
    let folder = Path::new(scene).parent().unwrap_or(Path::new(""));
    fs::read_to_string(folder.join(path)).map_err(|error| error.to_string())
}

/// The scene that a recording carries.
pub(crate) fn scene_of<R: Read>(log: &LogReader<R>, path: &str) -> anyhow::Result<Scene> {
    if log.scene().is_empty() {
        bail!("{path}: carries no scene (attachment scene.toml)");
    }
    let text = std::str::from_utf8(log.scene())
        .with_context(|| format!("{path}: its attachment scene.toml is not text"))?;
    Ok(Scene::from_toml(text, &format!("{path}/scene.toml"))?)
}

/// Reads commands in the order of their application: out of the log of a recording if `source`
/// ends in `.mcap`, else line by line.
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
        Some(LogEnd::Whole) | None => {}
        Some(end) => bail!("{source}: {end}; its commands are not complete"),
    }
    command_file::sort(&mut commands);
    Ok(commands)
}

/// The documented rule is about exactly these letters.
fn has_extension(source: &str, extension: &str) -> bool {
    source.ends_with(extension)
}
