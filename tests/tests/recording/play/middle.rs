//! A replay that begins in the middle of a recording publishes a complete state there, so that a recorder
//! misses nothing; and a recorder declares what it misses where the replay cannot.

use std::fs::File;
use std::path::Path;

use integration_tests::{Finished, Process, Program, Sandbox, ctl, wait_for};
use recording::{Closing, FrameReader, LogOptions, LogReader, LogWriter, RunDescription};
use serde_json::{Value, json};

/// The keyframes of the recording are those of each second, of 240 steps, and of each command.
const COMMANDS: &str = r#"{"step":250,"kind":"grab","particle":90,"target":[0.5,0.2,0.3],"over_s":0.1}
{"step":300,"kind":"cut","constraint":40}
{"step":310,"kind":"cut_radius","center":[0.3,0.3,0],"radius":0.1}
{"step":400,"kind":"set","parameter":"damping","value":0.5}
{"step":420,"kind":"reset"}
"#;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

fn recording(sandbox: &Sandbox) -> String {
    let (commands, file) = (sandbox.write("commands.jsonl", COMMANDS), sandbox.path("run.mcap"));
    let args = ["simulate", "curtain", "--steps", "600", "--commands", &commands, "-o", &file];
    recorder(sandbox, &args).success();
    file
}

/// Copies a recording as one of another version of the solver.
fn of_another_version(sandbox: &Sandbox, file: &str) -> String {
    let other = sandbox.path("other.mcap");
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let run = RunDescription { solver_version: log.run().solver_version + 1, ..log.run().clone() };
    let out = File::create(&other).unwrap();
    let mut copy = LogWriter::create(out, LogOptions::default(), &run, log.scene(), 0).unwrap();
    while let Some(logged) = log.next_message().unwrap() {
        copy.write(&logged.message, logged.log_time_ns).unwrap();
    }
    copy.finish(&Closing::default()).unwrap();
    other
}

fn steps(file: &str) -> Vec<u64> {
    let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    std::iter::from_fn(|| frames.next_frame().unwrap()).map(|frame| frame.row.step).collect()
}

/// Records a replay from a time on, from its first snapshot to its end.
fn record_from(sandbox: &Sandbox, file: &str, start: &str) -> (String, Finished) {
    let output = sandbox.path(&format!("from_{start}.mcap"));
    let play = ["play", file, "--start", start, "--rate", "max", "--wait-for-readers", "1"];
    let player = Process::start_ready(Program::Recorder, sandbox, &play);
    let record = ["record", "--json", "--lockstep", "-o", &output];
    let recorded = Process::start_ready(Program::Recorder, sandbox, &record).wait();
    player.wait().success();
    (output, recorded)
}

#[test]
fn a_recorder_beside_a_replay_that_starts_in_the_middle_records_it_from_there() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    // In a grab, in the step of a cut, after it, before a reset, and before the last step.
    for (start, first) in
        [("1100ms", 264), ("1.25s", 300), ("1.3s", 312), ("1.74s", 417), ("2.49s", 597)]
    {
        let (output, recorded) = record_from(&sandbox, &file, start);
        assert_eq!(recorded.code, Some(0), "{recorded:?}");
        assert_eq!(steps(&output), (first..=600).collect::<Vec<_>>(), "{start}");
        recorder(&sandbox, &["verify", &output]).success();
        recorder(&sandbox, &["check", &output]).success();
    }
}

#[test]
fn the_state_of_any_step_at_which_a_replay_stands_can_be_recorded() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let play = ["play", &file, "--paused", "--start", "1100ms"];
    let _player = Process::start_ready(Program::Recorder, &sandbox, &play);
    let state = |step: u64| {
        let output = sandbox.path(&format!("{step}.mcap"));
        recorder(&sandbox, &["state", "-o", &output]).success();
        assert_eq!(steps(&output), [step]);
        recorder(&sandbox, &["verify", &output]).success();
    };
    state(264);
    ctl(&sandbox, &["step", "3"]);
    wait_for("the third step", || (ctl(&sandbox, &["status"])["step"] == 267).then_some(()));
    state(267);
    ctl(&sandbox, &["rewind", "--to-step", "311"]);
    state(311);
}

#[test]
fn a_recorder_declares_the_steps_before_the_first_keyframe_of_a_replay() {
    let sandbox = Sandbox::new();
    let file = of_another_version(&sandbox, &recording(&sandbox));
    let (output, recorded) = record_from(&sandbox, &file, "1100ms");
    assert_eq!(recorded.code, Some(3), "{recorded:?}");
    assert_eq!(steps(&output), (300..=600).collect::<Vec<_>>());
    let report: Value = serde_json::from_str(&recorded.stdout).unwrap();
    assert_eq!(report["lost"], json!({ "/steps": 36, "/particles": 36 }));
    assert_eq!(report["before_first_keyframe"], 36);
    let warning = "the recording lacks 36 snapshots up to step 299, before the first keyframe";
    assert!(recorded.stderr.contains(warning), "{}", recorded.stderr);
    let info = recorder(&sandbox, &["info", "--json", &output]);
    let info: Value = serde_json::from_str(&info.stdout).unwrap();
    assert_eq!(info["lost"], report["lost"]);
}
