//! Reads scenes: built-in ones, and files.

use sim_host::read_scene_file;
use sim_solver::Scene;
use sim_solver::scene::LoadError;

/// Loads a scene from a path or by the name of a built-in scene.
pub(crate) fn load(source: &str) -> Result<Scene, LoadError> {
    Scene::load(source, &|path| read_scene_file(path).map_err(|error| error.to_string()))
}
