//! The scene in a recording.

use std::io::Read;
use std::str::Utf8Error;

use sim_solver::scene::SceneError;
use sim_solver::{SOLVER_VERSION, Scene};

use crate::log::LogReader;

/// The reason why the scene of a recording cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum RecordedSceneError {
    /// Another version of the solver recorded it.
    #[error(
        "recorded with solver version {version}, but this program has version {SOLVER_VERSION}, whose \
         bits differ. Use the program that recorded it"
    )]
    OtherSolver {
        /// The version of the solver that recorded it.
        version: u32,
    },
    /// The recording has no scene.
    #[error("has no scene (attachment scene.toml)")]
    Missing,
    /// The scene is not UTF-8.
    #[error("its attachment scene.toml is not text")]
    NotText(#[from] Utf8Error),
    /// The scene is invalid.
    #[error(transparent)]
    Invalid(#[from] SceneError),
}

/// Parses the scene in a recording.
///
/// # Errors
/// If the recording has no valid scene. Errors do not name the recording.
pub fn recorded_scene<R: Read>(log: &LogReader<R>) -> Result<Scene, RecordedSceneError> {
    if log.scene().is_empty() {
        return Err(RecordedSceneError::Missing);
    }
    Ok(Scene::from_toml(std::str::from_utf8(log.scene())?, "scene.toml")?)
}

/// Parses the scene of a recording that can be simulated again: one of this solver's version.
///
/// # Errors
/// Like [`recorded_scene`], and for another version of the solver.
pub fn scene_to_simulate<R: Read>(log: &LogReader<R>) -> Result<Scene, RecordedSceneError> {
    let version = log.run().solver_version;
    if version != SOLVER_VERSION {
        return Err(RecordedSceneError::OtherSolver { version });
    }
    recorded_scene(log)
}
