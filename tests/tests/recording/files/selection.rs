//! Recordings that leave a part of a run out on purpose: they declare it, no reader takes it for a loss,
//! and a program that needs it says so.

use std::path::Path;

use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, Signal, ctl, wait_for};
use serde_json::{Value, json};
use sim_contract::{Action, Client};

use super::{outcomes, record, steps};

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Records 200 steps of a node with commands, and returns the report.
fn record_steps(sandbox: &Sandbox, args: &[&str]) -> Value {
    let node = Process::start_ready(Program::SimNode, sandbox, &["run", "curtain", "--paused"]);
    let recording = record(sandbox, args);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    for round in 1..=10 {
        client.request(Action::Cut { constraint: round }, DEADLINE).unwrap();
        client.request(Action::Step { count: 20 }, DEADLINE).unwrap();
        wait_for("the steps", || {
            let snapshot = client.latest_snapshot(DEADLINE).unwrap()?;
            (snapshot.header().step >= u64::from(20 * round)).then_some(())
        });
    }
    drop(client);
    node.interrupt().success();
    serde_json::from_str(&recording.wait().success()).unwrap()
}

#[test]
fn every_seventh_snapshot_verifies_and_nothing_counts_as_lost() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let report = record_steps(&sandbox, &["-o", &file, "--every", "7"]);
    assert_eq!(report["lost"], json!({}), "{report}");
    let recorded = steps(&file);
    for step in (0..=200).step_by(7) {
        assert!(recorded.contains(&step), "step {step} is not in {recorded:?}");
    }
    assert_eq!(recorded.last(), Some(&200), "the file ends where the recording did");
    // The others have a keyframe, as the first step and the first one after each round of commands, or are the last
    // one.
    let others: Vec<_> = recorded.iter().filter(|step| *step % 7 != 0).collect();
    assert!(recorded.len() < 60 && others.len() >= 8, "{recorded:?}");
    let verified = recorder(&sandbox, &["verify", "--json", &file]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    assert_eq!(verified["lost"], json!({}), "{verified}");
    let info = recorder(&sandbox, &["info", "--json", &file]).json();
    assert_eq!(info["lost"], json!({}), "{info}");
}

#[test]
fn the_last_snapshot_before_a_pause_is_recorded_at_once() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let args = ["-o", &file, "--every", "1000000", "--flush-interval", "100ms"];
    let mut recording = record(&sandbox, &args);
    recording.wait_for_line("recording from step");
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.request(Action::Pause, DEADLINE).unwrap();
    let last_step = client.latest_snapshot(DEADLINE).unwrap().unwrap().header().step;
    let part = format!("{file}.part");
    wait_for("the last step", || (steps(&part).last() == Some(&last_step)).then_some(()));
    // Its outcome belongs to the next step, which is never made.
    client.request(Action::Pin { particle: 100 }, DEADLINE).unwrap();
    recording.interrupt().success();
    assert_eq!(steps(&file).last(), Some(&last_step));
}

#[test]
fn the_last_snapshot_is_recorded_although_a_command_follows() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
    let args = ["-o", &file, "--every", "1000000", "--flush-interval", "100ms"];
    let recording = record(&sandbox, &args);
    ctl(&sandbox, &["step", "20"]);
    // Its outcome belongs to step 21, which is never made, and is in the file long before the end.
    ctl(&sandbox, &["pin", "100"]);
    let part = format!("{file}.part");
    wait_for("the outcome", || (outcomes(&part).len() >= 2).then_some(()));
    recording.interrupt().success();
    assert_eq!(steps(&file).last(), Some(&20));
    let verified = recorder(&sandbox, &["verify", "--json", &file]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
}

#[test]
fn the_last_snapshot_before_a_load_is_recorded() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
    let args = ["-o", &sandbox.path("run.mcap"), "--every", "1000000", "--follow"];
    let recording = record(&sandbox, &args);
    ctl(&sandbox, &["step", "20"]);
    // With another rate, its outcome belongs to step 21.
    ctl(&sandbox, &["load", "ragdoll"]);
    let first = sandbox.path("run_0000.mcap");
    wait_for("the end of the first file", || Path::new(&first).exists().then_some(()));
    recording.interrupt().success();
    assert_eq!(steps(&first).last(), Some(&20));
}

#[test]
fn a_file_without_its_end_does_not_take_what_is_left_out_for_lost() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope", "--paused"]);
    let args = ["-o", &file, "--every", "5", "--flush-interval", "100ms"];
    let recording = record(&sandbox, &args);
    ctl(&sandbox, &["step", "20"]);
    ctl(&sandbox, &["pin", "3"]);
    ctl(&sandbox, &["step", "20"]);
    let part = format!("{file}.part");
    wait_for("step 40", || steps(&part).contains(&40).then_some(()));
    recording.signal(Signal::KILL);
    recording.wait();
    let info = recorder(&sandbox, &["info", "--json", &part]);
    let info: Value = serde_json::from_str(&info.stdout).unwrap();
    assert_eq!((&info["lost"], &info["file_end"].is_string()), (&json!({}), &true), "{info}");
    assert!(steps(&part).len() < 20);
}
