//! Recordings end to end, in real processes: a recording has the published states, plays them back, and
//! re-simulates bit for bit.

use std::fs::File;
use std::path::Path;
use std::time::Duration;

use integration_tests::{
    DEADLINE, Finished, Process, Program, Sandbox, Signal, ctl, record, wait_for,
};
use recording::{Closing, Frame, FrameReader, LogOptions, LogReader, LogWriter, Message};
use sim_contract::{Action, Client, SnapshotFlags, SnapshotHeader, Tap};

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

/// Starts a recorder whose recording begins later: at a paused node, with the next step.
fn ready_recorder(sandbox: &Sandbox, file: &str) -> Process {
    Process::start_ready(Program::Recorder, sandbox, &["record", "-o", file])
}

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Reads all snapshots of a recording.
fn frames(file: &str) -> Vec<Frame> {
    let mut reader = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    std::iter::from_fn(|| reader.next_frame().unwrap()).collect()
}

/// Counts the complete snapshots of a file that may still be written.
fn complete_frames(file: &str) -> u64 {
    let Ok(log) = LogReader::open(Path::new(file)) else { return 0 };
    let mut reader = FrameReader::new(log);
    let frames = std::iter::from_fn(|| reader.next_frame().ok().flatten());
    frames.fold(0, |count, _| count + 1)
}

/// Asserts that a recording verifies, and returns the number of verified steps.
fn assert_verifies(sandbox: &Sandbox, file: &str) -> u64 {
    let verified = recorder(sandbox, &["verify", file]).success();
    assert!(verified.contains("steps bit-identical"), "{verified}");
    verified.split(' ').find_map(|word| word.parse().ok()).unwrap()
}

/// A deterministic pseudo-random generator (Marsaglia's xorshift64).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u32) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        u32::try_from(self.0 % u64::from(limit)).unwrap()
    }

    fn coordinate(&mut self) -> f32 {
        self.below(2000) as f32 / 1000.0 - 1.0
    }

    /// Returns a grab or pin command for one of a few particles, so that clients conflict.
    fn action(&mut self) -> Action {
        let particle = 60 + self.below(60);
        let target = [self.coordinate(), self.coordinate(), self.coordinate()];
        let over_s = self.below(100) as f32 / 1000.0;
        match self.below(6) {
            0 => Action::Pin { particle },
            1 => Action::Unpin { particle },
            2 => Action::Release { particle, force: false },
            3 => Action::Move { particle, target, over_s },
            _ => Action::Grab { particle, target, over_s },
        }
    }
}

#[test]
fn a_recording_with_a_thousand_commands_of_two_clients_verifies_and_a_changed_one_diverges() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let node = node(&sandbox, &["run", "curtain", "--rate", "500"]);
    let recording = record(&sandbox, &file);
    let mut clients =
        [1, 2].map(|seed| (Client::attach(&sandbox.endpoint()).unwrap(), Random(seed)));
    for _ in 0..500 {
        for (client, random) in &mut clients {
            client.request(random.action(), DEADLINE).unwrap();
        }
    }
    // On a busy machine snapshots may be lost, which exit code 3 reports. The commands must be
    // complete.
    let finished = recording.interrupt();
    assert!(matches!(finished.code, Some(0 | 3)), "{}", finished.stderr);
    node.interrupt().success();
    drop(clients);
    let steps = assert_verifies(&sandbox, &file);
    assert!(steps >= 500, "each request waits for a step of its own: {steps}");

    let changed = sandbox.path("changed.mcap");
    let step = rewrite_with_another_target(&file, &changed);
    let verified = recorder(&sandbox, &["verify", &changed]);
    assert_eq!(verified.code, Some(3), "{}{}", verified.stdout, verified.stderr);
    let expected = format!("step {step} differs: ");
    assert!(verified.stdout.starts_with(&expected), "no \"{expected}\" in: {}", verified.stdout);
}

/// Copies a recording with one bit flipped in the target of an applied grab, and returns its step.
fn rewrite_with_another_target(from: &str, to: &str) -> u64 {
    let mut log = LogReader::open(Path::new(from)).unwrap();
    let out = File::create(to).unwrap();
    let mut copy =
        LogWriter::create(out, LogOptions::default(), log.run(), log.scene(), 0).unwrap();
    let mut changed = None;
    let mut grab_count = 0;
    while let Some(logged) = log.next_message().unwrap() {
        let mut message = logged.message;
        if let Message::Outcome(row) = &mut message
            && let Action::Grab { target, .. } = &mut row.action
            && row.status == "applied"
        {
            grab_count += 1;
            if grab_count == 50 {
                // The top bit of the fraction, half of the coordinate's magnitude.
                target[1] = f32::from_bits(target[1].to_bits() ^ (1 << 22));
                changed = Some(row.step);
            }
        }
        copy.write(&message, logged.log_time_ns).unwrap();
    }
    copy.finish(&Closing::default()).unwrap();
    changed.unwrap()
}

#[test]
fn a_recording_that_starts_during_a_grab_verifies() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("late.mcap");
    let _node = node(&sandbox, &["run", "curtain"]);
    ctl(&sandbox, &["pin", "100"]);
    ctl(&sandbox, &["pin", "101"]);
    ctl(&sandbox, &["unpin", "3"]);
    ctl(&sandbox, &["unpin", "100"]);
    ctl(&sandbox, &["grab", "90", "0.5", "0.2", "0.3"]);
    let recording = record(&sandbox, &file);
    let moved = ctl(&sandbox, &["move", "90", "-0.5", "0.1", "0.2", "--over", "0.25"]);
    assert_eq!(moved["status"], "applied");
    let step = moved["step"].as_u64();
    assert_eq!(ctl(&sandbox, &["release", "90"])["status"], "applied");
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    wait_for("240 steps", || {
        let snapshot = client.next_snapshot(DEADLINE).unwrap()?;
        (snapshot.header().step > step? + 240).then_some(())
    });
    assert_eq!(recording.interrupt().code, Some(0));
    let first = &frames(&file)[0];
    assert!(first.row.step > 0);
    assert_eq!(first.payload()[101].inverse_mass, 0.0);
    assert!(assert_verifies(&sandbox, &file) > 200);
}

#[test]
fn a_recording_that_starts_while_the_node_is_paused_verifies() {
    for has_keyframe in [false, true] {
        let sandbox = Sandbox::new();
        let file = sandbox.path("paused.mcap");
        let _node = node(&sandbox, &["run", "curtain", "--paused"]);
        ctl(&sandbox, &["step", "20"]);
        if has_keyframe {
            // The node publishes one for this reader, and later readers receive it.
            recorder(&sandbox, &["state", "-o", &sandbox.path("state.mcap")]).success();
        }
        // A command is pending when the recorder attaches, so it cannot record step 20 as published.
        ctl(&sandbox, &["grab", "90", "0.5", "0.2", "0.3"]);
        let recording = ready_recorder(&sandbox, &file);
        ctl(&sandbox, &["step", "30"]);
        assert_eq!(recording.interrupt().code, Some(0));
        let steps: Vec<_> = frames(&file).iter().map(|frame| frame.row.step).collect();
        assert_eq!(steps, (21..=50).collect::<Vec<_>>(), "{has_keyframe}");
        assert_eq!(assert_verifies(&sandbox, &file), 29);
    }
}

#[test]
fn a_recording_begins_at_the_state_at_which_a_node_has_paused_and_loses_nothing() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("paused.mcap");
    let _node = node(&sandbox, &["run", "curtain"]);
    ctl(&sandbox, &["pause"]);
    // None of them changes the state.
    ctl(&sandbox, &["mark", "begin"]);
    assert_eq!(ctl(&sandbox, &["pin", "9999"])["status"], "rejected");
    ctl(&sandbox, &["set", "time_scale", "2"]);
    let paused = ctl(&sandbox, &["status"])["step"].as_u64().unwrap();
    // A reader before this one has received the keyframe, and another command follows.
    recorder(&sandbox, &["state", "-o", &sandbox.path("state.mcap")]).success();
    ctl(&sandbox, &["mark", "end"]);
    let recording = record(&sandbox, &file);
    ctl(&sandbox, &["pin", "90"]);
    ctl(&sandbox, &["step", "20"]);
    recording.interrupt().success();
    let steps: Vec<_> = frames(&file).iter().map(|frame| frame.row.step).collect();
    assert_eq!(steps, (paused..=paused + 20).collect::<Vec<_>>());
    assert_eq!(assert_verifies(&sandbox, &file), 20);
    recorder(&sandbox, &["check", &file]).success();
}

#[test]
fn a_reset_in_a_recording_verifies() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("reset.mcap");
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let recording = record(&sandbox, &file);
    ctl(&sandbox, &["step", "40"]);
    ctl(&sandbox, &["grab", "90", "0", "0", "0"]);
    ctl(&sandbox, &["step", "5"]);
    ctl(&sandbox, &["reset"]);
    ctl(&sandbox, &["step", "25"]);
    assert_eq!(recording.interrupt().code, Some(0));
    assert_eq!(assert_verifies(&sandbox, &file), 71);
    let frames = frames(&file);
    assert_eq!((frames[46].row.step, frames[46].row.scene_step), (46, 0));
    assert_eq!(frames[46].row.state_hash, frames[0].row.state_hash);
}

/// Receives at least `count` headers.
fn headers(tap: &mut Tap, count: usize) -> Vec<SnapshotHeader> {
    let mut headers = Vec::new();
    wait_for("the headers", || {
        tap.wait(Duration::from_millis(20));
        while let Some(state) = tap.next_state(|_| {}) {
            headers.push(*state.header);
        }
        (headers.len() >= count).then_some(())
    });
    headers
}

#[test]
fn a_recording_of_a_playback_equals_the_original() {
    let sandbox = Sandbox::new();
    let (first, second) = (sandbox.path("first.mcap"), sandbox.path("second.mcap"));
    let args = ["run", "curtain", "--rate", "100", "--steps", "150", "--paused"];
    let node = node(&sandbox, &args);
    let recording = record(&sandbox, &first);
    let mut tap = Tap::attach(&sandbox.endpoint()).unwrap();
    ctl(&sandbox, &["grab", "90", "0.5", "0.2", "0.3"]);
    ctl(&sandbox, &["step", "10"]);
    ctl(&sandbox, &["resume"]);
    let live = headers(&mut tap, 151);
    node.wait().success();
    drop(tap);
    // The recording ends with the node.
    assert_eq!(recording.wait().code, Some(0));
    let info = recorder(&sandbox, &["info", "--json", &first]).json();
    assert_eq!(info["first_step"], 0);
    assert_eq!(info["last_step"], 150);

    let play = ["play", &first, "--wait-for-readers", "2"];
    let player = Process::start_ready(Program::Recorder, &sandbox, &play);
    let recording = ready_recorder(&sandbox, &second);
    let mut tap = Tap::attach(&sandbox.endpoint()).unwrap();
    let replayed = headers(&mut tap, 151);
    assert_eq!(player.wait().code, Some(0));
    assert_eq!(recording.wait().code, Some(0));

    let (one, two) = (frames(&first), frames(&second));
    assert_eq!(one.len(), 151);
    for (one, two) in one.iter().zip(&two) {
        assert_eq!(one.row, two.row);
        assert_eq!(
            bytemuck::cast_slice::<_, u8>(one.payload()),
            bytemuck::cast_slice::<_, u8>(two.payload())
        );
    }
    assert_eq!(two.len(), 151);
    assert_verifies(&sandbox, &second);
    assert_eq!(live.len(), replayed.len());
    for (live, replayed) in live.iter().zip(&replayed) {
        assert_ne!(live.run_id, replayed.run_id);
        let expected = SnapshotHeader {
            run_id: replayed.run_id,
            publish_monotonic_ns: replayed.publish_monotonic_ns,
            flags: live.flags | SnapshotFlags::REPLAY,
            ..*live
        };
        assert_eq!(*replayed, expected);
    }
}

#[test]
fn a_playback_refuses_to_run_beside_a_node_and_accepts_playback_commands() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "curtain", "--steps", "240", "-o", &file]).success();
    let running = node(&sandbox, &["run", "rope"]);
    let refused = recorder(&sandbox, &["play", &file]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("already running"), "{}", refused.stderr);
    running.interrupt().success();

    let args = ["play", file.as_str(), "--paused", "--loop"];
    let player = Process::start_ready(Program::Recorder, &sandbox, &args);
    assert_eq!(ctl(&sandbox, &["status"])["paused"], true);
    assert_eq!(ctl(&sandbox, &["pin", "3"])["reason"], "no_effect_here");
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let first = *client.next_snapshot(DEADLINE).unwrap().unwrap().header();
    assert_eq!(ctl(&sandbox, &["step", "3"])["status"], "applied");
    // `ctl step` waits for the steps of a playback, as it does for those of a node.
    assert_eq!(ctl(&sandbox, &["hash"])["step"], first.step + 3);
    wait_for("three steps", || {
        let header = *client.next_snapshot(DEADLINE).unwrap()?.header();
        (header.step == first.step + 3).then_some(())
    });
    assert_eq!(ctl(&sandbox, &["hash"])["step"], first.step + 3);
    assert_eq!(ctl(&sandbox, &["resume"])["status"], "applied");
    wait_for("the second pass, with another run id", || {
        let header = *client.next_snapshot(DEADLINE).unwrap()?.header();
        (header.run_id != first.run_id && header.step > 0).then_some(())
    });
    assert_eq!(player.interrupt().code, Some(0));
}

#[test]
fn a_recording_ends_at_its_limit_on_sigterm_and_when_another_run_starts() {
    let sandbox = Sandbox::new();
    let first = node(&sandbox, &["run", "curtain", "--paused"]);
    let (limited, ended, left) =
        (sandbox.path("limited.mcap"), sandbox.path("ended.mcap"), sandbox.path("left.mcap"));
    let args = ["record", "-o", &limited, "--steps", "5", "--json"];
    let by_limit = Process::start_ready(Program::Recorder, &sandbox, &args);
    let by_signal = record(&sandbox, &ended);
    let by_run = record(&sandbox, &left);
    ctl(&sandbox, &["step", "20"]);
    let report = by_limit.wait().json();
    assert_eq!((&report["first_step"], &report["last_step"]), (&0.into(), &5.into()));
    assert_eq!(frames(&limited).len(), 6);
    by_signal.signal(Signal::TERM);
    assert_eq!(by_signal.wait().code, Some(0));
    assert_eq!(frames(&ended).len(), 21);
    first.signal(Signal::KILL);
    first.wait();
    let _second = node(&sandbox, &["run", "curtain"]);
    assert_eq!(by_run.wait().code, Some(0));
    assert_eq!(frames(&left).len(), 21);
    for file in [&limited, &ended, &left] {
        assert_verifies(&sandbox, file);
    }
}

#[test]
fn playback_is_limited_to_the_range_from_start_to_end() {
    let sandbox = Sandbox::new();
    let (whole, part) = (sandbox.path("whole.mcap"), sandbox.path("part.mcap"));
    recorder(&sandbox, &["simulate", "curtain", "--steps", "720", "-o", &whole]).success();
    let args = ["play", &whole, "--start", "1s", "--end", "1500ms", "--wait-for-readers", "1"];
    let player = Process::start_ready(Program::Recorder, &sandbox, &args);
    let recording = record(&sandbox, &part);
    assert_eq!(player.wait().code, Some(0));
    assert_eq!(recording.wait().code, Some(0));
    let steps: Vec<_> = frames(&part).iter().map(|frame| frame.row.step).collect();
    assert_eq!(steps, (240..=360).collect::<Vec<_>>());
    assert_verifies(&sandbox, &part);
    let backwards = recorder(&sandbox, &["play", &whole, "--start", "2s", "--end", "1s"]);
    assert_eq!(backwards.code, Some(2));
}

#[test]
fn a_killed_recorder_leaves_a_file_that_verifies_as_far_as_it_was_written() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = node(&sandbox, &["run", "curtain", "--rate", "1000"]);
    let recording = record(&sandbox, &file);
    let part = format!("{file}.part");
    // The recorder flushes once per second; it is killed once a flush has reached the file.
    let flushed = wait_for("a flush with snapshots", || {
        let count = complete_frames(&part);
        (count > 1).then_some(count)
    });
    recording.signal(Signal::KILL);
    recording.wait();
    assert!(!Path::new(&file).exists());
    let info = recorder(&sandbox, &["info", &part]);
    assert_eq!(info.code, Some(3), "{}", info.stderr);
    let verified = recorder(&sandbox, &["verify", &part]);
    assert_eq!(verified.code, Some(3), "{}", verified.stderr);
    assert!(verified.stdout.contains("steps bit-identical"), "{}", verified.stdout);
    let steps: u64 = verified.stdout.split(' ').find_map(|word| word.parse().ok()).unwrap();
    assert!(steps + 1 >= flushed, "{steps} steps of {flushed} snapshots");
    // The file it left is not overwritten without a request.
    let again = recorder(&sandbox, &["record", "-o", &file]);
    assert_eq!(again.code, Some(1));
    assert!(again.stderr.contains("--overwrite"), "{}", again.stderr);
}

#[test]
fn simulate_reproduces_the_hashes_of_a_live_recording_and_writes_the_same_file_every_time() {
    let sandbox = Sandbox::new();
    let live = sandbox.path("live.mcap");
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let recording = record(&sandbox, &live);
    ctl(&sandbox, &["grab", "90", "0.5", "0.2", "0.3"]);
    ctl(&sandbox, &["step", "30"]);
    ctl(&sandbox, &["release", "90"]);
    ctl(&sandbox, &["pin", "91"]);
    ctl(&sandbox, &["step", "30"]);
    assert_eq!(recording.interrupt().code, Some(0));
    let simulate = |name: &str| {
        let file = sandbox.path(name);
        let args = ["simulate", &live, "--steps", "60", "--commands", &live, "-o", &file];
        recorder(&sandbox, &args).success();
        file
    };
    let (one, two) = (simulate("one.mcap"), simulate("two.mcap"));
    assert_eq!(std::fs::read(&one).unwrap(), std::fs::read(&two).unwrap());
    let hashes =
        |file: &str| frames(file).iter().map(|frame| frame.row.state_hash).collect::<Vec<_>>();
    assert_eq!(hashes(&one).len(), 61);
    assert_eq!(hashes(&one), hashes(&live));
    assert_eq!(assert_verifies(&sandbox, &one), 60);
    // The rows of /outcomes also serve as a command file.
    let rows = frames(&live).into_iter().flat_map(|frame| frame.updates);
    let lines = rows.filter_map(|update| match update {
        Message::Outcome(row) => Some(serde_json::to_string(&row).unwrap() + "\n"),
        _ => None,
    });
    let commands = sandbox.write("commands.jsonl", &lines.collect::<String>());
    let from_lines = sandbox.path("lines.mcap");
    let args = ["simulate", "curtain", "--steps", "60", "--commands", &commands, "-o", &from_lines];
    recorder(&sandbox, &args).success();
    assert_eq!(hashes(&from_lines), hashes(&live));
}
