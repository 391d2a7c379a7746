//! Reads and builds the scene of a load.

use sim_contract::{LoadPreparer, Reason};
use sim_solver::{Scene, Solver};

use crate::node::publisher::LoadMessages;
use crate::scene_source;

/// Settings of the node that replace those of each scene.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overrides {
    pub(crate) rate_hz: Option<u32>,
    pub(crate) substeps: Option<u32>,
}

/// Why a scene cannot be loaded.
#[derive(Debug)]
pub(in crate::node) struct Refusal {
    /// For the people who read the node's warnings.
    pub(in crate::node) problem: String,
    /// For the outcome of the command.
    pub(in crate::node) reason: Reason,
}

/// A scene that is ready to run, but for the threads of its solver. Its shared memory is prepared.
#[derive(Debug)]
pub(in crate::node) struct Loaded {
    pub(in crate::node) scene: Scene,
    pub(in crate::node) solver: Solver,
    pub(in crate::node) messages: LoadMessages,
    /// Its rate is not that of the run.
    pub(in crate::node) begins_run: bool,
}

/// Reads and builds a scene for a run at `rate_hz`, or for a new one if the scene has another rate.
pub(super) fn load(
    source: &str,
    overrides: Overrides,
    rate_hz: u32,
    preparer: &LoadPreparer,
) -> Result<Loaded, Refusal> {
    let reason = Reason::OutOfRange;
    let mut scene = scene_source::load(source)
        .map_err(|error| Refusal { problem: format!("{error:#}"), reason })?;
    scene
        .override_solver(overrides.rate_hz, overrides.substeps)
        .map_err(|problem| Refusal { problem, reason })?;
    scene
        .check_memory(scene.published_bytes())
        .map_err(|error| Refusal { problem: error.to_string(), reason: Reason::NoEffectHere })?;
    let begins_run = scene.solver.rate_hz != rate_hz;
    let solver = if begins_run { Solver::new(&scene) } else { Solver::new_in_run(&scene) };
    let messages = LoadMessages::new(&scene, &solver);
    messages
        .check_memory()
        .map_err(|error| Refusal { problem: error.to_string(), reason: Reason::NoEffectHere })?;
    preparer
        .prepare(&messages.sizes())
        .map_err(|error| Refusal { problem: error.to_string(), reason: Reason::NoEffectHere })?;
    Ok(Loaded { scene, solver, messages, begins_run })
}
