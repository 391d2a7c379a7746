//! `recorder play` goes to any recorded step, with the complete state of that step for every reader.

use std::path::Path;
use std::time::Duration;

use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, ctl, wait_for};
use recording::{Frame, FrameReader, LogReader, Message};
use sim_contract::{Client, ParameterValues, Tap};

/// Commands of every kind that changes more than particles.
const COMMANDS: &str = r#"{"step":100,"kind":"cut","constraint":40}
{"step":200,"kind":"pin","particle":90}
{"step":300,"kind":"set","parameter":"damping","value":0.5}
{"step":400,"kind":"cut_radius","center":[0.3,0.3,0],"radius":0.1}
{"step":500,"kind":"reset"}
{"step":550,"kind":"cut","constraint":7}
"#;
const STEPS: u64 = 1200;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

fn recording(sandbox: &Sandbox) -> String {
    let commands = sandbox.write("commands.jsonl", COMMANDS);
    let file = sandbox.path("run.mcap");
    let steps = STEPS.to_string();
    let args = ["simulate", "curtain", "--steps", &steps, "--commands", &commands, "-o", &file];
    recorder(sandbox, &args).success();
    file
}

/// A state as the file has it.
#[derive(Debug, Clone, PartialEq)]
struct Recorded {
    hash: u64,
    particles: Vec<u8>,
    torn: Vec<u32>,
    parameters: ParameterValues,
}

/// Reads every state from the start of the file, without the reader of single steps.
fn states(file: &str) -> Vec<Recorded> {
    let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    let (mut torn, mut parameters) = (Vec::new(), ParameterValues::default());
    let mut states = Vec::new();
    while let Some(frame) = frames.next_frame().unwrap() {
        apply(&frame, &mut torn, &mut parameters);
        let particles = bytemuck::cast_slice(frame.payload()).to_vec();
        states.push(Recorded {
            hash: frame.row.state_hash,
            particles,
            torn: torn.clone(),
            parameters: parameters.clone(),
        });
    }
    states
}

fn apply(frame: &Frame, torn: &mut Vec<u32>, parameters: &mut ParameterValues) {
    if frame.updates.iter().any(|update| update.replacement_step().is_some()) {
        torn.clear();
    }
    for update in &frame.updates {
        match update {
            Message::Tears(row) => torn.extend(&row.constraints),
            Message::Parameters(row) => parameters.clone_from(&row.values),
            _ => {}
        }
    }
}

/// Waits for the next state of another run, and returns the run, the step and the state.
fn next_run(tap: &mut Tap, run_id: u64) -> (u64, u64, Recorded) {
    wait_for("a state of another run", || {
        tap.wait(Duration::from_millis(20));
        let state = tap.next_state(|_| {})?;
        let header = *state.header;
        (header.run_id != run_id).then(|| {
            let recorded = Recorded {
                hash: header.state_hash,
                particles: bytemuck::cast_slice(state.particles).to_vec(),
                torn: state.torn.indices().collect(),
                parameters: state.parameters.values.clone(),
            };
            (header.run_id, header.step, recorded)
        })
    })
}

#[test]
fn a_reader_sees_the_recorded_state_of_the_place_after_each_seek() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let states = states(&file);
    let _player = Process::start_ready(Program::Recorder, &sandbox, &["play", &file, "--paused"]);
    let mut tap = Tap::attach(&sandbox.endpoint()).unwrap();
    let (mut run_id, ..) = next_run(&mut tap, 0);
    // Forward and back; before, at and after each command; the ends.
    for step in [650, 99, 100, 299, 300, 450, 499, 500, 549, 550, 1, 1200, 0, 401] {
        let outcome = ctl(&sandbox, &["rewind", "--to-step", &step.to_string()]);
        assert_eq!((&outcome["status"], outcome["step"].as_u64()), (&"applied".into(), Some(step)));
        let (new_run_id, shown_step, shown) = next_run(&mut tap, run_id);
        run_id = new_run_id;
        assert_eq!(shown_step, step);
        let expected = &states[usize::try_from(step).unwrap()];
        assert!(shown == *expected, "step {step}: {:?} {:?}", shown.torn, expected.torn);
    }
    assert_eq!(ctl(&sandbox, &["rewind", "0.5s"])["to_step"], 281);
    let (run_id, step, _) = next_run(&mut tap, run_id);
    assert_eq!(step, 281);
    // The replay goes on from there within the run.
    ctl(&sandbox, &["step", "2"]);
    for step in [282, 283] {
        let state = wait_for("the next state", || {
            tap.wait(Duration::from_millis(20));
            tap.next_state(|_| {}).map(|state| (state.header.run_id, state.header.step))
        });
        assert_eq!(state, (run_id, step));
    }
}

#[test]
fn a_command_without_an_effect_is_rejected_with_the_reason() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let args = ["play", &file, "--paused", "--start", "1s", "--end", "4s"];
    let _player = Process::start_ready(Program::Recorder, &sandbox, &args);
    for (command, reason) in [
        (&["rewind", "--to-step", "961"][..], "out_of_range"),
        (&["rewind", "--to-step", "239"], "out_of_range"),
        (&["rewind", "--to-step", "18446744073709551615"], "out_of_range"),
        (&["rewind", "1h"], "out_of_range"),
        (&["set", "time_scale", "0"], "out_of_range"),
        (&["set", "time_scale", "0.009"], "out_of_range"),
        (&["set", "time_scale", "101"], "out_of_range"),
        (&["set", "damping", "1"], "no_effect_here"),
        (&["reset"], "no_effect_here"),
    ] {
        let outcome = ctl(&sandbox, command);
        assert_eq!(outcome["reason"], reason, "{command:?}");
        assert_eq!(ctl(&sandbox, &["hash"])["step"], 240, "{command:?} moves nothing");
    }
    for value in ["0.01", "100", "2.5"] {
        assert_eq!(ctl(&sandbox, &["set", "time_scale", value])["status"], "applied");
        let scale = ctl(&sandbox, &["status"])["time_scale"].as_f64().unwrap();
        assert!((scale - value.parse::<f64>().unwrap()).abs() < 1e-6, "{scale}");
    }
    let text = Process::run(Program::SimNode, &sandbox, &["ctl", "rewind", "--to-step", "1"]);
    assert!(text.stdout.contains("(allowed: a step of the recording)"), "{}", text.stdout);
    let text = Process::run(Program::SimNode, &sandbox, &["ctl", "set", "time_scale", "0.001"]);
    assert!(text.stdout.contains("(allowed: 0.01 to 100)"), "{}", text.stdout);
}

#[test]
fn a_paused_replay_stays_at_its_last_snapshot_until_it_is_resumed() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let player = Process::start_ready(Program::Recorder, &sandbox, &["play", &file, "--paused"]);
    assert_eq!(ctl(&sandbox, &["rewind", "--to-step", "1199"])["status"], "applied");
    ctl(&sandbox, &["step", "1"]);
    assert_eq!(ctl(&sandbox, &["hash"])["step"], STEPS);
    assert_eq!(ctl(&sandbox, &["rewind", "--to-step", "3"])["status"], "applied");
    assert_eq!(ctl(&sandbox, &["hash"])["step"], 3);
    ctl(&sandbox, &["rewind", "--to-step", "1200"]);
    ctl(&sandbox, &["resume"]);
    player.wait().success();
}

#[test]
fn steps_beyond_the_end_say_where_the_replay_has_ended() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let args = ["play", &file, "--paused", "--start", "4990ms"];
    let _player = Process::start_ready(Program::Recorder, &sandbox, &args);
    let step = |count| Process::run(Program::SimNode, &sandbox, &["ctl", "step", count]);
    let beyond = step("9");
    assert_eq!(beyond.code, Some(1), "{beyond:?}");
    let expected =
        "error: the replay has ended at step 1200, its last snapshot, before step 1206\n";
    assert_eq!(beyond.stderr, expected);
    assert_eq!(ctl(&sandbox, &["hash"])["step"], STEPS);
    let at_end = step("1");
    assert_eq!(at_end.code, Some(4), "{at_end:?}");
    assert!(at_end.stdout.contains("the replay stands at its last snapshot"), "{at_end:?}");
    ctl(&sandbox, &["rewind", "--to-step", "1199"]);
    assert_eq!(step("1").code, Some(0));
}

#[test]
fn the_time_scale_of_a_replay_is_its_rate() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let args = ["play", &file, "--paused", "--rate", "0.25"];
    let _player = Process::start_ready(Program::Recorder, &sandbox, &args);
    assert_eq!(ctl(&sandbox, &["get", "time_scale"])["time_scale"], 0.25);
    ctl(&sandbox, &["set", "time_scale", "2.5"]);
    assert_eq!(ctl(&sandbox, &["get"])["time_scale"], 2.5);
}

#[test]
fn recordings_beside_seeks_verify_and_begin_a_file_at_each() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let player = Process::start_ready(Program::Recorder, &sandbox, &["play", &file, "--paused"]);
    let (all, first) = (sandbox.path("all.mcap"), sandbox.path("first.mcap"));
    let start = |args: &[&str]| {
        let mut recording = Process::start_ready(Program::Recorder, &sandbox, args);
        recording.wait_for_line("recording from step 0");
        recording
    };
    let following = start(&["record", "-o", &all, "--follow", "--json"]);
    let single = start(&["record", "-o", &first]);
    ctl(&sandbox, &["step", "30"]);
    // At a keyframe, at a command, and between keyframes.
    for step in [480, 200, 733] {
        ctl(&sandbox, &["rewind", "--to-step", &step.to_string()]);
        ctl(&sandbox, &["step", "30"]);
    }
    ctl(&sandbox, &["rewind", "--to-step", "1200"]);
    ctl(&sandbox, &["resume"]);
    player.wait().success();
    single.wait().success();
    let following = following.interrupt();
    assert_eq!(following.code, Some(0), "{following:?}");
    let report: serde_json::Value = serde_json::from_str(&following.stdout).unwrap();
    assert_eq!(report["lost"], serde_json::json!({}), "{report}");
    assert_eq!(steps(&first), (0..=30).collect::<Vec<_>>());
    for (number, begin) in [0, 480, 200, 733, 1200].into_iter().enumerate() {
        let file = sandbox.path(&format!("all_{number:04}.mcap"));
        let end = if begin == STEPS { begin } else { begin + 30 };
        assert_eq!(steps(&file), (begin..=end).collect::<Vec<_>>(), "{file}");
        recorder(&sandbox, &["check", &file]).success();
        recorder(&sandbox, &["verify", &file]).success();
    }
}

fn steps(file: &str) -> Vec<u64> {
    let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    std::iter::from_fn(|| frames.next_frame().unwrap()).map(|frame| frame.row.step).collect()
}

#[test]
fn a_connected_client_reads_on_after_a_seek() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let _player = Process::start_ready(Program::Recorder, &sandbox, &["play", &file, "--loop"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.next_snapshot(DEADLINE).unwrap().unwrap();
    ctl(&sandbox, &["rewind", "--to-step", "900"]);
    wait_for("a step after the place", || {
        (client.next_snapshot(DEADLINE).unwrap()?.header().step >= 900).then_some(())
    });
    assert!(client.is_owner_alive());
    assert_eq!(client.topology(DEADLINE).unwrap().unwrap().constraints.len(), 596);
    // The reset at step 500 has mended all earlier tears.
    let torn: Vec<_> = client.torn(DEADLINE).unwrap().indices().collect();
    assert_eq!(torn, [7]);
}

#[test]
fn a_recorder_that_follows_a_jump_between_keyframes_misses_nothing() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    let _play = Process::start_ready(Program::Recorder, &sandbox, &["play", &file, "--paused"]);
    let output = sandbox.path("follow.mcap");
    let args = ["record", "--json", "--follow", "--lockstep", "-o", &output];
    let mut recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    recording.wait_for_line("recording from step 0");
    // The keyframes around it are those of steps 240 and 300.
    ctl(&sandbox, &["rewind", "--to-step", "250"]);
    ctl(&sandbox, &["step", "100"]);
    wait_for("the last step", || (ctl(&sandbox, &["status"])["step"] == 350).then_some(()));
    let report = recording.interrupt().recorded();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!((&report["files"], &report["last_step"]), (&2.into(), &350.into()), "{report}");
    assert_eq!(report["lost"], serde_json::json!({}), "{report}");
}
