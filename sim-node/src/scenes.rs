//! `scenes`, `show` and `check`: scenes without a simulation.

pub(crate) mod import;

use serde::Serialize;
use sim_solver::builtin;
use sim_solver::scene::SceneCounts;

use crate::args::{CheckArgs, ScenesArgs, ShowArgs};
use crate::output::Exit;
use crate::output::{Align, Table};
use crate::{output, scene_source};

/// One built-in scene in the list.
#[derive(Serialize)]
struct SceneRow {
    name: &'static str,
    rate_hz: u32,
    particles: usize,
    constraints: usize,
    pins: usize,
    text: &'static str,
}

impl SceneRow {
    fn new(name: &'static str) -> anyhow::Result<Self> {
        let scene = scene_source::load(name)?;
        let SceneCounts { particles, constraints, pins, .. } = scene.counts();
        let text = builtin::summary(name).unwrap_or_default();
        Ok(Self { name, rate_hz: scene.solver.rate_hz, particles, constraints, pins, text })
    }
}

/// Lists the built-in scenes.
pub(crate) fn list(args: &ScenesArgs) -> anyhow::Result<()> {
    let rows: Vec<SceneRow> = builtin::names().map(SceneRow::new).collect::<Result<_, _>>()?;
    if args.json {
        return output::text(&(serde_json::to_string_pretty(&rows)? + "\n"));
    }
    let mut table = Table::new([
        ("scene", Align::Left),
        ("rate", Align::Right),
        ("particles", Align::Right),
        ("constraints", Align::Right),
        ("pins", Align::Right),
        ("", Align::Left),
    ]);
    for SceneRow { name, rate_hz, particles, constraints, pins, text } in rows {
        table.add([
            name.to_owned(),
            format!("{rate_hz} Hz"),
            particles.to_string(),
            constraints.to_string(),
            pins.to_string(),
            text.to_owned(),
        ]);
    }
    output::text(&table.text())
}

/// Prints the effective scene.
pub(crate) fn show(args: &ShowArgs) -> anyhow::Result<()> {
    output::file(&scene_source::load(&args.scene)?.to_toml())
}

/// Result of a check.
#[derive(Serialize)]
struct CheckedScene {
    name: String,
    #[serde(flatten)]
    counts: SceneCounts,
    rate_hz: u32,
    substeps: u32,
    iterations: u32,
    warnings: Vec<String>,
}

/// Checks a scene: errors fail, and all of them are printed, like warnings.
pub(crate) fn check(args: &CheckArgs) -> anyhow::Result<Exit> {
    let scene = match scene_source::load(&args.scene) {
        Ok(scene) => scene,
        Err(error) => {
            error.list().lines().for_each(|line| output::note(&format!("error: {line}")));
            return Ok(Exit::Failed);
        }
    };
    let checked = CheckedScene {
        counts: scene.counts(),
        rate_hz: scene.solver.rate_hz,
        substeps: scene.solver.substeps,
        iterations: scene.solver.iterations,
        warnings: sim_solver::warnings(&scene),
        name: scene.name,
    };
    if args.json {
        return output::json(&checked).map(|()| Exit::Done);
    }
    let CheckedScene { name, counts, rate_hz, substeps, iterations, warnings } = checked;
    let bends = if counts.bends > 0 { format!(" {} bends,", counts.bends) } else { String::new() };
    output::line(&format!(
        "{name}: {} particles, {} constraints,{bends} {} pins, {} triangles; {rate_hz} Hz x {substeps} \
         substeps x {iterations} iterations",
        counts.particles, counts.constraints, counts.pins, counts.triangles
    ))?;
    for warning in warnings {
        output::line(&format!("warning: {warning}"))?;
    }
    Ok(Exit::Done)
}
