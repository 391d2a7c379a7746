//! Command lines of the subcommands that handle scenes without running them.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use sim_contract::NumberRange;
use sim_solver::scene::check_pin_expression;

use super::value::{number_in, number_within};

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    sim-node scenes           list the built-in scenes with their rate and size\n  \
    sim-node scenes --json    list them for a program")]
pub(crate) struct ScenesArgs {
    /// Print a JSON array with one object for each scene
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, ClapArgs)]
#[command(after_help = "Example:\n  \
    sim-node show curtain > my.toml    start a scene of your own from a built-in one")]
pub(crate) struct ShowArgs {
    /// Built-in scene, or TOML file
    pub(crate) scene: String,
}

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "An invalid scene exits with 1; each error names the file, line, field and allowed \
    values.\nWarnings do not change the exit code.\n\nExamples:\n  \
    sim-node check my.toml\n  \
    sim-node check --json my.toml"
)]
pub(crate) struct CheckArgs {
    /// TOML file, or built-in scene
    pub(crate) scene: String,
    /// Print one JSON object with the counts and the warnings
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Vertices become particles. Edges become structural constraints and diagonals of faces become\n\
        shear constraints. Bend constraints join the corners on both sides of an edge; with --bending,\n\
        hinges take their place, whose rigidity does not depend on the size of the faces. Faces without\n\
        area, duplicate faces and vertices without a face are left out with a warning.\n\nExamples:\n  \
        sim-node import shirt.obj --pin 'y > 1.45' -o shirt.toml && sim-node run ./shirt.toml\n  \
        sim-node import skirt.obj --scale 0.01 --pin 'y > 0.95' -o skirt.toml\n  \
        sim-node import hat.obj --bending 1e-4 --rest loaded -o hat.toml\n  \
        sim-node import net.obj --density 0.05 --pin 'group rim' --bend 0.01 > net.toml"
)]
pub(crate) struct ImportArgs {
    /// Wavefront OBJ file of triangles, quads or larger faces
    pub(crate) mesh: String,
    /// File to write the scene to [default: stdout]
    #[arg(short, long, value_name = "OUT.toml")]
    pub(crate) output: Option<PathBuf>,
    /// Replace an existing file
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Factor of all coordinates, such as 0.01 for a mesh in centimetres. --pin compares the scaled ones
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true,
        value_parser = number_within(NumberRange { max: 1e7, text: "more than 0, at most 1e7", ..NumberRange::POSITIVE }))]
    pub(crate) scale: f32,
    /// Mass per area, in kg per square unit, > 0
    #[arg(long, value_name = "KG", default_value_t = 0.2, allow_negative_numbers = true,
        value_parser = number_within(NumberRange::POSITIVE))]
    pub(crate) density: f32,
    /// Vertices to pin: 'y > 1.9', 'x < 0 and z >= 1', 'group NAME', or none
    #[arg(long, value_name = "CHOICE", default_value = "none", value_parser = pin_choice)]
    pub(crate) pin: String,
    /// Compliance of structural constraints, in m/N
    #[arg(long, value_name = "M/N", default_value_t = 0.0, allow_negative_numbers = true,
        value_parser = number_in(0.0..=NumberRange::COMPLIANCE.max))]
    pub(crate) structural: f32,
    /// Compliance of shear constraints, in m/N
    #[arg(long, value_name = "M/N", default_value_t = 0.0, allow_negative_numbers = true,
        value_parser = number_in(0.0..=NumberRange::COMPLIANCE.max))]
    pub(crate) shear: f32,
    /// Compliance of bend constraints, in m/N
    #[arg(long, value_name = "M/N", default_value_t = 1e-2, allow_negative_numbers = true,
        value_parser = number_in(0.0..=NumberRange::COMPLIANCE.max))]
    pub(crate) bend: f32,
    /// Bending rigidity of hinges in place of bend constraints, in N m, >= 0: 1e-6 for silk, 1e-4 for denim
    #[arg(long, value_name = "N M", allow_negative_numbers = true, conflicts_with = "bend",
        value_parser = number_within(NumberRange::AT_LEAST_ZERO))]
    pub(crate) bending: Option<f32>,
    /// Shape without bending forces: each edge flat, or folded as in the mesh [default: flat]
    #[arg(long, value_name = "SHAPE", requires = "bending", value_parser = ["flat", "loaded"])]
    pub(crate) rest: Option<String>,
}

/// Parses the choice of pinned vertices.
fn pin_choice(text: &str) -> Result<String, String> {
    check_pin_expression(text).map(|()| text.to_owned())
}
