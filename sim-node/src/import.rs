//! `import`: converts a mesh to a scene.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, anyhow};
use sim_solver::Scene;

use crate::args::ImportArgs;
use crate::scene_source;

/// Writes a scene that contains the mesh, and so does not need its file.
#[allow(clippy::print_stdout, reason = "the result of the command")]
#[allow(clippy::print_stderr, reason = "messages to the user")]
pub(crate) fn import(args: &ImportArgs) -> anyhow::Result<()> {
    let mesh = scene_source::read(&args.mesh)
        .with_context(|| format!("{}: cannot read the mesh", args.mesh))?;
    let text = scene_text(args);
    let scene = Scene::from_toml_with_files(&text, &args.mesh, &|_| Ok(mesh.clone()))
        .map_err(|error| anyhow!("{}: {}", args.mesh, error.problem))?;
    let counts = scene.counts();
    for warning in scene.warnings() {
        eprintln!("warning: {warning}");
    }
    let result = format!(
        "# Converted from {} by sim-node import.\n{}",
        file_name(&args.mesh),
        scene.to_toml()
    );
    let Some(path) = &args.output else {
        print!("{result}");
        return Ok(());
    };
    write(path, &result, args)?;
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

/// TOML of a scene with one generator, which reads the mesh.
fn scene_text(args: &ImportArgs) -> String {
    let ImportArgs { density, structural, shear, bend, .. } = args;
    format!(
        "version = 1\nname = {name}\n[solver]\nsubsteps = 8\n[[generate]]\nshape = \"obj\"\n\
         path = {path}\ndensity = {density}\npinned = {pin}\n\
         compliance = {{ structural = {structural}, shear = {shear}, bend = {bend} }}\n",
        name =
            quoted_text(&Path::new(&args.mesh).file_stem().unwrap_or_default().to_string_lossy()),
        path = quoted_text(&args.mesh),
        pin = quoted_text(&args.pin),
    )
}

/// Basic string of TOML, which has the escapes of JSON.
fn quoted_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Writes the scene. An existing file is replaced only if [`ImportArgs::overwrite`] is set.
fn write(path: &Path, text: &str, args: &ImportArgs) -> anyhow::Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).truncate(true);
    let options = if args.overwrite { options.create(true) } else { options.create_new(true) };
    let mut file = options.open(path).map_err(|error| match error.kind() {
        ErrorKind::AlreadyExists => {
            anyhow!("{}: the file exists (--overwrite replaces it)", path.display())
        }
        _ => anyhow!("{}: cannot create the file: {error}", path.display()),
    })?;
    file.write_all(text.as_bytes())
        .with_context(|| format!("{}: cannot write the scene", path.display()))
}
