//! `recorder`: records a simulation into MCAP, plays it back, simulates without a node, and proves
//! that a recording can be re-simulated bit for bit.
#![forbid(unsafe_code)]

mod cli;
mod commands;
mod export;
mod input;

use clap::error::{ContextKind, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};
use sim_cli::DocumentVerb;

use cli::exit::{self, Exit};
use commands::{
    check, diff, export as export_command, info, play, record, repair, restore, scene, simulate,
    state, verify,
};

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
    Export(export_command::ExportArgs),
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
    State(state::StateArgs),
    /// Re-simulate a recording and compare every bit
    Verify(verify::VerifyArgs),
    #[command(flatten)]
    Document(DocumentVerb),
}

fn main() -> Exit {
    let args = Args::try_parse().unwrap_or_else(|error| exit::with_usage(&explain(error)));
    exit::from_result(run(&args.command))
}

fn run(command: &Command) -> anyhow::Result<Exit> {
    sim_contract::report_file_size_limit()?;
    match command {
        Command::Check(args) => check::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Export(args) => export_command::run(args),
        Command::Info(args) => info::run(args),
        Command::Play(args) => play::run(args),
        Command::Record(args) => record::run(args),
        Command::Repair(args) => repair::run(args),
        Command::Restore(args) => restore::run(args),
        Command::Scene(args) => scene::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::State(args) => state::run(args),
        Command::Verify(args) => verify::run(args),
        Command::Document(document) => document.run(Args::command()).map(|()| Exit::Done),
    }
}

/// Returns `true` for an error of the command line of `export`.
fn is_of_export(error: &clap::Error) -> bool {
    let usage = error.get(ContextKind::Usage);
    usage.is_some_and(|usage| usage.to_string().contains("recorder export "))
}

/// Replaces the text of clap for an unknown option, which speaks of an "unexpected argument".
fn explain(error: clap::Error) -> clap::Error {
    let (ErrorKind::UnknownArgument, Some(argument)) =
        (error.kind(), error.get(ContextKind::InvalidArg))
    else {
        return error;
    };
    let suggestion = error.get(ContextKind::SuggestedArg);
    let hint = suggestion.map_or_else(String::new, |name| format!(" (did you mean '{name}'?)"));
    let text = if argument.to_string().starts_with('-') {
        let formats = if is_of_export(&error) { export_command::formats() } else { String::new() };
        format!("there is no option '{argument}' here{hint}{formats}")
    } else {
        format!("there is one argument too many: '{argument}'")
    };
    let text = text + "\n\nFor more information, try '--help'.\n";
    clap::Error::raw(ErrorKind::UnknownArgument, text).with_cmd(&Args::command())
}
