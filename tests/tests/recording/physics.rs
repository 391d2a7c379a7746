//! Tears, colliders, meshes and a load in recordings of a live node: a late recorder records the state before
//! it attached, the file ends with the load, and a recording of its playback has the same rows.

use std::path::Path;

use integration_tests::{Process, Program, Sandbox, record, wait_for};
use recording::{Frame, FrameReader, LogReader, Message, StepRow};

use super::losses::recorded_steps;

/// A cloth over a ball, always in motion.
const SCENE: &str = r#"
version = 1
name = "net"

[solver]
rate_hz = 240
substeps = 2

[[collider]]
shape = "sphere"
center = [0.2, -0.2, 0.3]
radius = 0.1

[[generate]]
shape = "cloth"
columns = 6
rows = 6
spacing = 0.1
mass = 0.02
"#;

fn ctl(sandbox: &Sandbox, commands: &[&str]) {
    for command in commands {
        let args: Vec<_> = ["ctl"].into_iter().chain(command.split(' ')).collect();
        Process::run(Program::SimNode, sandbox, &args).success();
    }
}

/// Reads all snapshots of a recording.
fn frames(file: &str) -> Vec<Frame> {
    let mut reader = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    std::iter::from_fn(|| reader.next_frame().unwrap()).collect()
}

/// Returns the rows of tears, colliders and outcomes, and the initially torn constraints. Sorted,
/// because a paused node answers a command long before the step that shows it.
fn side_rows(frames: &[Frame]) -> Vec<String> {
    let text = |update: &Message| match update {
        Message::Topology(row) => Some(format!("torn before {:?}", row.torn)),
        Message::Tears(row) => Some(format!("{row:?}")),
        Message::Colliders(row) => Some(format!("{row:?}")),
        Message::Outcome(row) => Some(format!("{row:?}")),
        _ => None,
    };
    let mut rows: Vec<_> =
        frames.iter().flat_map(|frame| frame.updates.iter().filter_map(text)).collect();
    rows.sort();
    rows
}

/// Returns the torn constraints of each step with tears.
fn tears(frames: &[Frame]) -> Vec<(u64, Vec<u32>)> {
    let rows = frames.iter().flat_map(|frame| &frame.updates).filter_map(|update| match update {
        Message::Tears(row) => Some((row.step, row.constraints.clone())),
        _ => None,
    });
    rows.collect()
}

fn assert_verifies(sandbox: &Sandbox, file: &str) {
    let verified = Process::run(Program::Recorder, sandbox, &["verify", "--json", file]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
}

#[test]
fn a_late_recording_with_tears_a_reset_and_a_load_verifies_and_plays_back_row_for_row() {
    let sandbox = Sandbox::new();
    let (first, second) = (sandbox.path("first.mcap"), sandbox.path("second.mcap"));
    let scene = sandbox.write("net.toml", SCENE);
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene, "--paused"]);
    // All of this happens before the recorder attaches.
    ctl(&sandbox, &["cut 9", "move-collider 0 0 0 -0.1", "step", "cut 4", "step 3"]);
    let recording = record(&sandbox, &first);
    ctl(&sandbox, &["step 5", "cut 20", "cut 11", "step 2", "move-collider 0 0 0 -0.2", "step 4"]);
    ctl(&sandbox, &["reset", "cut 9", "step", "cut 4", "step 3", "load curtain"]);
    // Another scene needs another file, so the recording ends with the load.
    recording.wait().success();
    node.interrupt().success();
    assert_verifies(&sandbox, &first);
    let one = frames(&first);
    assert!(side_rows(&one).contains(&"torn before [9, 4]".to_owned()));
    let reset_at = one.iter().find(|frame| frame.row.scene_step == 0).unwrap().row.step;
    let expected = [(10, vec![11, 20]), (reset_at + 1, vec![9]), (reset_at + 2, vec![4])];
    assert_eq!(tears(&one), expected);

    // Step by step, because five lists of tears follow each other, and a late reader keeps the newest
    // four.
    let play = ["play", &first, "--paused"];
    let player = Process::start_ready(Program::Recorder, &sandbox, &play);
    let recording = record(&sandbox, &second);
    let part = format!("{second}.part");
    // The replay stays at the last step until it is resumed. The recording ends with the replay.
    for frame in &one[..one.len() - 1] {
        let step = frame.row.step;
        wait_for("the step in the file", || recorded_steps(&part).contains(&step).then_some(()));
        ctl(&sandbox, &["step"]);
    }
    ctl(&sandbox, &["resume"]);
    player.wait().success();
    recording.wait().success();
    let two = frames(&second);
    assert_eq!(side_rows(&two), side_rows(&one));
    // The replay is a run of its own, which numbers its snapshots from 0.
    let row = |(index, frame): (u32, &Frame)| StepRow { snapshot_index: index, ..frame.row };
    let rows = |frames: &[Frame]| (0..).zip(frames).map(row).collect::<Vec<_>>();
    assert_eq!(rows(&two), rows(&one));
    assert!((0..).zip(&two).all(|(index, frame)| frame.row.snapshot_index == index));
    assert_verifies(&sandbox, &second);
}

/// A grid of particles that falls on a mesh from a file.
const ON_A_MESH: &str = r#"
version = 1

[solver]
substeps = 2

[[collider]]
shape = "mesh"
path = "tent.obj"
scale = 0.5
friction = 0.3

[[generate]]
shape = "cloth"
columns = 6
rows = 6
spacing = 0.1
origin = [-0.25, 0.15, -0.25]
down = [0, 0, 1]
pinned = "none"
"#;

#[test]
fn a_recording_with_a_mesh_verifies_plays_and_goes_on_without_its_file() {
    let sandbox = Sandbox::new();
    let tent =
        "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv 0 0.3 0\nf 1 5 2\nf 2 5 3\nf 3 5 4\nf 4 5 1\n";
    let mesh = sandbox.write("tent.obj", tent);
    let scene = sandbox.write("tent.toml", ON_A_MESH);
    let file = sandbox.path("tent.mcap");
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene, "--paused"]);
    let recording = record(&sandbox, &file);
    ctl(&sandbox, &["step 40", "move-collider 0 0 0.01 0", "step 40"]);
    assert_eq!(recording.interrupt().code, Some(0));
    assert_eq!(node.interrupt().code, Some(0));
    std::fs::remove_file(&mesh).unwrap();
    std::fs::remove_file(&scene).unwrap();
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    assert!(verified.contains("80 steps bit-identical"), "{verified}");
    let again = sandbox.path("again.mcap");
    let args = ["simulate", &file, "--steps", "80", "--commands", &file, "-o", &again];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let hash = |file: &str| frames(file).last().unwrap().row.state_hash;
    assert_eq!(hash(&again), hash(&file));
    // A cloth that has met no mesh would be 0.5 m lower.
    let last = frames(&file).pop().unwrap();
    let heights = last.particles.unwrap().into_iter().map(|one| one.position[1]);
    assert!(heights.fold(f32::INFINITY, f32::min) > -0.05);
    // The pictures have the four triangles of the mesh beside the 50 of the cloth.
    let folder = sandbox.path("pictures");
    let args = ["export", &file, "--svg", &folder, "--at", "0"];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let picture = std::fs::read_dir(&folder).unwrap().next().unwrap().unwrap().path();
    assert_eq!(std::fs::read_to_string(picture).unwrap().matches("<polygon").count(), 54);
}
