//! The command line. Help texts are the doc comments here.

mod ctl;
mod lesson;

use std::ffi::OsString;
use std::time::Duration;

use clap::error::ErrorKind;
use clap::{Args as ClapArgs, CommandFactory, Parser, Subcommand};
use sim_contract::{Endpoint, NAME_DEFAULT};
use sim_solver::THREADS_MAX;

pub(crate) use ctl::{CtlArgs, CtlVerb, PoseArgs, TargetArgs};
pub(crate) use lesson::LessonArgs;

/// Simulate particles and constraints at a fixed rate, for any process on this host.
///
/// Every state is published in shared memory, where other processes read it without a copy, and
/// commands (drag, pin, pause, ...) are taken from any of them. Without arguments, the built-in
/// scene `curtain` runs until Ctrl-C.
#[derive(Debug, Parser)]
#[command(
    name = "sim-node",
    version,
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  \
        sim-node                                    run the curtain\n  \
        sim-node run rope --rate 1000               run the rope at 1 kHz\n  \
        sim-node run my.toml --duration 10s --json  run a file for 10 s, then print a summary\n  \
        sim-node ctl grab 90 0.5 0.2 0.3            drag particle 90 of the running node\n  \
        sim-node ctl set gravity 0 -1.6 0           take the running node to the moon\n  \
        sim-node scenes                             list the built-in scenes\n  \
        sim-node import shirt.obj -o shirt.toml     make a scene of a mesh\n  \
        sim-node lesson                             list the lessons of physics"
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) verb: Option<Verb>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

/// Reads the command line. Ends the program with code 2 and the usage if it is wrong.
pub(crate) fn parse() -> Args {
    let args = Args::parse_from(std::env::args_os().map(plain_negative));
    // What depends on several arguments is beyond clap.
    if let Some(Verb::Ctl(ctl)) = &args.verb
        && let CtlVerb::Set(set) = &ctl.verb
        && let Err(text) = set.value()
    {
        let mut command = Args::command();
        command.build();
        let ctl = command.find_subcommand_mut("ctl");
        let set = ctl.and_then(|ctl| ctl.find_subcommand_mut("set")).cloned();
        set.unwrap_or(command).error(ErrorKind::WrongNumberOfValues, text).exit();
    }
    args
}

/// A negative number as clap knows one: `-.5` and `-1e-3` look like options to it.
fn plain_negative(word: OsString) -> OsString {
    let text = word.to_str().filter(|text| text.starts_with('-'));
    match text.and_then(|text| text.parse::<f64>().ok()) {
        // Without an exponent, and with the fewest digits that read back as the same number.
        Some(number) if number.is_finite() => number.to_string().into(),
        _ => word,
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Verb {
    /// Run a scene until Ctrl-C, or as long as told.
    Run(RunArgs),
    /// List the built-in scenes.
    Scenes(ScenesArgs),
    /// Print a scene as complete TOML, every default written out.
    Show(ShowArgs),
    /// Check a scene without running it; warn of what is probably not meant.
    Check(CheckArgs),
    /// Make a scene of a mesh: an OBJ file becomes a cloth.
    Import(ImportArgs),
    /// Command a running node, or ask it how it does.
    Ctl(CtlArgs),
    /// Print tables for teachers of physics: what Euler, passes, stiffness and 32 bits do.
    Lesson(LessonArgs),
}

/// Which node.
#[derive(Debug, ClapArgs)]
pub(crate) struct EndpointArgs {
    /// Name of the node: its services are NAME/particles, NAME/commands, ...
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", value_parser = Endpoint::parse_name)]
    pub(crate) name: String,
    /// Domain that keeps services apart from others on this host [default: that of iceoryx2]
    #[arg(long, env = "CATENARY_DOMAIN", value_name = "DOMAIN", value_parser = Endpoint::parse_domain)]
    pub(crate) domain: Option<String>,
}

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    sim-node run curtain --rate 1000 --duration 10s --json\n  \
    sim-node run ./my.toml --steps 5000 --as-fast-as-possible")]
pub(crate) struct RunArgs {
    /// A built-in scene (see `sim-node scenes`), or a TOML file: a path with / or ending in .toml
    #[arg(default_value = "curtain")]
    pub(crate) scene: String,
    /// Steps per second, 1 to 100000 [default: that of the scene]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub(crate) rate: Option<u32>,
    /// Substeps of a step, 1 to 1000 [default: that of the scene]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) substeps: Option<u32>,
    /// End after this many steps [default: run until Ctrl-C]
    #[arg(long, value_name = "N", conflicts_with = "duration")]
    pub(crate) steps: Option<u64>,
    /// End after this much simulated time, such as 10s or 2min [default: run until Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration)]
    pub(crate) duration: Option<Duration>,
    /// Start paused: wait at step 0 for `ctl resume` or `ctl step`
    #[arg(long)]
    pub(crate) paused: bool,
    /// Make steps without waiting for their time
    #[arg(long)]
    pub(crate) as_fast_as_possible: bool,
    /// Threads that step the solver, 1 to 64; they change no bit [default: 1 for scenes of fewer than
    /// 4000 particles, else the cores that this process may use, less one]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = clap::value_parser!(u8).range(1..=i64::from(THREADS_MAX)))]
    pub(crate) threads: Option<u8>,
    /// Publish every K-th snapshot only, and the last one before a wait
    #[arg(long, value_name = "K", default_value_t = 1,
        value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    pub(crate) every: u64,
    /// Print a summary as one JSON object on stdout at the end
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) endpoint: EndpointArgs,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct ScenesArgs {
    /// Print an array of objects with name, particles, constraints, pins and text
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct ShowArgs {
    /// A built-in scene or a TOML file
    pub(crate) scene: String,
}

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "Vertices become particles, edges structural constraints, diagonals of faces shear, and the\n\
        corners on both sides of an edge bend. Faces without area, faces that stand twice and\n\
        vertices of no face are named and left out.\n\nExamples:\n  \
        sim-node import shirt.obj --pin 'y > 1.45' -o shirt.toml && sim-node run ./shirt.toml\n  \
        sim-node import net.obj --density 0.05 --pin 'group rim' --bend 0.01 > net.toml"
)]
pub(crate) struct ImportArgs {
    /// A Wavefront OBJ file of triangles, quads or bigger faces
    pub(crate) mesh: String,
    /// File to write the scene to [default: stdout]
    #[arg(short, long, value_name = "OUT.toml")]
    pub(crate) output: Option<std::path::PathBuf>,
    /// Write over an existing file
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Mass per area, in kg per square unit
    #[arg(long, value_name = "KG", default_value_t = 0.2)]
    pub(crate) density: f32,
    /// Vertices that are pinned: 'y > 1.9', 'x < 0 and z >= 1', 'group NAME', or none
    #[arg(long, value_name = "CHOICE", default_value = "none")]
    pub(crate) pin: String,
    /// Compliance of edges, in m/N
    #[arg(long, value_name = "M/N", default_value_t = 0.0)]
    pub(crate) structural: f32,
    /// Compliance of diagonals, in m/N
    #[arg(long, value_name = "M/N", default_value_t = 0.0)]
    pub(crate) shear: f32,
    /// Compliance of bends, in m/N
    #[arg(long, value_name = "M/N", default_value_t = 1e-2)]
    pub(crate) bend: f32,
}

#[derive(Debug, ClapArgs)]
pub(crate) struct CheckArgs {
    /// A TOML file or a built-in scene
    pub(crate) scene: String,
    /// Print one object with the counts and the warnings
    #[arg(long)]
    pub(crate) json: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn negative_numbers_are_written_as_clap_knows_them() {
        for (word, plain) in [
            ("-.5", "-0.5"),
            ("-1e-3", "-0.001"),
            ("-2.5E2", "-250"),
            ("-3", "-3"),
            ("--delta", "--delta"),
            ("-o", "-o"),
            ("-inf", "-inf"),
            ("1e-3", "1e-3"),
        ] {
            assert_eq!(plain_negative(word.into()), plain, "{word}");
        }
    }
}
