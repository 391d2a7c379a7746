//! Command line of `run`.

use std::time::Duration;

use bytesize::ByteSize;
use clap::Args as ClapArgs;
use sim_solver::THREADS_MAX;
use sim_solver::scene::{PASSES_MAX, RATE_HZ_MAX};

use super::endpoint::EndpointArgs;
use super::real_time::RealTimeArgs;
use super::value::{size, time, whole};

#[derive(Debug, ClapArgs)]
#[command(after_help = "Examples:\n  \
    sim-node run                                              run the drape in real time\n  \
    sim-node run curtain --rate 1000 --duration 10s --json    run 10 s at 1 kHz, then print a summary\n  \
    sim-node run ./my.toml --steps 5000 --as-fast-as-possible run a file without waiting\n  \
    sim-node run rope --name left --domain lab                run beside other nodes\n  \
    sim-node run --rate 1000 --realtime --cpu 3               run 1 kHz with little jitter")]
pub(crate) struct RunArgs {
    /// Built-in scene (see `sim-node scenes`), or TOML file: a path with / or ending in .toml
    #[arg(default_value = "drape")]
    pub(crate) scene: String,
    /// Steps per second, 1 to 100000 [default: the rate of the scene]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true,
        value_parser = whole::<u32>(1..=u64::from(RATE_HZ_MAX)))]
    pub(crate) rate: Option<u32>,
    /// Substeps per step, 1 to 1000 [default: the substeps of the scene]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = whole::<u32>(1..=u64::from(PASSES_MAX)))]
    pub(crate) substeps: Option<u32>,
    /// Exit after N steps [default: run until Ctrl-C]
    #[arg(long, value_name = "N", allow_negative_numbers = true, conflicts_with = "duration",
        value_parser = whole::<u64>(0..=u64::MAX))]
    pub(crate) steps: Option<u64>,
    /// Exit after this much simulated time, such as 10s or 2min [default: run until Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(crate) duration: Option<Duration>,
    /// Start paused: wait at step 0 for `ctl resume` or `ctl step`
    #[arg(long)]
    pub(crate) paused: bool,
    /// Start each step as soon as the previous one is done, without waiting for its time
    #[arg(long)]
    pub(crate) as_fast_as_possible: bool,
    /// Threads of the solver, 1 to 64; they change no bit of the result [default: 1 for scenes with
    /// fewer than 4000 particles, else one less than the number of cores available to this process]
    #[arg(long, value_name = "N", allow_negative_numbers = true,
        value_parser = whole::<u8>(1..=u64::from(THREADS_MAX)))]
    pub(crate) threads: Option<u8>,
    /// Publish only every K-th snapshot, and the last one before a pause
    #[arg(long, value_name = "K", allow_negative_numbers = true, default_value_t = 1,
        value_parser = whole::<u64>(1..=1_000_000))]
    pub(crate) every: u64,
    /// Longest wait for a member of the lockstep; then the run continues without it
    #[arg(long, value_name = "TIME", default_value = "2s", value_parser = time)]
    pub(crate) lockstep_timeout: Duration,
    /// Memory for past states, which `ctl rewind` returns to; 0 for none. Old states are kept at growing
    /// distances
    #[arg(long, value_name = "SIZE", default_value = "64MiB", value_parser = size)]
    pub(crate) history: ByteSize,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArgs,
    /// Print a summary as one JSON object on stdout at the end
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) endpoint: EndpointArgs,
}
