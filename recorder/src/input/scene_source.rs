//! Loads scenes and commands from built-in scenes, files and recordings.

use std::fs;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use recorder::{LogEnd, LogReader, Message};
use sim_contract::read_scene_file;
use sim_solver::Scene;
use sim_solver::scene::LoadError;

use super::command_file::{self, TimedCommand};

/// Reads and validates a scene. `source` is a recording if it ends in `.mcap`, else a scene file if
/// it contains `/` or ends in `.toml`, else the name of a built-in scene.
pub(crate) fn load_scene(source: &str) -> anyhow::Result<Scene> {
    if has_extension(source, ".mcap") {
        let log = LogReader::open(Path::new(source)).with_context(|| source.to_owned())?;
        return scene_in_recording(&log, source);
    }
    let read = |path: &Path| read_scene_file(path).map_err(|error| error.to_string());
    Scene::load(source, &read).map_err(|error| match error {
        LoadError::UnknownName(_) => anyhow!("{error}; or give a recording ending in .mcap"),
        other => other.into(),
    })
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

#[cfg(test)]
mod tests {
    use rustix::fs::{CWD, FileType, Mode, mknodat};

    use super::*;

    #[test]
    fn a_fifo_in_place_of_a_scene_is_refused_without_waiting() {
        let name = format!("{}-recorder-fifo.toml", std::process::id());
        let path = std::env::temp_dir().join(name);
        mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        let path = path.to_str().unwrap();
        let error = load_scene(path).unwrap_err().to_string();
        fs::remove_file(path).unwrap();
        assert_eq!(
            error,
            format!("{path}: cannot read the scene: it is a FIFO, not a regular file")
        );
    }

    #[test]
    fn an_unknown_scene_is_refused_with_the_known_ones_and_the_recordings() {
        let error = load_scene("knot").unwrap_err().to_string();
        assert!(
            error.starts_with("there is no built-in scene 'knot' (allowed: curtain,"),
            "{error}"
        );
        assert!(error.ends_with("or give a recording ending in .mcap"), "{error}");
    }
}
