//! `scenes`, `show` and `check`: scenes without a simulation.

use anyhow::Context;
use serde::Serialize;
use sim_solver::builtin;
use sim_solver::scene::SceneCounts;

use crate::args::{CheckArgs, ScenesArgs, ShowArgs};
use crate::scene_source;

/// One built-in scene in the list.
#[derive(Serialize)]
struct Listed {
    name: &'static str,
    particles: usize,
    constraints: usize,
    pins: usize,
    text: &'static str,
}

/// Lists the built-in scenes.
#[allow(clippy::print_stdout, reason = "the result of the command")]
pub(crate) fn scenes(args: &ScenesArgs) -> anyhow::Result<()> {
    let listed = builtin::names().map(|name| {
        let SceneCounts { particles, constraints, pins, .. } = scene_source::load(name)?.counts();
        let text = builtin::summary(name).unwrap_or_default();
        Ok(Listed { name, particles, constraints, pins, text })
    });
    let listed: Vec<Listed> = listed.collect::<anyhow::Result<_>>()?;
    if args.json {
        println!("{}", serde_json::to_string_pretty(&listed)?);
        return Ok(());
    }
    for Listed { name, particles, constraints, pins, text } in listed {
        println!(
            "{name:<10} {particles:>6} particles {constraints:>6} constraints {pins:>4} pins  {text}"
        );
    }
    Ok(())
}

/// Prints the effective scene.
#[allow(clippy::print_stdout, reason = "the result of the command")]
pub(crate) fn show(args: &ShowArgs) -> anyhow::Result<()> {
    print!("{}", scene_source::load(&args.scene)?.to_toml());
    Ok(())
}

/// The result of a check.
#[derive(Serialize)]
struct Checked {
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
    let checked = Checked {
        counts: scene.counts(),
        rate_hz: scene.solver.rate_hz,
        substeps: scene.solver.substeps,
        iterations: scene.solver.iterations,
        warnings: scene.warnings(),
        name: scene.name,
    };
    if args.json {
        let text = serde_json::to_string(&checked).context("writing the result")?;
        println!("{text}");
        return Ok(());
    }
    let Checked { name, counts, rate_hz, substeps, iterations, warnings } = checked;
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
