//! Command line of `run`, with the options of real time.

use std::time::Duration;

use bytesize::ByteSize;
use clap::Args as ClapArgs;
use sim_solver::THREADS_MAX;
use sim_solver::scene::{PASSES_MAX, RATE_HZ_MAX};

use super::endpoint::EndpointArgs;
use super::value::{size, time, whole};
use crate::node::{Cpus, RealTimeOptions};

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

/// Priority of `--realtime` without a number: above ordinary threads, and below the threads of the system
/// for interrupts, which have 50.
const PRIORITY_DEFAULT: &str = "20";

#[derive(Debug, Clone, Default, ClapArgs)]
pub(crate) struct RealTimeArgs {
    /// Run with SCHED_FIFO at this priority, 1 to 99, on one CPU, with locked memory. Each of them that
    /// the system refuses is a warning, or with `require` an error: `--realtime=require`,
    /// `--realtime=50,require` [default priority: 20]
    #[arg(long, value_name = "PRIORITY", require_equals = true, num_args = 0..=1,
        default_missing_value = PRIORITY_DEFAULT, value_parser = request)]
    realtime: Option<RealTimeRequest>,
    /// CPU that the loop runs on [default: with --realtime, the last one that this process may use]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = cpu)]
    cpu: Option<usize>,
}

/// Value of `--realtime`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RealTimeRequest {
    priority: u8,
    is_required: bool,
}

impl RealTimeArgs {
    /// Explains why a run that never waits cannot have these options.
    pub(super) fn conflict(&self) -> Option<&'static str> {
        self.realtime.map(|_| {
            "--realtime cannot be used with --as-fast-as-possible: a loop that never waits would keep \
             every ordinary program off its CPU"
        })
    }

    pub(crate) fn options(&self) -> RealTimeOptions {
        RealTimeOptions {
            priority: self.realtime.map(|request| request.priority),
            is_required: self.realtime.is_some_and(|request| request.is_required),
            cpu: self.cpu,
        }
    }
}

/// Parses `PRIORITY`, `require` or `PRIORITY,require`.
fn request(text: &str) -> Result<RealTimeRequest, String> {
    let (priority, is_required) = match text.strip_suffix("require") {
        Some("") => (Some(PRIORITY_DEFAULT), true),
        Some(before) => (before.strip_suffix(','), true),
        None => (Some(text), false),
    };
    let priority = priority.and_then(|text| text.parse().ok());
    let priority = priority.filter(|priority| (1..=99).contains(priority));
    let problem = || "it must be a priority from 1 to 99, 'require', or both as in '50,require'";
    Ok(RealTimeRequest { priority: priority.ok_or_else(problem)?, is_required })
}

/// Parses the number of a CPU that this process may use.
fn cpu(text: &str) -> Result<usize, String> {
    let cpus = Cpus::observe();
    let cpu = text.parse().ok().filter(|cpu| cpus.is_allowed(*cpu));
    cpu.ok_or_else(|| format!("this process may not use it (allowed: {})", cpus.text()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_priority_and_require_are_combined_with_a_comma() {
        let parsed = |priority, is_required| Ok(RealTimeRequest { priority, is_required });
        assert_eq!(request("1"), parsed(1, false));
        assert_eq!(request("99,require"), parsed(99, true));
        assert_eq!(request("require"), parsed(20, true));
        assert_eq!(request(PRIORITY_DEFAULT), parsed(20, false));
        for text in ["", "0", "100", "-3", "require,50", "50require", ",require", "fifo", "50,"] {
            assert!(request(text).unwrap_err().contains("1 to 99, 'require'"), "{text}");
        }
    }
}
