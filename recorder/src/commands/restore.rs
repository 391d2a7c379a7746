//! `recorder restore`: puts a recorded state in place in a running node.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, bail};
use recording::{FindStateError, LogEnd, LogReader, Wanted, find_state, state_at_place};
use serde::Serialize;
use sim_contract::{Action, Client, GivenState, Outcome, scene_hash};
use sim_host::{Stop, report_bus_errors};

use crate::cli::args::{EndpointArgs, ThreadArgs};
use crate::cli::damaged_input::{lacks, lacks_state};
use crate::cli::output::{self, AsJson, Exit, path_text};
use crate::cli::parse::{self, whole_number};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "The node must run the scene of the recording, with the same rate and substeps: \
    `recorder scene FILE` prints it. A state without a keyframe of its own is simulated from the last keyframe \
    before it. The step number of the node continues; a paused node stays paused.\n\nExamples:\n  \
    recorder restore run.mcap\n  \
    recorder restore run.mcap --step 480\n  \
    recorder restore run.mcap --time 2s\n  \
    recorder state -o state.mcap && recorder restore state.mcap"
)]
pub(crate) struct RestoreArgs {
    /// Recording with the state
    file: PathBuf,
    /// Step of the state [default: the last recorded step]
    #[arg(long, value_name = "N", allow_hyphen_values = true, conflicts_with = "time",
        value_parser = whole_number)]
    step: Option<u64>,
    /// Simulated time of the state since step 0, such as 2s or 500ms: the last recorded step up to it
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = parse::duration)]
    time: Option<Duration>,
    /// Longest wait for the answer of the node
    #[arg(long, value_name = "TIME", default_value = "5s", allow_hyphen_values = true,
        value_parser = parse::duration)]
    timeout: Duration,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    endpoint: EndpointArgs,
    #[command(flatten)]
    as_json: AsJson,
}

/// The result, as printed.
#[derive(Debug, Serialize)]
struct RestoreReport {
    /// Step of the recording.
    recorded_step: u64,
    /// Step of the node that has its state.
    step: u64,
    state_hash: String,
}

impl fmt::Display for RestoreReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { recorded_step, step, state_hash } = self;
        write!(
            f,
            "restored at step {step}: the state of step {recorded_step}, state hash {state_hash}"
        )
    }
}

pub(crate) fn run(args: &RestoreArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    report_bus_errors()?;
    let endpoint = args.endpoint.endpoint()?;
    let mut client = Client::attach(&endpoint)?;
    let path = path_text(&args.file);
    let log = LogReader::open_until(&args.file, &stop).with_context(|| path.clone())?;
    check_scene(&mut client, args.timeout, &log).with_context(|| path.clone())?;
    let wanted = match (args.step, args.time) {
        (Some(step), _) => Wanted::Step(step),
        (None, Some(time)) => Wanted::UpTo(step_at(time, log.run().rate_hz)),
        (None, None) => Wanted::Last,
    };
    let rate_hz = log.run().rate_hz;
    let place = find_state(log, wanted).map_err(|error| match args.time {
        Some(time) => lacks_state_at(&args.file, time, rate_hz, error),
        None => lacks_state(&args.file, error),
    });
    let place = place.with_context(|| path.clone())?;
    let log = LogReader::open_until(&args.file, &stop).with_context(|| path.clone())?;
    let state = state_at_place(log, &place, args.threads.count(), &stop).context(path)?;
    let given = GivenState {
        scene_hash: state.scene_hash,
        particles: &state.particles,
        keyframe: Some(&state.keyframe),
    };
    let outcome = client.restore(&given, args.timeout)?;
    let report = check_outcome(&outcome, place.step, state.state_hash)?;
    output::result(args.as_json, &report, &report.to_string())?;
    if let Some(end) = place.end.filter(|end| *end != LogEnd::Complete) {
        let done = format!("restored step {}, the last one of its readable part", place.step);
        output::warn_of_losses(&args.file, &end, &done, &stop);
    }
    Ok(Exit::Done)
}

/// Compares the scenes of the node and the recording.
fn check_scene<R: std::io::Read>(
    client: &mut Client,
    timeout: Duration,
    log: &LogReader<R>,
) -> anyhow::Result<()> {
    if log.scene().is_empty() {
        bail!("has no scene (attachment scene.toml)");
    }
    let topology = client.topology(timeout)?;
    let topology = topology.context("the node published no scene; is it stopped?")?;
    let (recorded, running) = (scene_hash(log.scene()), topology.header.scene_hash);
    if recorded != running {
        bail!(
            "its scene '{}' has the hash {recorded:016x}, but the node runs a scene with the hash \
             {running:016x}: start the node with the scene that `recorder scene` prints",
            log.run().scene_name
        );
    }
    Ok(())
}

/// Last step up to a time.
fn step_at(time: Duration, rate_hz: u32) -> u64 {
    let steps = time.as_nanos() * u128::from(rate_hz) / 1_000_000_000;
    u64::try_from(steps).unwrap_or(u64::MAX)
}

/// Returns the error of a recording without a complete state up to a time. It names the times that the recording has.
fn lacks_state_at(
    path: &Path,
    time: Duration,
    rate_hz: u32,
    error: FindStateError,
) -> anyhow::Error {
    match error {
        FindStateError::Missing { end, steps: Some(steps), .. } => {
            lacks(path, &no_state_at(time, rate_hz, &steps), end.as_ref())
        }
        error => lacks_state(path, error),
    }
}

fn no_state_at(time: Duration, rate_hz: u32, steps: &RangeInclusive<u64>) -> String {
    let (first, last) = (*steps.start(), *steps.end());
    // Rounded inwards, so that both times are accepted.
    let thousandths = |step: u64| step as f64 * 1000.0 / f64::from(rate_hz);
    let from = thousandths(first).ceil() / 1000.0;
    // A later time than that of the last state is accepted, too.
    let to = (thousandths(last).floor() / 1000.0).max(from);
    format!(
        "has no complete state up to {} (step {}; times count from step 0 of the run): its states are those from \
         {from}s (step {first}) to {to}s (step {last})",
        humantime::format_duration(time),
        step_at(time, rate_hz)
    )
}

fn check_outcome(
    outcome: &Outcome,
    recorded_step: u64,
    expected: u64,
) -> anyhow::Result<RestoreReport> {
    let step = outcome.step;
    if let Some(reason) = outcome.reason() {
        bail!("the node refused the state at step {step}: {reason} (see its messages)");
    }
    let Action::Restore { state_hash, .. } = outcome.command.action() else {
        bail!("the node answered with an outcome of another command");
    };
    if !outcome.is_applied() || state_hash != expected {
        bail!(
            "the node has the state hash {state_hash:016x} at step {step}, but the recording has \
             {expected:016x}"
        );
    }
    Ok(RestoreReport { recorded_step, step, state_hash: format!("{state_hash:016x}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_before_the_recording_is_named_with_the_times_that_it_has() {
        let text = no_state_at(Duration::from_secs(2), 240, &(1201..=2352));
        assert_eq!(
            text,
            "has no complete state up to 2s (step 480; times count from step 0 of the run): its states are those \
             from 5.005s (step 1201) to 9.8s (step 2352)"
        );
        assert!(step_at(Duration::from_millis(5005), 240) >= 1201);
        let of_one = no_state_at(Duration::from_secs(2), 240, &(1201..=1201));
        assert!(of_one.ends_with("from 5.005s (step 1201) to 5.005s (step 1201)"), "{of_one}");
    }
}
