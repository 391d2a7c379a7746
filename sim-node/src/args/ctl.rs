//! Command line of `ctl`.

use std::time::Duration;

use clap::{Args as ClapArgs, Subcommand};
use sim_contract::{NumberRange, Parameter};

use super::command::CommandVerb;
use super::endpoint::EndpointArgs;
use super::value::{index, number_within, time, time_in, whole};

const TIMEOUT_DEFAULT: Duration = Duration::from_secs(5);

#[derive(Debug, ClapArgs)]
#[command(
    arg_required_else_help = true,
    // Each option may stand before or behind the command.
    mut_args(|arg| arg.global(true)),
    after_help = "A command takes effect at a step boundary; its outcome names the first step that \
        shows it.\nAll calls of `ctl` are one client: what one call grabs, a later call can \
        release.\n\n\
        Exit codes: 0 applied or answered, 1 failed, 2 usage error, 4 rejected.\n\n\
        Examples:\n  \
        sim-node ctl nearest 0.5 0.5 0\n  \
        sim-node ctl particles 90\n  \
        sim-node ctl grab 90 0.5 0.2 0.3\n  \
        sim-node ctl move 90 0.5 0.3 -0.1 --over 0.1\n  \
        sim-node ctl release 90\n  \
        sim-node ctl push 0.5 0.5 0 --radius 0.2 --delta 0 0 -0.01 --limit 0.02\n  \
        sim-node ctl cut-segment --from 0 0.5 0 --to 1 0.5 0\n  \
        sim-node ctl move-collider 0 0 0.1 -0.2\n  \
        sim-node ctl set gravity 0 -1.6 0\n  \
        sim-node ctl watch\n  \
        sim-node ctl forces\n  \
        sim-node ctl set tear_force off\n  \
        sim-node ctl load rope\n  \
        sim-node ctl rewind 2s\n  \
        sim-node ctl pause && sim-node ctl step 10 && sim-node ctl hash"
)]
pub(crate) struct CtlArgs {
    #[command(subcommand)]
    pub(crate) verb: CtlVerb,
    /// Wait at most this long for the node's answer [default: 5s]
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(crate) timeout: Option<Duration>,
    /// Print one JSON object on stdout; `watch` prints one per line
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) endpoint: EndpointArgs,
}

impl CtlArgs {
    /// Longest wait for an answer of the node.
    pub(crate) fn timeout(&self) -> Duration {
        self.timeout.unwrap_or(TIMEOUT_DEFAULT)
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum CtlVerb {
    #[command(flatten)]
    Command(CommandVerb),
    #[command(flatten)]
    Query(QueryVerb),
    /// Print the state of the node once a second, one line each, until Ctrl-C
    ///
    /// When the node ends or is killed, it says so on stderr and waits for the next one.
    #[command(after_help = "Examples:\n  \
        sim-node ctl watch\n  \
        sim-node ctl watch --period 200ms --count 10\n  \
        sim-node ctl watch --json | jq --unbuffered .real_time_factor")]
    Watch(WatchArgs),
}

#[derive(Debug, Subcommand)]
pub(crate) enum QueryVerb {
    /// Print the parameters of the simulation with their values
    #[command(after_help = "Examples:\n  sim-node ctl get\n  sim-node ctl get gravity")]
    Get {
        /// Parameter to print [default: all]
        #[arg(value_parser = parameter)]
        parameter: Option<Parameter>,
    },
    /// Print the state of the node: scene, step, pace, times, losses
    #[command(
        after_help = "Examples:\n  sim-node ctl status\n  sim-node ctl status --energy --json"
    )]
    Status {
        /// Print the energy of the newest state, too: kinetic, potential (-m g.x) and elastic, of the free particles and of the constraints and bends that are not torn
        #[arg(long)]
        energy: bool,
    },
    /// Print the step and the state hash of the newest snapshot
    #[command(after_help = "Example: sim-node ctl hash --json")]
    Hash,
    /// Print the forces of a step on colliders, anchors and fixed particles
    ///
    /// In N, and torques in N m about the center of the collider or anchor: the contacts of particles with a
    /// collider, and the pull of constraints on a pinned, grabbed or anchored particle, without its contact with a
    /// body. The node computes them only while a program reads them, so a paused one has none until its next step.
    #[command(after_help = "Examples:\n  sim-node ctl forces\n  sim-node ctl forces --json")]
    Forces,
    /// Print position, velocity, inverse mass and flags of particles
    #[command(after_help = "Examples:\n  \
        sim-node ctl particles 0 90 167\n  \
        sim-node ctl particles --json    print all particles for a program")]
    Particles {
        /// Indices of the particles [default: all]
        #[arg(value_parser = index)]
        indices: Vec<u32>,
    },
    /// Print the particle nearest to a point
    #[command(
        allow_negative_numbers = true,
        after_help = "Example: sim-node ctl nearest 0.5 -0.2 0"
    )]
    Nearest(NearestArgs),
}

/// Shortest time between two lines: a node publishes its status ten times a second.
const PERIOD_MIN: Duration = Duration::from_millis(100);
const PERIOD_MAX: Duration = Duration::from_hours(1);

/// Times of the lines of `watch`.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub(crate) struct WatchArgs {
    /// Time between two lines, 100ms to 1h
    #[arg(long, value_name = "TIME", default_value = "1s",
        value_parser = time_in(PERIOD_MIN..=PERIOD_MAX))]
    pub(crate) period: Duration,
    /// End after N lines [default: go on until Ctrl-C]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = whole::<u64>(1..=u64::MAX))]
    pub(crate) count: Option<u64>,
}

/// A point that no node judges.
#[derive(Debug, Clone, Copy, ClapArgs)]
pub(crate) struct NearestArgs {
    /// Point in m, relative to the origin of the scene, -1e7 to 1e7
    #[arg(value_parser = number_within(NumberRange::COORDINATE))]
    x: f32,
    /// Point in m, relative to the origin of the scene, -1e7 to 1e7
    #[arg(value_parser = number_within(NumberRange::COORDINATE))]
    y: f32,
    /// Point in m, relative to the origin of the scene, -1e7 to 1e7
    #[arg(value_parser = number_within(NumberRange::COORDINATE))]
    z: f32,
}

impl NearestArgs {
    pub(crate) fn vector(self) -> [f32; 3] {
        [self.x, self.y, self.z]
    }
}

fn parameter(text: &str) -> Result<Parameter, String> {
    let unknown =
        || format!("there is no such parameter (allowed: {})", Parameter::allowed_names(text));
    Parameter::from_name(text).ok_or_else(unknown)
}
