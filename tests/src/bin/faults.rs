//! `cargo faults`: performs random actions on the programs, most of them faults, and checks that nothing
//! is damaged, lost or left behind. A seed repeats its schedule.
#![forbid(unsafe_code)]
#![allow(clippy::print_stderr, reason = "messages to the user")]

use anyhow::{Context, bail};
use integration_tests::faults;
use integration_tests::storm::{self, Counts, Storm, Summary};
use sim_host::Stop;

/// The text of `--help`.
const HELP: &str = "Perform random actions on a node, recorders, a viewer and clients: start, kill, stop, flood, clean.
Check after each that no recording is damaged, no loss is undeclared, and no program hangs or panics.

Usage: cargo faults [--seed N] [--actions K] [--verbose]
       cargo faults --storm K [--scene NAME] [--rate HZ]

--seed N     schedule to perform [default: a random one]
--actions K  number of actions [default: 300]
--verbose    print each action
--storm K    let four clients send K random commands each, bad ones, rewinds and states included, record
             it, and verify the recording
--scene NAME built-in scene of the storm [default: curtain]
--rate HZ    rate of the storm in steps per second [default: 1000]

A failure names the seed and the action, and shows the output of the programs. Ctrl-C ends the run
after the current action.";

/// Number of actions without `--actions`.
const ACTIONS_DEFAULT: u64 = 300;
/// Rate of `--storm` without `--rate`.
const RATE_DEFAULT_HZ: u32 = 1000;
/// Number of clients of `--storm`.
const STORM_CLIENTS: u64 = 4;
/// Actions between two lines of progress.
const ACTIONS_PER_LINE: usize = 50;

fn main() -> anyhow::Result<()> {
    let mut words = std::env::args().skip(1);
    let (mut seed, mut actions, mut is_verbose, mut storm) = (None, ACTIONS_DEFAULT, false, None);
    let (mut scene, mut rate_hz) = ("curtain".to_owned(), RATE_DEFAULT_HZ);
    while let Some(word) = words.next() {
        if word == "--scene" {
            scene = words.next().context("--scene needs a name")?;
            continue;
        }
        let mut number = || -> anyhow::Result<u64> {
            let text = words.next().with_context(|| format!("{word} needs a number"))?;
            text.parse().with_context(|| format!("{word} needs a number, not '{text}'"))
        };
        match word.as_str() {
            "--seed" => seed = Some(number()?),
            "--actions" => actions = number()?,
            "--storm" => storm = Some(number()?),
            "--rate" => rate_hz = u32::try_from(number()?)?,
            "--verbose" => is_verbose = true,
            "--help" | "-h" => {
                eprintln!("{HELP}");
                return Ok(());
            }
            _ => bail!("unexpected argument '{word}'\n\n{HELP}"),
        }
    }
    if let Some(commands) = storm {
        run_storm(&scene, rate_hz, commands);
        return Ok(());
    }
    let stop = Stop::install()?;
    // Short, so that it is easy to type.
    let seed = seed.unwrap_or_else(|| fastrand::u64(..1_000_000));
    eprintln!("seed {seed}");
    let summary = faults::run(seed, usize::try_from(actions)?, |number, action| {
        if is_verbose {
            eprintln!("{number}: {action}");
        } else if number % ACTIONS_PER_LINE == 0 {
            eprintln!("action {number} of {actions}");
        }
        !stop.is_requested()
    });
    let faults::Summary { actions, recordings, lossy, unfinished, snapshots } = summary;
    eprintln!(
        "no fault in {actions} actions; verified {recordings} recordings ({lossy} with declared losses, \
         {unfinished} without an end) of {snapshots} snapshots"
    );
    Ok(())
}

fn run_storm(scene: &str, rate_hz: u32, commands: u64) {
    let storm = Storm { clients: STORM_CLIENTS, commands };
    let Summary { counts, last_step, size_bytes, recorded, verified } =
        storm::run(scene, rate_hz, storm);
    let Counts { applied, rejected } = counts;
    eprintln!("{recorded}");
    eprintln!(
        "{applied} commands applied and {rejected} rejected within {last_step} steps, recorded in {size_bytes} \
         bytes: {verified}"
    );
}
