//! Simulations of recordings, by the built programs.

mod changes;
mod diff;
mod flight;

use std::path::Path;

use integration_tests::{Finished, Process, Program, Sandbox, ctl, wait_for};
use recording::{Frame, FrameReader, LogReader};

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Starts a recorder for which the node waits, so that it loses nothing, and waits until it records.
fn record(sandbox: &Sandbox, args: &[&str]) -> Process {
    let args: Vec<_> = ["record", "--lockstep"].into_iter().chain(args.iter().copied()).collect();
    let mut recording = Process::start_ready(Program::Recorder, sandbox, &args);
    recording.wait_for_line("recording from step ");
    recording
}

/// The readable snapshots of a file.
fn frames(file: &str) -> Vec<Frame> {
    let Ok(log) = LogReader::open(Path::new(file)) else { return Vec::new() };
    let mut reader = FrameReader::new(log);
    std::iter::from_fn(|| reader.next_frame().ok().flatten()).collect()
}

/// Lets a paused node compute steps.
fn step(sandbox: &Sandbox, count: u64) {
    ctl(sandbox, &["step", &count.to_string()]);
}

/// Waits until a recorder has flushed the snapshot of a step.
fn wait_for_step(file: &str, step: u64) {
    let part = format!("{file}.part");
    wait_for("the recording of a step", || {
        frames(&part).last().filter(|frame| frame.row.step >= step).map(|_| ())
    });
}
