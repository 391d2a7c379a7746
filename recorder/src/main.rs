//! `recorder`: records a simulation into MCAP, plays it back, simulates without a node, and proves
//! that a recording can be re-simulated bit for bit.
#![forbid(unsafe_code)]
#![allow(rustdoc::invalid_html_tags, reason = "help texts are plain text")]

mod cli;
mod commands;
mod input;

use clap::{CommandFactory, Parser, Subcommand};
use sim_cli::DocumentVerb;

use cli::output::{self, Exit};
use commands::{check, diff, export, info, play, record, repair, restore, scene, simulate, verify};

/// Record a simulation, play it back, and prove that it can be re-simulated bit for bit
#[derive(Debug, Parser)]
#[command(
    name = "recorder",
    version,
    after_help = "Exit codes: 0 success, 1 failure, 2 usage error, 3 finished with loss or \
        divergence, or a recording too damaged to use.\n\nExamples:\n  \
        recorder record -o run.mcap\n  \
        recorder play run.mcap\n  \
        recorder simulate curtain --steps 2400 -o curtain.mcap\n  \
        recorder info curtain.mcap\n  \
        recorder check curtain.mcap\n  \
        recorder diff curtain.mcap changed.mcap\n  \
        recorder repair run.mcap.part repaired.mcap\n  \
        recorder export curtain.mcap --png pictures\n  \
        recorder scene curtain.mcap > curtain.toml\n  \
        recorder state -o state.mcap\n  \
        recorder restore curtain.mcap --step 480\n  \
        recorder verify curtain.mcap"
)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Test every byte of recordings: structure, checksums, index, steps and hashes
    Check(check::CheckArgs),
    /// Show where two recordings come apart, and how their distance grows
    Diff(diff::DiffArgs),
    /// Turn a recording into pictures, or into files of other programs
    Export(export::ExportArgs),
    /// Show what a recording contains
    Info(info::InfoArgs),
    /// Play a recording on the services of a node
    Play(play::PlayArgs),
    /// Record everything that a running simulation publishes
    Record(record::RecordArgs),
    /// Copy what is intact in a damaged or unfinished recording, and declare the rest as missing
    Repair(repair::RepairArgs),
    /// Put a recorded state in place in a running node
    Restore(restore::RestoreArgs),
    /// Print the scene of a recording
    Scene(scene::SceneArgs),
    /// Simulate a scene in this process, as fast as possible, and record it like a live run
    Simulate(simulate::SimulateArgs),
    /// Record one step of a running node: its complete state
    State(record::StateArgs),
    /// Re-simulate a recording and compare every bit
    Verify(verify::VerifyArgs),
    #[command(flatten)]
    Document(DocumentVerb),
}

fn main() -> Exit {
    let words: Vec<_> = std::env::args_os().collect();
    let args = Args::try_parse_from(&words).unwrap_or_else(|error| {
        output::with_usage(&sim_cli::explain(error, &Args::command(), &words))
    });
    output::from_result(run(&args.command))
}

fn run(command: &Command) -> anyhow::Result<Exit> {
    sim_host::report_file_size_limit()?;
    match command {
        Command::Check(args) => check::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Export(args) => export::run(args),
        Command::Info(args) => info::run(args),
        Command::Play(args) => play::run(args),
        Command::Record(args) => record::run(args),
        Command::Repair(args) => repair::run(args),
        Command::Restore(args) => restore::run(args),
        Command::Scene(args) => scene::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::State(args) => record::run(&args.clone().into()),
        Command::Verify(args) => verify::run(args),
        Command::Document(document) => document.run(Args::command()).map(|()| Exit::Done),
    }
}
