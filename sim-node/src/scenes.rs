//! `scenes`, `show` and `check`: scenes without a simulation.

use anyhow::Context;
use serde::Serialize;
use sim_solver::builtin;
use sim_solver::scene::SceneCounts;

use crate::args::{CheckArgs, ScenesArgs, ShowArgs};
use crate::scene_source;
use crate::table::{Align, Table};

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
#[allow(clippy::print_stdout, reason = "the result of the command")]
pub(crate) fn list(args: &ScenesArgs) -> anyhow::Result<()> {
    let rows: Vec<SceneRow> = builtin::names().map(SceneRow::new).collect::<Result<_, _>>()?;
    if args.json {
        println!("{}", serde_json::to_string_pretty(&rows)?);
        return Ok(());
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
    print!("{}", table.text());
    Ok(())
}

/// Prints the effective scene.
#[allow(clippy::print_stdout, reason = "the result of the command")]
pub(crate) fn show(args: &ShowArgs) -> anyhow::Result<()> {
    print!("{}", scene_source::load(&args.scene)?.to_toml());
    Ok(())
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

/// Checks a scene: an error fails, warnings are printed.
#[allow(clippy::print_stdout, reason = "the result of the command")]
pub(crate) fn check(args: &CheckArgs) -> anyhow::Result<()> {
    let scene = scene_source::load(&args.scene)?;
    let checked = CheckedScene {
        counts: scene.counts(),
        rate_hz: scene.solver.rate_hz,
        substeps: scene.solver.substeps,
        iterations: scene.solver.iterations,
        warnings: scene.warnings(),
        name: scene.name,
    };
    if args.json {
        let text = serde_json::to_string(&checked).context("encoding the result")?;
        println!("{text}");
        return Ok(());
    }
    let CheckedScene { name, counts, rate_hz, substeps, iterations, warnings } = checked;
    println!(
        "{name}: {} particles, {} constraints, {} pins, {} triangles; {rate_hz} Hz x {substeps} \
         substeps x {iterations} iterations",
        counts.particles, counts.constraints, counts.pins, counts.triangles
    );
    for warning in warnings {
        println!("warning: {warning}");
    }
    Ok(())
}
