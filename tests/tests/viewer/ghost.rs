//! A ghost in a replay: the states of another recording at the same steps, and the first difference.
//!
//! The recorder's library reads the expected states from the start of each file.

use std::fs;
use std::path::Path;

use integration_tests::{Process, Program, Sandbox};
use recording::{Closing, FrameReader, LogOptions, LogReader, LogWriter, Message as Logged};
use serde_json::{Value, json};
use sim_contract::ParticleState;
use viewer_bridge::wire::Ghost;

use super::page::{Bridge, Page};
use crate::wire_decoder::Message;

const STEPS: u64 = 480;
/// The commands of the changed recording.
const CHANGES: &str = r#"{"step":120,"kind":"set","parameter":"damping","value":3}
{"step":200,"kind":"cut","constraint":300}
{"step":300,"kind":"cut","constraint":20}
"#;

/// A recorded state: step, particles and torn constraints.
type State = (u64, Vec<ParticleState>, Vec<u32>);

fn simulate(sandbox: &Sandbox, name: &str, scene: &str, steps: u64, more: &[&str]) -> String {
    let (file, steps) = (sandbox.path(name), steps.to_string());
    let args = ["simulate", scene, "--steps", &steps, "-o", &file];
    Process::run(Program::Recorder, sandbox, &[&args, more].concat()).success();
    file
}

fn changed(sandbox: &Sandbox, name: &str) -> String {
    let commands = sandbox.write("changes.jsonl", CHANGES);
    simulate(sandbox, name, "curtain", STEPS, &["--commands", &commands])
}

fn states(file: &str) -> Vec<State> {
    let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    let (mut torn, mut states) = (Vec::new(), Vec::new());
    while let Some(frame) = frames.next_frame().unwrap() {
        for update in &frame.updates {
            if let Logged::Tears(row) = update {
                torn.extend(&row.constraints);
            }
        }
        states.push((frame.row.step, frame.payload().to_vec(), torn.clone()));
    }
    states
}

/// The particle that is farthest from its place in the other state, and its distance.
fn farthest(a: &State, b: &State) -> (usize, f64) {
    let squares = |a: &ParticleState, b: &ParticleState| {
        let axes = a.position.iter().zip(b.position);
        axes.map(|(a, b)| (f64::from(*a) - f64::from(b)).powi(2)).sum::<f64>()
    };
    let distances = a.1.iter().zip(&b.1).map(|(a, b)| squares(a, b).sqrt()).enumerate();
    distances.fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most })
}

/// Waits until the ghost has this state.
fn ghost_in(page: &mut Page, state: &str) -> Value {
    page.text_with("ghost", "state", &json!(state))
}

/// Seeks, and returns the ghost that the page receives with the frame of the step.
fn seek(page: &mut Page, step: u64) -> Option<Ghost> {
    page.send(&json!({ "kind": "seek", "step": step }));
    next_ghost(page, step)
}

/// Returns the ghost of the next frame of a step.
fn next_ghost(page: &mut Page, step: u64) -> Option<Ghost> {
    let mut ghost = None;
    page.receive("the frame of a step", |message| match message {
        Message::Ghost(one) => {
            ghost = Some(one);
            None
        }
        // A ghost belongs to the frame after it.
        Message::Frame(frame) => {
            let ghost = ghost.take();
            (frame.head.stamp.step == step).then_some(ghost)
        }
        _ => None,
    })
}

#[test]
fn a_ghost_has_the_states_of_the_other_recording_and_the_first_difference() {
    let sandbox = Sandbox::new();
    let shown = simulate(&sandbox, "shown.mcap", "curtain", STEPS, &[]);
    let other = changed(&sandbox, "changed.mcap");
    let (shown_states, other_states) = (states(&shown), states(&other));
    let first = shown_states.iter().zip(&other_states).find(|(a, b)| a != b).unwrap().0.0;

    let bridge = Bridge::start_with(&sandbox, &["--replay", &shown, "--ghost", &other]);
    let mut page = bridge.page();
    let ghost = ghost_in(&mut page, "different");
    assert_eq!((&ghost["name"], &ghost["given"]), (&json!("changed"), &json!("changed")));
    assert_eq!(ghost["first_different_step"], first);
    let text = ghost["text"].as_str().unwrap();
    assert!(text.starts_with(&format!("changed differs from step {first} (0.")), "{text}");
    // A paused replay shows the step on show only once, so the first seek goes elsewhere.
    for step in [first, 0, first - 1, 199, 201, 350, STEPS, 7, 300] {
        let index = usize::try_from(step).unwrap();
        let (at_shown, at_other) = (&shown_states[index], &other_states[index]);
        let ghost = seek(&mut page, step).unwrap();
        let positions: Vec<_> = at_other.1.iter().map(|one| one.position).collect();
        assert_eq!((ghost.stamp.step, ghost.positions), (step, positions), "at step {step}");
        assert_eq!(ghost.hidden, at_other.2, "at step {step}");
        let (particle, distance) = farthest(at_shown, at_other);
        assert_eq!(ghost.farthest as usize, particle, "at step {step}");
        assert!((f64::from(ghost.distance) - distance).abs() <= 1e-6 * distance, "at step {step}");
    }
    // A page that connects now learns the same.
    assert_eq!(ghost_in(&mut bridge.page(), "different")["first_different_step"], first);
}

#[test]
fn pages_choose_a_ghost_from_the_folder() {
    let sandbox = Sandbox::new();
    fs::create_dir(sandbox.path("runs")).unwrap();
    simulate(&sandbox, "runs/short.mcap", "curtain", 100, &[]);
    simulate(&sandbox, "runs/rope.mcap", "rope", 10, &[]);
    simulate(&sandbox, "runs/shown.mcap", "curtain", STEPS, &[]);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &sandbox.path("runs")]);
    let socket = "/replay/shown/socket";
    let mut page = bridge.page_at(socket);
    let none = page.text(|text| text["type"] == "ghost");
    assert_eq!((&none["state"], &none["text"]), (&json!("none"), &json!("")));
    assert_eq!(seek(&mut page, 3), None);

    page.send(&json!({ "kind": "ghost", "name": "short" }));
    let equal = ghost_in(&mut page, "equal");
    assert_eq!(equal["text"], "short: 101 common steps, equal in every bit");
    assert_eq!(equal["first_different_step"], Value::Null);
    let ghost = seek(&mut page, 100).unwrap();
    assert_eq!((ghost.stamp.step, ghost.distance), (100, 0.0));
    assert_eq!(seek(&mut page, 101), None, "the ghost ends before that step");

    page.send(&json!({ "kind": "ghost", "name": "rope" }));
    let failed = ghost_in(&mut page, "failed");
    let text = failed["text"].as_str().unwrap();
    assert!(text.contains("particles instead of 168; a ghost must be a recording"), "{text}");
    assert_eq!(seek(&mut page, 50), None);
    for name in ["missing", "../runs/short", ""] {
        let reason = page.rejected(json!({ "kind": "ghost", "name": name }));
        assert_eq!(reason, "unknown_recording", "{name}");
    }
    page.send(&json!({ "kind": "ghost" }));
    ghost_in(&mut page, "none");
}

/// Writes a recording with every fourth snapshot of another one.
fn every_fourth(sandbox: &Sandbox, file: &str) -> String {
    let sparse = sandbox.path("sparse.mcap");
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let (run, scene) = (log.run().clone(), log.scene().to_vec());
    let target = fs::File::create(&sparse).unwrap();
    let mut writer = LogWriter::create(target, LogOptions::default(), &run, &scene, 0).unwrap();
    while let Some(logged) = log.next_message().unwrap() {
        let message = logged.message;
        let is_snapshot = matches!(message, Logged::Step(_) | Logged::Particles { .. });
        if !is_snapshot || message.step() % 4 == 0 {
            writer.write(&message, logged.log_time_ns).unwrap();
        }
    }
    writer.finish(&Closing::default()).unwrap();
    sparse
}

#[test]
fn a_ghost_with_fewer_snapshots_shows_the_last_one_before_the_step() {
    let sandbox = Sandbox::new();
    let shown = simulate(&sandbox, "shown.mcap", "curtain", 24, &[]);
    let sparse = every_fourth(&sandbox, &shown);
    let bridge = Bridge::start_with(&sandbox, &["--replay", &shown, "--ghost", &sparse]);
    let mut page = bridge.page();
    assert_eq!(ghost_in(&mut page, "equal")["text"], "sparse: 7 common steps, equal in every bit");
    let ghost = seek(&mut page, 7).unwrap();
    assert_eq!(ghost.stamp.step, 4);
    assert!(ghost.distance.is_nan());
    assert_eq!(seek(&mut page, 8).map(|ghost| ghost.distance), Some(0.0));
}

#[test]
fn a_ghost_that_does_not_exist_is_refused_at_once() {
    let sandbox = Sandbox::new();
    let shown = simulate(&sandbox, "shown.mcap", "rope", 2, &[]);
    let missing = sandbox.path("missing.mcap");
    let args = ["--listen", "127.0.0.1:0", "--replay", &shown, "--ghost", &missing];
    let ended = Process::run(Program::ViewerBridge, &sandbox, &args);
    assert_eq!(ended.code, Some(1));
    assert!(
        ended.stderr.contains("missing.mcap: no such file; give --ghost a file"),
        "{}",
        ended.stderr
    );
}
