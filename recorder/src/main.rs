//! `recorder`: records a simulation into MCAP, plays it back, simulates without a node, and proves
//! that a recording can be re-simulated bit for bit.
#![forbid(unsafe_code)]

mod cli;
mod commands;
mod export;
mod input;
#[cfg(test)]
mod proof_tests;
mod simulation;

use clap::{Parser, Subcommand};

use cli::exit::{self, Exit};
use commands::{export as export_command, info, play, record, simulate, verify};

/// Record a simulation, play it back, and prove that it can be re-simulated bit for bit
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
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Draw pictures of a recording
    Export(export_command::ExportArgs),
    /// Show what a recording contains
    Info(info::InfoArgs),
    /// Play a recording on the services of a node
    Play(play::PlayArgs),
    /// Record everything that a running simulation publishes
    Record(record::RecordArgs),
    /// Simulate a scene in this process, as fast as possible, into the same recording as a live run
    Simulate(simulate::SimulateArgs),
    /// Re-simulate a recording and compare every bit
    Verify(verify::VerifyArgs),
}

fn main() -> Exit {
    let args = Args::parse();
    exit::from_result(match &args.command {
        Command::Export(args) => export_command::run(args),
        Command::Info(args) => info::run(args),
        Command::Play(args) => play::run(args),
        Command::Record(args) => record::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Verify(args) => verify::run(args),
    })
}
