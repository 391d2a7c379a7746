//! Command lines of `bench`, and of the clients that it starts.

use std::time::Duration;

use clap::{Args as ClapArgs, ValueEnum};
use sim_contract::READERS_MAX;
use sim_solver::scene::RATE_HZ_MAX;

use super::endpoint::EndpointArgs;
use super::run::RealTimeArgs;
use super::value::{time, whole};

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "It runs nodes in a domain of their own, one after another, with clients in other \
    processes. On a busy machine, trust medians and ratios, not maxima. The reference of the contract \
    (sim-node/contract/README.md) describes the fields of --json.\n\n\
    Examples:\n  \
    sim-node bench                                 measure the curtain at its rate\n  \
    sim-node bench --rate 1000 --realtime          measure at 1 kHz with real-time scheduling\n  \
    sim-node bench my.toml --readers 8 --json      measure a file with 8 readers, for a program"
)]
pub(crate) struct BenchArgs {
    /// Built-in scene (see `sim-node scenes`), or TOML file: a path with / or ending in .toml
    #[arg(default_value = "curtain")]
    pub(crate) scene: String,
    /// Steps per second, 1 to 100000 [default: the rate of the scene]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true,
        value_parser = whole::<u32>(1..=u64::from(RATE_HZ_MAX)))]
    pub(crate) rate: Option<u32>,
    /// Time of each measurement, 100ms to 10min; by default there are about 15
    #[arg(long, value_name = "TIME", default_value = "2s", value_parser = measurement_time)]
    pub(crate) duration: Duration,
    /// Numbers of readers to measure with, each 0 to 16
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [0, 1, 4, 8],
        allow_negative_numbers = true, value_parser = whole::<usize>(0..=READERS_MAX as u64))]
    readers: Vec<usize>,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArgs,
    /// Print one JSON object
    #[arg(long)]
    pub(crate) json: bool,
}

impl BenchArgs {
    /// Numbers of readers, each once.
    pub(crate) fn reader_counts(&self) -> Vec<usize> {
        let mut counts = Vec::new();
        for count in &self.readers {
            if !counts.contains(count) {
                counts.push(*count);
            }
        }
        counts
    }
}

#[derive(Debug, ClapArgs)]
pub(crate) struct BenchClientArgs {
    pub(crate) role: ClientRole,
    #[command(flatten)]
    pub(crate) endpoint: EndpointArgs,
}

/// Role of a client process of `bench`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ClientRole {
    /// Reads every snapshot, and waits for each by its event
    Reader,
    /// Reads every snapshot, and polls without a pause
    PollingReader,
    /// Sends a command, waits for its outcome, and repeats that
    Commander,
    /// Takes part in the lockstep
    Member,
}

/// Parses the time of a measurement.
fn measurement_time(text: &str) -> Result<Duration, String> {
    let (min, max) = (Duration::from_millis(100), Duration::from_mins(10));
    let duration = time(text)?;
    if (min..=max).contains(&duration) {
        return Ok(duration);
    }
    Err("it must be a time from 100ms to 10min".to_owned())
}
