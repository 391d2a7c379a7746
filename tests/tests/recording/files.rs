//! Recordings of several files: across loads, runs and restarts of the node, and at limits. Each file
//! verifies alone, and together they have every published step.

mod black_box;
mod extras;
mod kills;
mod selection;

use std::path::Path;

use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, Signal, ctl, wait_for};
use recording::{LogReader, Message, StepRow};
use serde_json::{Value, json};
use sim_contract::{Action, Client};

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

/// Starts a recorder, and waits until it has begun a file.
fn record(sandbox: &Sandbox, args: &[&str]) -> Process {
    let args: Vec<_> = ["record", "--json"].into_iter().chain(args.iter().copied()).collect();
    let mut recording = Process::start_ready(Program::Recorder, sandbox, &args);
    recording.wait_for_line("recording from step");
    recording
}

/// Returns the path of a numbered file.
fn numbered(sandbox: &Sandbox, number: usize) -> String {
    sandbox.path(&format!("run_{number:04}.mcap"))
}

/// Rows of `/steps` in the readable part of a file.
fn rows(file: &str) -> Vec<StepRow> {
    let Ok(mut log) = LogReader::open(Path::new(file)) else { return Vec::new() };
    let rows = std::iter::from_fn(|| log.next_message().ok().flatten());
    rows.filter_map(|row| match row.message {
        Message::Step(row) => Some(row),
        _ => None,
    })
    .collect()
}

pub(crate) fn steps(file: &str) -> Vec<u64> {
    rows(file).into_iter().map(|row| row.step).collect()
}

/// Indices of the outcomes in a file.
fn outcomes(file: &str) -> Vec<u64> {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let rows = std::iter::from_fn(|| log.next_message().unwrap());
    rows.filter_map(|row| match row.message {
        Message::Outcome(row) => Some(row.index),
        _ => None,
    })
    .collect()
}

fn assert_verifies(sandbox: &Sandbox, file: &str) {
    let verified = recorder(sandbox, &["verify", "--json", file]).json();
    assert_eq!(verified["verdict"], "identical", "{file}: {verified}");
}

/// Asserts that files follow each other without a gap and without a common step.
fn assert_contiguous(files: &[String], first_step: u64) -> u64 {
    let mut next = first_step;
    for file in files {
        let steps = steps(file);
        assert!(!steps.is_empty(), "{file} has no step");
        for step in steps {
            assert_eq!(step, next, "{file}");
            next += 1;
        }
    }
    next
}

#[test]
fn a_following_recording_goes_on_across_loads_new_runs_and_a_killed_node() {
    let sandbox = Sandbox::new();
    let mut first = node(&sandbox, &["run", "rope", "--paused"]);
    let recording = record(&sandbox, &["-o", &sandbox.path("run.mcap"), "--follow"]);
    ctl(&sandbox, &["step", "10"]);
    ctl(&sandbox, &["pin", "3"]);
    // The same rate: the same run, another load.
    let loaded = ctl(&sandbox, &["load", "pendulum"]);
    assert_eq!(loaded["status"], "applied", "{loaded}");
    ctl(&sandbox, &["step", "5"]);
    // Another rate: another run in the same process.
    ctl(&sandbox, &["load", &sandbox.write("slow.toml", SLOW)]);
    ctl(&sandbox, &["step", "7"]);
    first.signal(Signal::KILL);
    wait_for("the end of the node", || (!first.is_running()).then_some(()));
    let second = node(&sandbox, &["run", "rope", "--steps", "30"]);
    second.wait().success();
    wait_for("the file of the restarted node", || {
        Path::new(&numbered(&sandbox, 3)).exists().then_some(())
    });
    let finished = recording.interrupt();
    assert_eq!(finished.code, Some(0), "{finished:?}");
    let report: Value = serde_json::from_str(&finished.stdout).unwrap();
    assert_eq!((&report["files"], &report["lost"]), (&json!(4), &json!({})), "{report}");
    let files: Vec<_> = (0..4).map(|number| numbered(&sandbox, number)).collect();
    for file in &files {
        assert_verifies(&sandbox, file);
    }
    let in_one_run = assert_contiguous(&files[..2], 0);
    assert_eq!(steps(&files[2]), (0..=7).collect::<Vec<_>>());
    assert_eq!(steps(&files[3]), (0..=30).collect::<Vec<_>>());
    let snapshots = in_one_run + 8 + 31;
    assert_eq!(report["snapshots"], snapshots);
    // The commands of the first run are numbered without a gap across its files.
    let of_first_run: Vec<_> = files[..2].iter().flat_map(|file| outcomes(file)).collect();
    assert_eq!(of_first_run, (0..of_first_run.len() as u64).collect::<Vec<_>>());
}

/// A scene with a rate of its own.
const SLOW: &str = "version = 1\nsolver.rate_hz = 100\n[[particle]]\nposition = [0, 1, 0]\n";

#[test]
fn a_recording_that_ends_with_a_load_names_the_option_to_follow() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "rope", "--paused"]);
    let recording = record(&sandbox, &["-o", &sandbox.path("run.mcap")]);
    ctl(&sandbox, &["load", "pendulum"]);
    let finished = recording.wait();
    assert_eq!(finished.code, Some(0), "{finished:?}");
    let hint = "note: the recording ended because another scene was loaded; with --follow, ";
    assert!(finished.stderr.contains(hint), "{}", finished.stderr);
}

#[test]
fn a_waiting_recorder_begins_with_the_node() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let mut recording =
        Process::start(Program::Recorder, &sandbox, &["record", "-o", &file, "--wait"]);
    recording.wait_for_line("waiting for a node");
    let node = node(&sandbox, &["run", "rope", "--paused"]);
    recording.wait_for_line("recording from step 0");
    ctl(&sandbox, &["step", "5"]);
    node.interrupt().success();
    recording.wait().success();
    assert_eq!(steps(&file), [0, 1, 2, 3, 4, 5]);
    let mut never = Process::start(Program::Recorder, &sandbox, &["record", "--wait"]);
    never.wait_for_line("waiting for a node");
    let finished = never.interrupt();
    assert_eq!(finished.code, Some(1), "{finished:?}");
    assert!(finished.stderr.contains("no node has come up"), "{finished:?}");
}

#[test]
fn files_of_a_size_follow_each_other_without_a_gap_and_verify_alone() {
    let sandbox = Sandbox::new();
    // Torn constraints, moved colliders and a grab are part of every later file.
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let args = ["-o", &sandbox.path("run.mcap"), "--split-size", "64KiB", "--compression", "none"];
    let recording = record(&sandbox, &args);
    ctl(&sandbox, &["cut-radius", "0.3", "0.3", "0", "--radius", "0.1"]);
    ctl(&sandbox, &["grab", "90", "0.5", "0.2", "0.3"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let mut random = fastrand::Rng::with_seed(5);
    for round in 0..60 {
        // Every command but a move has a keyframe, and a file can begin with it.
        let particle = random.u32(40..80);
        client.request(Action::Pin { particle }, DEADLINE).unwrap();
        client.request(Action::Step { count: 20 }, DEADLINE).unwrap();
        wait_for("the steps", || {
            let snapshot = client.latest_snapshot(DEADLINE).unwrap()?;
            (snapshot.header().step >= 20 * (round + 1)).then_some(())
        });
    }
    let finished = recording.interrupt();
    assert_eq!(finished.code, Some(0), "{finished:?}");
    let report: Value = serde_json::from_str(&finished.stdout).unwrap();
    let count = usize::try_from(report["files"].as_u64().unwrap()).unwrap();
    // The exact number depends on how quickly the writing thread keeps up.
    assert!(count > 1, "{report}");
    let files: Vec<_> = (0..count).map(|number| numbered(&sandbox, number)).collect();
    let end = assert_contiguous(&files, 0);
    assert_eq!((&report["snapshots"], &report["lost"]), (&json!(end), &json!({})), "{report}");
    for file in &files {
        assert_verifies(&sandbox, file);
    }
    let all: Vec<_> = files.iter().flat_map(|file| outcomes(file)).collect();
    assert_eq!(all, (0..all.len() as u64).collect::<Vec<_>>());
    assert_eq!(report["outcomes"], all.len());
    assert!(!Path::new(&sandbox.path("run.mcap")).exists());
}

#[test]
fn a_ring_keeps_the_newest_files_and_refuses_to_mix_with_earlier_ones() {
    let sandbox = Sandbox::new();
    let output = sandbox.path("run.mcap");
    let _node = node(&sandbox, &["run", "rope", "--rate", "1000"]);
    let args = ["-o", &output, "--split-duration", "1s", "--max-files", "2"];
    let recording = record(&sandbox, &args);
    wait_for("the third file", || {
        Path::new(&(numbered(&sandbox, 3) + ".part")).exists().then_some(())
    });
    let finished = recording.interrupt();
    let report: Value = serde_json::from_str(&finished.stdout).unwrap();
    assert!(matches!(finished.code, Some(0 | 3)), "{finished:?}");
    let count = usize::try_from(report["files"].as_u64().unwrap()).unwrap();
    assert_eq!(report["removed_files"], count - 2, "{report}");
    for number in 0..count {
        let file = numbered(&sandbox, number);
        assert_eq!(Path::new(&file).exists(), number + 2 >= count, "{file}");
    }
    let kept: Vec<_> = (count - 2..count).map(|number| numbered(&sandbox, number)).collect();
    assert_eq!(report["output"], kept[1]);
    assert!(rows(&kept[0]).last().unwrap().step < rows(&kept[1])[0].step);

    let refused = recorder(&sandbox, &["record", "-o", &output, "--follow"]);
    let expected = format!("error: {} exists (use --overwrite to replace it)\n", kept[0]);
    assert_eq!((refused.code, refused.stderr), (Some(1), expected));
    let refused = recorder(&sandbox, &["record", "-o", &output, "--max-files", "2"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("--split-size"), "{refused:?}");
}

#[test]
fn what_a_stopped_recorder_misses_at_a_load_is_declared_in_one_of_the_files() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "rope", "--paused"]);
    let recording = record(&sandbox, &["-o", &sandbox.path("run.mcap"), "--follow"]);
    let part = numbered(&sandbox, 0) + ".part";
    wait_for("step 0 in the file", || (!rows(&part).is_empty()).then_some(()));
    recording.signal(Signal::STOP);
    for _ in 0..40 {
        ctl(&sandbox, &["step"]);
    }
    ctl(&sandbox, &["load", "pendulum"]);
    for _ in 0..50 {
        ctl(&sandbox, &["step"]);
    }
    let last = ctl(&sandbox, &["status"])["step"].as_u64().unwrap();
    recording.signal(Signal::CONT);
    let part = numbered(&sandbox, 1) + ".part";
    wait_for("the last step", || {
        (rows(&part).last().is_some_and(|row| row.step == last)).then_some(())
    });
    let finished = recording.interrupt();
    assert_eq!(finished.code, Some(3), "{finished:?}");
    let report: Value = serde_json::from_str(&finished.stdout).unwrap();
    let lost = report["lost"]["/particles"].as_u64().unwrap();
    let recorded = report["snapshots"].as_u64().unwrap();
    assert_eq!(recorded + lost, last + 1, "{report}");
    let in_files: usize =
        [0, 1].map(|number| steps(&numbered(&sandbox, number)).len()).iter().sum();
    assert_eq!(in_files as u64, recorded);
}
