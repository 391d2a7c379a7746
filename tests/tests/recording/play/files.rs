//! `recorder play` plays several files one after another: those of one run as one run, others as runs of
//! their own.

use std::fs;
use std::path::Path;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl, wait_for};
use recording::{Closing, FrameReader, LogOptions, LogReader, LogWriter, Message};
use sim_contract::{Client, Tap};

/// Steps of each file of a split recording.
const STEPS: u64 = 60;
const FILES: u64 = 3;

/// A published state.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shown {
    run_id: u64,
    step: u64,
    hash: u64,
    torn_count: usize,
    is_load: bool,
}

/// Records a run in three files. Each begins at a command, which has a keyframe.
fn split(sandbox: &Sandbox) -> Vec<String> {
    let node = Process::start_ready(Program::SimNode, sandbox, &["run", "curtain", "--paused"]);
    let args = ["record", "-o", &sandbox.path("run.mcap"), "--split-size", "64KiB"];
    let args: Vec<_> = args.into_iter().chain(["--compression", "none"]).collect();
    let mut recording = Process::start_ready(Program::Recorder, sandbox, &args);
    recording.wait_for_line("recording from step 0");
    for file in 0..FILES {
        if file > 0 {
            // The first keyframe after the file has reached its size begins the next one.
            let path = sandbox.path(&format!("run_{:04}.mcap.part", file - 1));
            wait_for("the size of the file", || {
                (fs::metadata(&path).ok()?.len() > 64 << 10).then_some(())
            });
            ctl(sandbox, &["cut", &(20 + file).to_string()]);
        }
        ctl(sandbox, &["step", &STEPS.to_string()]);
    }
    recording.interrupt().success();
    node.interrupt().success();
    (0..FILES).map(|number| sandbox.path(&format!("run_{number:04}.mcap"))).collect()
}

/// Steps and hashes of a file.
fn rows(file: &str) -> Vec<(u64, u64)> {
    let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    let frames = std::iter::from_fn(|| frames.next_frame().unwrap());
    frames.map(|frame| (frame.row.step, frame.row.state_hash)).collect()
}

/// Plays files, and returns every published state, the exit code and the messages.
fn played(sandbox: &Sandbox, args: &[&str]) -> (Vec<Shown>, Option<i32>, String) {
    let wait = ["play", "--wait-for-readers", "1", "--rate", "max"];
    let args: Vec<_> = wait.iter().chain(args).copied().collect();
    let mut player = Process::start_ready(Program::Recorder, sandbox, &args);
    let mut tap = Tap::attach_in_lockstep(&sandbox.endpoint()).unwrap();
    let mut shown = Vec::new();
    wait_for("the end of the replay", || {
        tap.wait(Duration::from_millis(20));
        let is_running = player.is_running();
        while let Some(state) = tap.next_state(|_| {}) {
            shown.push(Shown {
                run_id: state.header.run_id,
                step: state.header.step,
                hash: state.header.state_hash,
                torn_count: state.torn.constraints.len(),
                is_load: state.changes.contains(&sim_contract::Change::Load),
            });
        }
        tap.ready().unwrap();
        (!is_running).then_some(())
    });
    let finished = player.wait();
    (shown, finished.code, finished.stderr)
}

fn published(shown: &[Shown]) -> Vec<(u64, u64)> {
    shown.iter().map(|one| (one.step, one.hash)).collect()
}

#[test]
fn the_files_of_a_split_recording_play_as_one_run() {
    let sandbox = Sandbox::new();
    let files = split(&sandbox);
    let files: Vec<_> = files.iter().map(String::as_str).collect();
    let all: Vec<_> = files.iter().flat_map(|file| rows(file)).collect();
    assert!(files.iter().all(|file| rows(file).len() > 50), "each has a part");
    let (shown, code, messages) = played(&sandbox, &files);
    assert_eq!(code, Some(0), "{messages}");
    assert_eq!(published(&shown), all);
    assert!(shown.iter().all(|one| one.run_id == shown[0].run_id), "one run");
    assert_eq!(shown.iter().filter(|one| one.is_load).count(), 1, "one load");
    assert_eq!(shown.last().unwrap().torn_count, 2, "those of the earlier files too");
}

/// Simulates a recording and divides it at a keyframe. Returns the two files.
fn halves(sandbox: &Sandbox, border: u64) -> [String; 2] {
    let whole = sandbox.path("whole.mcap");
    let args = ["simulate", "curtain", "--steps", "960", "-o", &whole];
    Process::run(Program::Recorder, sandbox, &args).success();
    let write = |name: &str, has: &dyn Fn(&Message) -> bool| {
        let file = sandbox.path(name);
        let mut log = LogReader::open(Path::new(&whole)).unwrap();
        let out = fs::File::create(&file).unwrap();
        let mut half =
            LogWriter::create(out, LogOptions::default(), log.run(), log.scene(), 0).unwrap();
        while let Some(logged) = log.next_message().unwrap() {
            if has(&logged.message) {
                half.write(&logged.message, logged.log_time_ns).unwrap();
            }
        }
        half.finish(&Closing::default()).unwrap();
        file
    };
    let is_of_load = |message: &Message| {
        matches!(message, Message::Topology(_) | Message::Surface(_) | Message::Parameters(_))
    };
    [
        write("half_0.mcap", &|message| message.step() < border),
        write("half_1.mcap", &|message| is_of_load(message) || message.step() >= border),
    ]
}

#[test]
fn an_arrow_key_at_the_last_snapshot_of_a_file_counts_from_there() {
    let sandbox = Sandbox::new();
    let [one, two] = halves(&sandbox, 480);
    let args = ["play", "--paused", &one, &two];
    let mut player = Process::start_on_terminal(r#""$0" "$@""#, Program::Recorder, &sandbox, &args);
    wait_for("the replay", || player.has_written_part("ready playing").then_some(()));
    let stands_at = |step: u64| {
        wait_for("the step", || (ctl(&sandbox, &["status"])["step"] == step).then_some(()));
    };
    ctl(&sandbox, &["rewind", "--to-step", "479"]);
    stands_at(479);
    // A second of 240 steps.
    player.press("\x1b[D");
    stands_at(239);
    player.press("\x1b[C");
    stands_at(479);
    player.press("\x1b[C");
    stands_at(719);
}

#[test]
fn a_seek_goes_from_file_to_file() {
    let sandbox = Sandbox::new();
    let files = split(&sandbox);
    let mut args = vec!["play", "--paused"];
    args.extend(files.iter().map(String::as_str));
    let _player = Process::start_ready(Program::Recorder, &sandbox, &args);
    let all: Vec<_> = files.iter().flat_map(|file| rows(file)).collect();
    for step in [150, 10, 70, 61, 60, 180, 0] {
        assert_eq!(ctl(&sandbox, &["rewind", "--to-step", &step.to_string()])["to_step"], step);
        let hash = ctl(&sandbox, &["hash"]);
        let expected = all.iter().find(|(at, _)| *at == step).unwrap().1;
        assert_eq!(hash["state_hash"], format!("{expected:016x}"), "step {step}");
    }
    // Steps across the border of two files.
    ctl(&sandbox, &["rewind", "--to-step", "58"]);
    ctl(&sandbox, &["step", "6"]);
    assert_eq!(ctl(&sandbox, &["hash"])["step"], 64);
}

#[test]
fn a_rejected_key_leaves_the_replay_in_its_file() {
    let sandbox = Sandbox::new();
    let files = split(&sandbox);
    // The last step of the first file, at 240 Hz. The next snapshot is read ahead from the second file.
    let last = rows(&files[0]).last().unwrap().0;
    let start = format!("{}us", last * 1_000_000 / 240 + 1);
    let args = ["play", "--paused", "--start", &start, &files[0], &files[1]];
    let mut player = Process::start_on_terminal(r#""$0" "$@""#, Program::Recorder, &sandbox, &args);
    wait_for("the replay", || player.has_written_part("ready playing").then_some(()));
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let mut run_ids = Vec::new();
    // One step back is before the start.
    for (keys, step) in [("", last), (",.", last + 1), (".", last + 2), (".", last + 3)] {
        player.press(keys);
        run_ids.push(wait_for(&format!("step {step}"), || {
            let status = client.status(DEADLINE).unwrap()?;
            (status.step == step).then_some(status.run_id)
        }));
    }
    assert!(run_ids.iter().all(|run_id| *run_id == run_ids[0]), "one run: {run_ids:?}");
    player.press("q");
    player.wait();
}

#[test]
fn a_missing_file_is_named_and_the_next_one_plays_as_a_run_of_its_own() {
    let sandbox = Sandbox::new();
    let files = split(&sandbox);
    let (shown, code, messages) = played(&sandbox, &[&files[0], &files[2]]);
    assert_eq!(code, Some(0), "{messages}");
    let missing = rows(&files[1]).len();
    let expected = format!("{missing} snapshots missing between {} and {}", files[0], files[2]);
    assert!(messages.contains(&expected), "{messages}");
    let (one, two) = (rows(&files[0]), rows(&files[2]));
    assert_eq!(published(&shown), [one.clone(), two].concat());
    let second = &shown[one.len()..];
    assert!(shown[0].run_id != second[0].run_id && second[0].is_load);
    assert_eq!(second[0].torn_count, 2);

    let absent = sandbox.path("run_0009.mcap");
    let args = ["play", &files[0], &absent];
    let refused = Process::run(Program::Recorder, &sandbox, &args);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.starts_with(&format!("error: {absent}: ")), "{}", refused.stderr);
}

#[test]
fn other_scenes_and_a_truncated_file_play_one_after_another() {
    let sandbox = Sandbox::new();
    let simulate = |scene: &str, steps: &str| {
        let file = sandbox.path(&format!("{scene}.mcap"));
        let args = ["simulate", scene, "--steps", steps, "-o", &file, "--compression", "none"];
        Process::run(Program::Recorder, &sandbox, &args).success();
        file
    };
    let (curtain, rope) = (simulate("curtain", "600"), simulate("rope", "30"));
    let bytes = fs::read(&curtain).unwrap();
    let cut = sandbox.path("cut.mcap");
    fs::write(&cut, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let (shown, code, messages) = played(&sandbox, &[&cut, &rope]);
    assert_eq!(code, Some(3), "{messages}");
    assert!(messages.contains(&format!("{cut} is truncated")), "{messages}");
    let rows = [rows(&cut), rows(&rope)].concat();
    assert_eq!(published(&shown), rows);
    assert_eq!(shown.iter().filter(|one| one.is_load).count(), 2);
}
