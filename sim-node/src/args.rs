//! The command line. Help texts are the doc comments here.

use std::time::Duration;

use clap::{Args as ClapArgs, Parser, Subcommand};
use sim_contract::{Endpoint, EndpointError, NAME_DEFAULT};

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
        sim-node scenes                             list the built-in scenes"
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) verb: Option<Verb>,
    #[command(flatten)]
    pub(crate) run: RunArgs,
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
    /// Command a running node, or ask it how it does.
    Ctl(CtlArgs),
}

/// Which node.
#[derive(Debug, ClapArgs)]
pub(crate) struct EndpointArgs {
    /// Name of the node: its services are NAME/particles, NAME/commands, ...
    #[arg(long, default_value = NAME_DEFAULT, value_name = "NAME", value_parser = name)]
    pub(crate) name: String,
    /// Domain that keeps services apart from others on this host [default: that of iceoryx2]
    #[arg(long, env = "CATENARY_DOMAIN", value_name = "DOMAIN", value_parser = domain)]
    pub(crate) domain: Option<String>,
}

fn name(text: &str) -> Result<String, EndpointError> {
    Endpoint::new(None, text).map(|_| text.to_owned())
}

fn domain(text: &str) -> Result<String, EndpointError> {
    endpoint(Some(text), NAME_DEFAULT).map(|_| text.to_owned())
}

/// The node of that name; an empty domain is the default one.
pub(crate) fn endpoint(domain: Option<&str>, name: &str) -> Result<Endpoint, EndpointError> {
    Endpoint::new(domain.filter(|domain| !domain.is_empty()), name)
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
pub(crate) struct CheckArgs {
    /// A TOML file or a built-in scene
    pub(crate) scene: String,
    /// Print one object with the counts and the warnings
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, ClapArgs)]
#[command(
    arg_required_else_help = true,
    after_help = "A command takes effect at a step boundary, and its outcome names the first step \
        that shows it. All calls of `ctl` act as one client: what one grabs, a later one releases.\n\n\
        Examples:\n  \
        sim-node ctl grab 90 0.5 0.2 0.3\n  \
        sim-node ctl move 90 0.5 0.3 -0.1 --over 0.1\n  \
        sim-node ctl release 90\n  \
        sim-node ctl pause && sim-node ctl step 10 && sim-node ctl hash"
)]
pub(crate) struct CtlArgs {
    #[command(subcommand)]
    pub(crate) verb: CtlVerb,
    /// Wait this long for the node's answer
    #[arg(long, global = true, value_name = "TIME", default_value = "5s",
        value_parser = humantime::parse_duration)]
    pub(crate) timeout: Duration,
    /// Print one JSON object on stdout
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Name of the node
    #[arg(long, global = true, default_value = NAME_DEFAULT, value_name = "NAME",
        value_parser = name)]
    pub(crate) name: String,
    /// Domain of the node [default: that of iceoryx2]
    #[arg(long, global = true, env = "CATENARY_DOMAIN", value_name = "DOMAIN",
        value_parser = domain)]
    pub(crate) domain: Option<String>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum CtlVerb {
    /// Hold a particle where it stands.
    Pin {
        /// Index of the particle.
        particle: u32,
    },
    /// Free a pinned particle, from rest.
    Unpin {
        /// Index of the particle.
        particle: u32,
    },
    /// Drive a particle to a target.
    Grab(TargetArgs),
    /// Give a grabbed particle a new target.
    Move(TargetArgs),
    /// Let a grabbed particle go, with the velocity of its last motion.
    Release {
        /// Index of the particle.
        particle: u32,
    },
    /// Stop the node at its next step boundary.
    Pause,
    /// Let a paused node go on.
    Resume,
    /// Let a paused node make COUNT steps, and wait until they are made.
    Step {
        /// Steps to make, at least 1.
        #[arg(default_value_t = 1)]
        count: u32,
    },
    /// Make the next state the initial one; the step number goes on.
    Reset,
    /// Print how the node does.
    Status,
    /// Print the step and the state hash of the newest snapshot.
    Hash,
}

#[derive(Debug, ClapArgs)]
#[command(allow_negative_numbers = true)]
pub(crate) struct TargetArgs {
    /// Index of the particle.
    pub(crate) particle: u32,
    /// Target in m, relative to the scene's origin.
    pub(crate) x: f32,
    /// Target in m, relative to the scene's origin.
    pub(crate) y: f32,
    /// Target in m, relative to the scene's origin.
    pub(crate) z: f32,
    /// Seconds to get there, 0 to 0.25, rounded up to whole steps [default: 1/60]
    #[arg(long, value_name = "SECONDS", default_value_t = sim_contract::GRAB_OVER_S_DEFAULT,
        hide_default_value = true)]
    pub(crate) over: f32,
}
