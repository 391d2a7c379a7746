//! Loads scenes from built-in scenes, files and recordings.

use std::io::{self, ErrorKind, Read};
use std::path::Path;

use anyhow::{Context, anyhow};
use recording::{LogReader, open_regular_file, recorded_scene};
use sim_contract::{Stop, read_scene_file, to_text};
use sim_solver::Scene;
use sim_solver::scene::LoadError;

/// Reads and validates a scene. `source` is a recording if it ends in `.mcap`, else a scene file if
/// it contains `/` or ends in `.toml`, else the name of a built-in scene.
pub(crate) fn load_scene(source: &str, stop: &Stop) -> anyhow::Result<Scene> {
    if is_recording(source) {
        let log =
            LogReader::open_until(Path::new(source), stop).with_context(|| source.to_owned())?;
        return recorded_scene(&log).with_context(|| source.to_owned());
    }
    let read = |path: &Path| read_scene_file(path).map_err(|error| error.to_string());
    Scene::load(source, &read).map_err(|error| match error {
        LoadError::UnknownName(_) => anyhow!("{error}; or give a recording ending in .mcap"),
        other => other.into(),
    })
}

/// Extension of recordings.
const EXTENSION: &str = ".mcap";

/// Returns `true` for the path of a recording, finished or not. The documented rule is case-sensitive.
pub(crate) fn is_recording(source: &str) -> bool {
    source.strip_suffix(".part").unwrap_or(source).ends_with(EXTENSION)
}

/// Reads a regular file of at most `size_bytes_max` bytes.
pub(crate) fn read_text_file(path: &Path, size_bytes_max: u64) -> io::Result<String> {
    let file = open_regular_file(path)?;
    let mut bytes = Vec::new();
    let size_bytes = file.take(size_bytes_max + 1).read_to_end(&mut bytes)? as u64;
    if size_bytes > size_bytes_max {
        let problem = format!("it is longer than {size_bytes_max} bytes");
        return Err(io::Error::new(ErrorKind::FileTooLarge, problem));
    }
    to_text(bytes).map_err(io::Error::other)
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
        let error = load_scene(path, &Stop::default()).unwrap_err().to_string();
        std::fs::remove_file(path).unwrap();
        assert_eq!(
            error,
            format!("{path}: cannot read the scene: it is a named pipe (FIFO), not a regular file")
        );
    }

    #[test]
    fn an_unknown_scene_is_refused_with_the_known_ones_and_the_recordings() {
        let error = load_scene("knot", &Stop::default()).unwrap_err().to_string();
        assert!(error.starts_with("there is no built-in scene 'knot' (allowed: drape,"), "{error}");
        assert!(error.ends_with("or give a recording ending in .mcap"), "{error}");
    }
}
