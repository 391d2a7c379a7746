//! A recorder in the lockstep loses nothing, however fast a replay or a node could go.

use std::fmt::Write;
use std::path::Path;

use integration_tests::{Process, Program, Sandbox, ctl};
use recording::{Frame, FrameReader, LogReader, Message};

const STEPS: u64 = 1500;

fn frames(file: &str) -> Vec<Frame> {
    let mut reader = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    std::iter::from_fn(|| reader.next_frame().unwrap()).collect()
}

/// The rows of colliders, tears and parameters after the first snapshot.
fn changes(frames: &[Frame]) -> Vec<Message> {
    let updates = frames[1..].iter().flat_map(|frame| frame.updates.clone());
    let is_change = |message: &Message| {
        matches!(message, Message::Colliders(_) | Message::Tears(_) | Message::Parameters(_))
    };
    updates.filter(is_change).collect()
}

/// Simulates a scene whose collider moves and whose damping changes in every step.
fn recording(sandbox: &Sandbox) -> String {
    let scene = "version = 1\n[[collider]]\nshape = \"sphere\"\ncenter = [0, -0.5, 0]\nradius = 0.2\n\
                 [[generate]]\nshape = \"cloth\"\ncolumns = 8\nrows = 8\nspacing = 0.1\n";
    let scene = sandbox.write("ball.toml", scene);
    let mut commands = String::new();
    for step in 1..STEPS {
        let (height, damping) = (step as f32 * 1e-4, step as f32 * 1e-3);
        writeln!(
            commands,
            r#"{{"step":{step},"kind":"move_collider","collider":0,"translation":[0,{height},0]}}"#
        )
        .unwrap();
        writeln!(
            commands,
            r#"{{"step":{step},"kind":"set","parameter":"damping","value":{damping}}}"#
        )
        .unwrap();
    }
    let (commands, file) = (sandbox.write("commands.jsonl", &commands), sandbox.path("run.mcap"));
    let steps = STEPS.to_string();
    let args = ["simulate", &scene, "--steps", &steps, "--commands", &commands, "-o", &file];
    Process::run(Program::Recorder, sandbox, &args).success();
    file
}

#[test]
fn a_recorder_in_lockstep_copies_a_replay_without_a_loss_as_fast_as_it_can() {
    let sandbox = Sandbox::new();
    let (file, copy) = (recording(&sandbox), sandbox.path("copy.mcap"));
    let args = ["play", &file, "--rate", "max", "--wait-for-readers", "1"];
    let player = Process::start_ready(Program::Recorder, &sandbox, &args);
    let args = ["record", "--lockstep", "--json", "-o", &copy];
    let report = Process::run(Program::Recorder, &sandbox, &args).json();
    player.wait().success();
    assert_eq!(report["lost"], serde_json::json!({}), "{report}");
    let (one, two) = (frames(&file), frames(&copy));
    let rows = |frames: &[Frame]| frames.iter().map(|frame| frame.row).collect::<Vec<_>>();
    assert_eq!(rows(&one), rows(&two));
    assert_eq!(changes(&one), changes(&two));
    assert!(one.iter().zip(&two).all(|(one, two)| one.payload() == two.payload()));
    Process::run(Program::Recorder, &sandbox, &["verify", &copy]).success();
}

#[test]
fn a_recorder_in_lockstep_loses_nothing_of_a_node_without_deadlines() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("fast.mcap");
    let args = ["run", "curtain", "--as-fast-as-possible", "--paused", "--steps", "3000"];
    let node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let args = ["record", "--lockstep", "-o", &file];
    let mut recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    recording.wait_for_line("recording from step 0");
    ctl(&sandbox, &["resume"]);
    node.wait().success();
    recording.wait().success();
    let steps: Vec<_> = frames(&file).iter().map(|frame| frame.row.step).collect();
    assert_eq!(steps, (0..=3000).collect::<Vec<_>>());
}
