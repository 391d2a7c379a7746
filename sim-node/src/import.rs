//! `import`: a scene of a mesh.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

use anyhow::Context;
use sim_solver::Scene;

use crate::args::ImportArgs;

/// Writes a scene with one mesh, which then needs the mesh file no more.
#[allow(clippy::print_stdout, reason = "the result of the command")]
#[allow(clippy::print_stderr, reason = "messages to the user")]
pub(crate) fn import(args: &ImportArgs) -> anyhow::Result<()> {
    let mesh = sim_contract::read_scene_file(&args.mesh)
        .with_context(|| format!("{}: cannot read the mesh", args.mesh))?;
    let text = wish(args);
    let scene = Scene::from_toml_with_files(&text, &args.mesh, &|_| Ok(mesh.clone()))
        .map_err(|error| anyhow::anyhow!("{}: {}", args.mesh, error.problem))?;
    let counts = scene.counts();
    for warning in scene.warnings() {
        eprintln!("warning: {warning}");
    }
    let result =
        format!("# Made of {} by sim-node import.\n{}", file_name(&args.mesh), scene.to_toml());
    let Some(path) = &args.output else {
        print!("{result}");
        return Ok(());
    };
    write(path, &result, args.overwrite)
        .with_context(|| format!("{}: cannot write the scene", path.display()))?;
    eprintln!(
        "{}: {} particles, {} constraints, {} pins, {} triangles",
        path.display(),
        counts.particles,
        counts.constraints,
        counts.pins,
        counts.triangles
    );
    Ok(())
}

/// The scene as a person would have written it.
fn wish(args: &ImportArgs) -> String {
    let ImportArgs { density, structural, shear, bend, .. } = args;
    // Text in quotes, as TOML wants it; numbers as they are.
    let quoted = |text: &str| toml_text(text);
    format!(
        "version = 1\nname = {name}\n[solver]\nsubsteps = 8\n[[generate]]\nshape = \"obj\"\n\
         path = {path}\ndensity = {density}\npinned = {pin}\n\
         compliance = {{ structural = {structural}, shear = {shear}, bend = {bend} }}\n",
        name = quoted(&Path::new(&args.mesh).file_stem().unwrap_or_default().to_string_lossy()),
        path = quoted(&args.mesh),
        pin = quoted(&args.pin),
    )
}

/// A basic string of TOML. What JSON escapes, it escapes alike.
fn toml_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn write(path: &Path, text: &str, overwrites: bool) -> std::io::Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).truncate(true);
    let options = if overwrites { options.create(true) } else { options.create_new(true) };
    options.open(path)?.write_all(text.as_bytes())
}
