//! `recorder`: records a simulation into MCAP, plays it back, simulates without a node, and proves
//! that a recording can be simulated again bit by bit.
#![forbid(unsafe_code)]

mod apply;
mod command_file;
mod difference;
mod endpoint_args;
mod exit;
mod export;
mod frozen;
mod info;
mod output;
mod play;
#[cfg(test)]
mod proof_tests;
mod record;
mod resimulation;
mod scene_source;
mod simulate;
mod simulation;
mod solver_rows;
mod thread_args;
mod verify;

use clap::{Parser, Subcommand};

use exit::Exit;

/// Record a simulation, play it back, and prove that it can be simulated again bit by bit.
#[derive(Debug, Parser)]
#[command(
    name = "recorder",
    version,
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong option, 3 finished with loss or \
        divergence.\n\nExamples:\n  \
        recorder record -o run.mcap\n  \
        recorder play run.mcap\n  \
        recorder simulate curtain --steps 2400 -o curtain.mcap\n  \
        recorder info curtain.mcap\n  \
        recorder export curtain.mcap --png pictures\n  \
        recorder verify curtain.mcap"
)]
struct Args {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Draw pictures of a recording, to look at it without a viewer.
    Export(export::ExportArgs),
    /// Tell what is in a recording.
    Info(info::InfoArgs),
    /// Play a recording on the services that it was recorded from.
    Play(play::PlayArgs),
    /// Record everything that a running simulation publishes.
    Record(record::RecordArgs),
    /// Simulate a scene in this process, as fast as it can, into the same recording as a live run.
    Simulate(simulate::SimulateArgs),
    /// Simulate a recording again and compare every bit.
    Verify(verify::VerifyArgs),
}

fn main() -> Exit {
    let args = Args::parse();
    exit::of(match &args.verb {
        Verb::Export(args) => export::run(args),
        Verb::Info(args) => info::run(args),
        Verb::Play(args) => play::run(args),
        Verb::Record(args) => record::run(args),
        Verb::Simulate(args) => simulate::run(args),
        Verb::Verify(args) => verify::run(args),
    })
}
