//! `import`: converts a mesh to a scene.

use std::path::Path;

use anyhow::{Context, anyhow};
use sim_host::{Existing, PartFile, read_scene_file};
use sim_solver::scene::SceneProblem;
use sim_solver::{Scene, SceneError, warnings};

use crate::args::ImportArgs;
use crate::output;

/// Writes a scene that contains the mesh, and so does not need its file.
pub(crate) fn import(args: &ImportArgs) -> anyhow::Result<()> {
    let mesh = read_scene_file(&args.mesh)
        .with_context(|| format!("{}: cannot read the mesh", args.mesh))?;
    let text = scene_text(args);
    let scene = Scene::from_toml_with_files(&text, &args.mesh, &|_| Ok(mesh.clone()))
        .map_err(import_error)?;
    let counts = scene.counts();
    for warning in warnings(&scene) {
        // The user knows the only generator by the options.
        let warning = warning.replace("generate[0].pinned", "--pin");
        let warning = warning.replace("generate[0].bending", "--bending");
        let warning = warning.replace("generate[0]: ", "");
        let warning = warning.replace(
            "give a mesh in another unit a `scale`",
            "give a mesh in another unit --scale",
        );
        output::note(&format!("warning: {warning}"));
    }
    let result = format!(
        "# Converted from {} by sim-node import.\n{}",
        file_name(&args.mesh),
        scene.to_toml()
    );
    let Some(path) = &args.output else {
        return output::file(&result);
    };
    let existing = if args.overwrite { Existing::Overwrite } else { Existing::Refuse };
    PartFile::write_whole(path, existing, result.as_bytes())?;
    output::note(&format!(
        "{}: {} particles, {} constraints, {} pins, {} triangles",
        path.display(),
        counts.particles,
        counts.constraints,
        counts.pins,
        counts.triangles
    ));
    Ok(())
}

/// TOML of a scene with one generator, which reads the mesh.
fn scene_text(args: &ImportArgs) -> String {
    let ImportArgs { scale, density, structural, shear, bend, .. } = args;
    let (of_bends, bending) = match args.bending {
        Some(bending) => {
            let rest = quoted_text(args.rest.as_deref().unwrap_or("flat"));
            (String::new(), format!("bending = {bending}\nrest = {rest}\n"))
        }
        None => (format!(", bend = {bend}"), String::new()),
    };
    format!(
        "version = 1\nname = {name}\n[solver]\nsubsteps = 8\n[[generate]]\nshape = \"obj\"\n\
         path = {path}\nscale = {scale}\ndensity = {density}\npinned = {pin}\n\
         compliance = {{ structural = {structural}, shear = {shear}{of_bends} }}\n{bending}",
        name =
            quoted_text(&Path::new(&args.mesh).file_stem().unwrap_or_default().to_string_lossy()),
        path = quoted_text(&args.mesh),
        pin = quoted_text(&args.pin),
    )
}

/// Names the option that is wrong, or the mesh.
fn import_error(error: SceneError) -> anyhow::Error {
    let SceneProblem { field, problem, .. } = error.first();
    match field.rsplit('.').next() {
        Some("path") => anyhow!("{problem}"),
        Some("pinned") => anyhow!("--pin: {problem}"),
        Some(
            key @ ("scale" | "density" | "structural" | "shear" | "bend" | "bending" | "rest"),
        ) => {
            anyhow!("--{key}: {problem}")
        }
        _ => error.into(),
    }
}

/// Basic string of TOML, which has the escapes of JSON.
fn quoted_text(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

fn file_name(path: &str) -> String {
    Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use sim_solver::RestShape;
    use sim_solver::scene::MeshBending;

    use super::*;
    use crate::args::{Args, Verb};

    /// Returns the scene of an import, given the text of the mesh.
    fn scene(mesh: &str, options: &[&str]) -> Result<Scene, SceneError> {
        let arguments = ["sim-node", "import", "a.obj"].iter().chain(options);
        let Some(Verb::Import(args)) = Args::try_parse_from(arguments).unwrap().verb else {
            panic!("not an import");
        };
        let read = |_: &str| Ok(mesh.to_owned());
        Scene::from_toml_with_files(&scene_text(&args), "a.obj", &read)
    }

    fn error(mesh: &str, options: &[&str]) -> String {
        import_error(scene(mesh, options).unwrap_err()).to_string()
    }

    /// Two triangles with a fold along their common edge.
    const FOLD: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0.5\nf 1 2 3\nf 4 3 2\n";

    #[test]
    fn a_bending_rigidity_makes_hinges_in_place_of_bend_constraints() {
        let bending = |options| {
            let scene = scene(FOLD, options).unwrap();
            let sim_solver::scene::Shape::Obj(obj) = &scene.generators[0].shape else {
                panic!("not a mesh");
            };
            (scene.counts().constraints, obj.bending)
        };
        let with = |rest| Some(MeshBending { bending: 1e-4, rest });
        assert_eq!(bending(&[]), (6, None));
        assert_eq!(bending(&["--bending", "1e-4"]), (5, with(RestShape::Flat)));
        let loaded = ["--bending", "1e-4", "--rest", "loaded"];
        assert_eq!(bending(&loaded), (5, with(RestShape::Loaded)));
    }

    #[test]
    fn options_of_bending_that_contradict_each_other_are_refused() {
        let refused = |options: &[&str]| {
            let arguments = ["sim-node", "import", "a.obj"].iter().chain(options);
            Args::try_parse_from(arguments).unwrap_err().to_string()
        };
        assert!(refused(&["--bending", "-1"]).contains("(allowed: a number >= 0)"));
        let both = refused(&["--bending", "1e-4", "--bend", "0.1"]);
        assert!(both.contains("'--bending <N M>' cannot be used with '--bend <M/N>'"), "{both}");
        let rest = refused(&["--rest", "loaded"]);
        assert!(rest.contains("--bending <N M>"), "{rest}");
        let word = refused(&["--bending", "1", "--rest", "bent"]);
        assert!(word.contains("[possible values: flat, loaded]"), "{word}");
    }

    #[test]
    fn a_scale_applies_to_the_mesh_and_to_its_pins() {
        let mesh = "v 0 0 0\nv 100 0 0\nv 0 145 0\nf 1 2 3\n";
        let scaled = scene(mesh, &["--scale", "0.01", "--pin", "y > 1.4"]).unwrap();
        assert_eq!(scaled.counts().pins, 1);
        assert_eq!(warnings(&scaled), Vec::<String>::new());
        let warnings = warnings(&scene(mesh, &["--pin", "y > 150"]).unwrap()).join("\n");
        assert!(
            warnings.contains("give a mesh in another unit a `scale`, such as 0.01 "),
            "{warnings}"
        );
        assert!(
            warnings
                .contains("matches no particle of the shape (x 0 to 100, y 0 to 145, z 0 to 0)"),
            "{warnings}"
        );
        let far = error(mesh, &["--scale", "1e6"]);
        assert_eq!(far, "--scale: a vertex is at 100000000 (allowed: -1e7 to 1e7)");
    }

    #[test]
    fn an_error_names_the_mesh_once_or_the_option() {
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert_eq!(
            error("v 0 0 0\nf 1 1\n", &[]),
            "a.obj: line 2: a face has 2 corners (allowed: 3 or more)"
        );
        let expected = "--pin: the mesh has no group 'rim' (it has no groups)";
        assert_eq!(error(triangle, &["--pin", "group rim"]), expected);
    }
}
