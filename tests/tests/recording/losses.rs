//! Recordings declare exactly the messages that are missing in them.

use std::fs::File;
use std::path::Path;

use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, Signal, ctl, wait_for};
use recording::{Closing, LogOptions, LogReader, LogWriter, Message};
use sim_contract::{Action, Client, KEYFRAMES_BUFFERED, SNAPSHOTS_BUFFERED};

/// Single steps that a stopped recorder misses, beyond those that its buffer holds.
const MISSED: u64 = 30;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Steps of the rows of `/steps` in the readable part of a file.
pub(super) fn recorded_steps(file: &str) -> Vec<u64> {
    let Ok(mut log) = LogReader::open(Path::new(file)) else { return Vec::new() };
    let rows = std::iter::from_fn(|| log.next_message().ok().flatten());
    rows.filter_map(|row| match row.message {
        Message::Step(row) => Some(row.step),
        _ => None,
    })
    .collect()
}

fn lost(report: &str) -> serde_json::Value {
    let report: serde_json::Value = serde_json::from_str(report).unwrap();
    report["lost"].clone()
}

#[test]
fn a_node_that_publishes_every_tenth_step_loses_nothing_by_pauses_steps_resets_and_a_load() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let args = ["run", "rope", "--every", "10", "--paused"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let record = ["record", "-o", &file, "--json"];
    let recording = Process::start_ready(Program::Recorder, &sandbox, &record);
    let rounds = [
        &["step", "3"][..],
        &["step", "1"],
        &["step", "17"],
        &["reset"],
        &["resume"],
        &["pause"],
        &["set", "time_scale", "0.5"],
        &["resume"],
        &["pin", "3"],
        &["pause"],
        &["step", "9"],
    ];
    let mut steps = vec![0];
    for command in rounds.iter().cycle().take(3 * rounds.len()) {
        assert_eq!(ctl(&sandbox, command)["status"], "applied");
        if command[0] == "step" {
            steps.push(ctl(&sandbox, &["status"])["step"].as_u64().unwrap());
        }
    }
    // The recording ends where another scene is loaded.
    assert_eq!(ctl(&sandbox, &["load", "rope"])["status"], "applied");
    let finished = recording.wait();
    assert_eq!(lost(&finished.stdout), serde_json::json!({}));
    assert!(finished.stdout.contains("new scene loaded"), "{}", finished.stdout);
    assert_eq!(finished.code, Some(0), "{}", finished.stderr);
    let recorded = recorded_steps(&file);
    steps.extend((0..=recorded[recorded.len() - 1]).step_by(10));
    for step in steps {
        assert!(recorded.contains(&step), "step {step} was published, but is not in {recorded:?}");
    }
    let info = recorder(&sandbox, &["info", "--json", &file]).success();
    assert_eq!(lost(&info), serde_json::json!({}));
}

#[test]
fn a_stopped_recorder_declares_exactly_the_snapshots_that_it_missed_even_if_it_is_killed() {
    let sandbox = Sandbox::new();
    let args = ["run", "rope", "--every", "10", "--paused"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let files = ["finished.mcap", "killed.mcap"].map(|file| sandbox.path(file));
    let parts = files.each_ref().map(|file| format!("{file}.part"));
    let start = |file: &String| {
        let args = ["record", "-o", file, "--json"];
        Process::start_ready(Program::Recorder, &sandbox, &args)
    };
    let [finished, killed] = files.each_ref().map(start);
    let wait_for_step = |step: u64| {
        for part in &parts {
            wait_for("a step in the file", || recorded_steps(part).contains(&step).then_some(()));
        }
    };
    wait_for_step(0);
    for recording in [&finished, &killed] {
        recording.signal(Signal::STOP);
    }
    // A paused node publishes each single step, whatever its stride.
    let last_step = SNAPSHOTS_BUFFERED as u64 + MISSED;
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    for _ in 0..last_step {
        client.request(Action::Step { count: 1 }, DEADLINE).unwrap();
    }
    wait_for("the last step", || {
        let snapshot = client.latest_snapshot(DEADLINE).unwrap()?;
        (snapshot.header().step == last_step).then_some(())
    });
    for recording in [&finished, &killed] {
        recording.signal(Signal::CONT);
    }
    wait_for_step(last_step);

    // Each step had a command and so a keyframe, and fewer of these wait for a reader.
    let missed_keyframes = (SNAPSHOTS_BUFFERED - KEYFRAMES_BUFFERED) as u64;
    let declared = serde_json::json!({
        "/steps": MISSED, "/particles": MISSED, "/keyframe": missed_keyframes
    });
    // Keyframes have no numbers, so their gaps do not show in a file without its closing record.
    let counted = serde_json::json!({ "/steps": MISSED, "/particles": MISSED });
    let finished = finished.interrupt();
    assert_eq!((finished.code, lost(&finished.stdout)), (Some(3), declared.clone()));
    killed.signal(Signal::KILL);
    killed.wait();
    for (file, expected) in [(&files[0], &declared), (&parts[1], &counted)] {
        let recorded = recorded_steps(file).len() as u64;
        assert_eq!(recorded + MISSED, last_step + 1, "every step from 0 was published");
        let info = recorder(&sandbox, &["info", "--json", file]);
        assert_eq!((info.code, lost(&info.stdout)), (Some(3), expected.clone()), "{file}");
        let text = recorder(&sandbox, &["info", file]).stdout;
        let lost = format!("/particles {MISSED}, /steps {MISSED}");
        assert!(text.contains(&lost), "no \"{lost}\" in: {text}");
        assert_eq!(text.contains("as far as the file goes"), file == &parts[1], "{text}");
    }
}

/// A scene with a collider that moves in every step.
const MOVING_COLLIDER: &str = "version = 1\n\
    [[particle]]\nposition = [0, 9, 0]\n\
    [[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 1\nvelocity = [0.01, 0, 0]\n";

#[test]
fn a_stopped_recorder_declares_the_poses_of_colliders_between_two_snapshots() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("moving.toml", MOVING_COLLIDER);
    let file = sandbox.path("run.mcap");
    let args = ["run", &scene, "--every", "1000", "--paused"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let args = ["record", "-o", &file, "--json"];
    let recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    let part = format!("{file}.part");
    wait_for("step 0 in the file", || recorded_steps(&part).contains(&0).then_some(()));
    recording.signal(Signal::STOP);
    let count = (SNAPSHOTS_BUFFERED as u64 + MISSED).to_string();
    assert_eq!(ctl(&sandbox, &["step", &count])["status"], "applied");
    recording.signal(Signal::CONT);
    let finished = recording.interrupt();
    let expected = serde_json::json!({ "/colliders": MISSED });
    assert_eq!((finished.code, lost(&finished.stdout)), (Some(3), expected));
    assert_eq!(recorded_steps(&file).len(), 2, "no snapshot is missing");
}

#[test]
fn a_file_with_unreadable_messages_is_not_complete() {
    let sandbox = Sandbox::new();
    let (file, other) = (sandbox.path("run.mcap"), sandbox.path("other.mcap"));
    recorder(&sandbox, &["simulate", "rope", "--steps", "3", "-o", &file]).success();
    let mut log = LogReader::open(Path::new(&file)).unwrap();
    let out = File::create(&other).unwrap();
    let mut copy =
        LogWriter::create(out, LogOptions::default(), log.run(), log.scene(), 0).unwrap();
    while let Some(logged) = log.next_message().unwrap() {
        copy.write(&logged.message, logged.log_time_ns).unwrap();
    }
    copy.finish(&Closing { unreadable: 2, ..Closing::default() }).unwrap();
    let info = recorder(&sandbox, &["info", "--json", &other]);
    assert_eq!((info.code, lost(&info.stdout)), (Some(3), serde_json::json!({ "unreadable": 2 })));
}
