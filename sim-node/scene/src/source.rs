//! Scenes by their name on a command line: a path, or the name of a built-in scene.

use std::path::Path;

use sim_types::did_you_mean;
use thiserror::Error;

use super::definition::Scene;
use super::error::SceneError;
use crate::builtin;

/// A scene that cannot be loaded.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum LoadError {
    /// The file of the scene cannot be read.
    #[error("{path}: cannot read the scene: {problem}")]
    Unreadable {
        /// The path as given.
        path: String,
        /// The error of the reader.
        problem: String,
    },
    /// No built-in scene has this name.
    #[error(
        "there is no built-in scene '{0}'{meant} (allowed: {names}, or a path with / or ending in .toml)",
        meant = did_you_mean(.0, builtin::names()),
        names = builtin::names().collect::<Vec<_>>().join(", ")
    )]
    UnknownName(String),
    /// The source is a mesh.
    #[error(
        "{0} is a mesh, not a scene: `sim-node import {0} -o {stem}.toml` makes a scene of it",
        stem = Path::new(.0.as_str()).file_stem().unwrap_or_default().display()
    )]
    Mesh(String),
    /// The source is a recording.
    #[error(
        "{0} is a recording, not a scene: `recorder scene {0} > {stem}.toml` writes its scene",
        stem = Path::new(.0.as_str()).file_stem().unwrap_or_default().display()
    )]
    Recording(String),
    /// The text of the scene is wrong.
    #[error(transparent)]
    Wrong(#[from] SceneError),
}

impl LoadError {
    /// Returns what is wrong, of a wrong scene as [`SceneError::list`].
    pub fn list(&self) -> String {
        match self {
            Self::Wrong(error) => error.list(),
            other => other.to_string(),
        }
    }
}

/// Returns `true` if a source is a path: it contains `/` or ends in `.toml`. All other sources are
/// names of built-in scenes.
#[allow(clippy::case_sensitive_file_extension_comparisons, reason = "exactly the documented rule")]
pub fn is_path(source: &str) -> bool {
    source.contains('/') || source.ends_with(".toml")
}

fn has_extension(source: &str, expected: &str) -> bool {
    Path::new(source).extension().is_some_and(|extension| extension.eq_ignore_ascii_case(expected))
}

impl Scene {
    /// Loads a scene from a path or by the name of a built-in scene; see [`is_path`].
    ///
    /// This crate opens no file: `read_file` receives the path of the scene, and the paths of the
    /// meshes that it names, which are relative to the scene. It returns the text of the file, or
    /// what is wrong.
    ///
    /// # Errors
    /// A file cannot be read, no built-in scene has this name, or the scene is wrong.
    pub fn load(
        source: &str,
        read_file: &dyn Fn(&Path) -> Result<String, String>,
    ) -> Result<Self, LoadError> {
        if has_extension(source, "obj") {
            return Err(LoadError::Mesh(source.to_owned()));
        }
        if has_extension(source, "mcap") {
            return Err(LoadError::Recording(source.to_owned()));
        }
        if !is_path(source) {
            let text =
                builtin::text(source).ok_or_else(|| LoadError::UnknownName(source.to_owned()))?;
            return Ok(Self::from_toml(text, source)?);
        }
        let path = Path::new(source);
        let text = read_file(path)
            .map_err(|problem| LoadError::Unreadable { path: source.to_owned(), problem })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let read_mesh = |mesh: &str| {
            let path = folder.join(mesh);
            read_file(&path).map_err(|problem| {
                if Path::new(mesh).is_absolute() {
                    return problem;
                }
                let path = path.display();
                format!("{problem} (a path is relative to the scene, so this is {path})")
            })
        };
        Ok(Self::from_toml_with_files(&text, source, &read_mesh)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const SCENE: &str = "version = 1\n[[generate]]\nshape = \"obj\"\npath = \"a.obj\"\n";

    #[test]
    fn a_mesh_is_refused_with_the_command_that_makes_a_scene_of_it() {
        for source in ["shirt.obj", "./some/shirt.OBJ"] {
            let error = Scene::load(source, &|_| Err("read".to_owned())).unwrap_err();
            assert_eq!(
                error.to_string(),
                format!(
                    "{source} is a mesh, not a scene: `sim-node import {source} -o shirt.toml` makes a scene of it"
                )
            );
        }
    }

    #[test]
    fn a_mesh_that_cannot_be_read_is_named_with_its_folder() {
        let error = |mesh: &str| {
            let scene = SCENE.replace("a.obj", mesh);
            let read = |path: &Path| {
                let is_scene = path == Path::new("some/scene.toml");
                if is_scene { Ok(scene.clone()) } else { Err("no such file".to_owned()) }
            };
            Scene::load("some/scene.toml", &read).unwrap_err().to_string()
        };
        let relative = error("a.obj");
        let expected =
            "a.obj: no such file (a path is relative to the scene, so this is some/a.obj)";
        assert!(relative.contains(expected), "{relative}");
        let absolute = error("/a.obj");
        assert!(absolute.contains("/a.obj: no such file (allowed"), "{absolute}");
    }

    #[test]
    fn a_recording_is_refused_with_the_command_that_writes_its_scene() {
        let error = Scene::load("runs/a.mcap", &|_| Err("read".to_owned())).unwrap_err();
        let expected = "runs/a.mcap is a recording, not a scene: `recorder scene runs/a.mcap > a.toml` writes its scene";
        assert_eq!(error.to_string(), expected);
    }

    #[test]
    fn a_path_is_read_together_with_the_meshes_beside_it() {
        let read = |path: &Path| match path.to_str() {
            Some("some/where.toml") => Ok(SCENE.to_owned()),
            Some("some/a.obj") => Ok(MESH.to_owned()),
            other => Err(format!("unexpected {other:?}")),
        };
        let scene = Scene::load("some/where.toml", &read).unwrap();
        assert_eq!((scene.name.as_str(), scene.counts().particles), ("where", 3));
    }

    #[test]
    fn other_sources_are_built_in_scenes() {
        let no_file = |path: &Path| Err(format!("reads {path:?}"));
        assert_eq!(Scene::load("rope", &no_file).unwrap().name, "rope");
        let error = Scene::load("knot", &no_file).unwrap_err().to_string();
        let expected = "there is no built-in scene 'knot' (allowed: drape, curtain,";
        assert!(error.starts_with(expected), "{error}");
    }

    #[test]
    fn errors_name_the_file_once() {
        let gone = |_: &Path| Err("it is gone".to_owned());
        let error = Scene::load("a.toml", &gone).unwrap_err().to_string();
        assert_eq!(error, "a.toml: cannot read the scene: it is gone");
        let wrong = |_: &Path| Ok("version = 3".to_owned());
        let error = Scene::load("./a.toml", &wrong).unwrap_err().to_string();
        assert_eq!(error, "./a.toml:1: version: 3 is out of range (allowed: 1)");
    }
}
