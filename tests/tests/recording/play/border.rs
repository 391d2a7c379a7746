//! A replay loses nothing at the border of two files that leave out snapshots. Where a node publishes only
//! some, the last messages of a file follow its last snapshot.

use std::path::Path;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl, wait_for};
use recording::{FrameReader, LogReader, Message};
use sim_contract::{Action, Change, Client, ColliderState, ParameterValues, Tap};

use crate::recording::files::steps;

/// A cloth that falls onto a ball. A node publishes a keyframe each second: every 60 steps.
const SCENE: &str = r#"
version = 1

[solver]
rate_hz = 60

[[collider]]
shape = "sphere"
center = [0.45, -0.2, 0.45]
radius = 0.15

[[generate]]
shape = "cloth"
columns = 50
rows = 50
spacing = 0.02
down = [0, 0, 1]
pinned = "corners"
"#;

/// State that a reader knows with a snapshot.
#[derive(Debug, Default, Clone, PartialEq)]
struct Known {
    step: u64,
    /// According to the header of the snapshot.
    torn_count: usize,
    torn: Vec<u32>,
    colliders: Vec<ColliderState>,
    parameters: ParameterValues,
    /// Steps and indices of all outcomes so far.
    outcomes: Vec<(u64, u64)>,
}

impl Known {
    fn apply(&mut self, message: &Message) {
        match message {
            Message::Tears(row) => self.torn.extend(&row.constraints),
            Message::Colliders(row) => self.colliders = row.states(),
            Message::Parameters(row) => self.parameters.clone_from(&row.values),
            Message::Outcome(row) => self.outcomes.push((row.step, row.index)),
            _ => {}
        }
    }
}

/// Records a run in several files, without the snapshots that the options leave out. A move has no keyframe, so
/// its snapshot is left out, and the last files begin at the node's keyframe of each second.
fn split(sandbox: &Sandbox, node_args: &[&str], recorder_args: &[&str]) -> Vec<String> {
    let scene = sandbox.write("ball.toml", SCENE);
    let args = [&["run", &scene, "--paused"], node_args].concat();
    let node = Process::start_ready(Program::SimNode, sandbox, &args);
    let file = sandbox.path("run.mcap");
    let args = ["record", "-o", &file, "--split-size", "64KiB", "--compression", "none"];
    let args = [&args[..], recorder_args].concat();
    let mut recording = Process::start_ready(Program::Recorder, sandbox, &args);
    recording.wait_for_line("recording from step 0");
    ctl(sandbox, &["resume"]);
    ctl(sandbox, &["move-collider", "0", "0", "0.05", "0"]);
    ctl(sandbox, &["set", "tear_stretch", "1.01"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let (particle, target, over_s) = (1275, [0.5, 0.3, 0.5], 0.1);
    client.request(Action::Grab { particle, target, over_s }, DEADLINE).unwrap();
    let path = |number: usize| sandbox.path(&format!("run_{number:04}.mcap"));
    let has_begun = |number: &usize| {
        Path::new(&path(*number)).exists()
            || Path::new(&path(*number)).with_extension("mcap.part").exists()
    };
    let file_count = || (0..usize::MAX).take_while(has_begun).count();
    let count_before = file_count();
    wait_for("three more files", || {
        client.request(Action::Move { particle, target, over_s }, DEADLINE).unwrap();
        (file_count() >= count_before + 3).then_some(())
    });
    recording.interrupt().success();
    node.interrupt().success();
    (0..file_count()).map(path).collect()
}

/// Reads what a reader knows with each snapshot, and the number of outcomes after the last snapshots of files.
fn read(files: &[String]) -> (Vec<Known>, usize) {
    let (mut known, mut all, mut trailing_count) = (Known::default(), Vec::new(), 0);
    // A message can precede an earlier snapshot in the file.
    let mut messages: Vec<Message> = Vec::new();
    for file in files {
        let mut frames = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
        while let Some(frame) = frames.next_frame().unwrap() {
            let step = frame.row.step;
            messages.extend(frame.updates);
            let due: Vec<_> = messages.extract_if(.., |one| one.step() <= step).collect();
            for message in &due {
                known.apply(message);
            }
            (known.step, known.torn_count) = (step, frame.row.torn_count as usize);
            all.push(known.clone());
        }
        let trailing = frames.trailing_updates();
        let is_outcome = |message: &&Message| matches!(message, Message::Outcome(_));
        trailing_count += trailing.iter().filter(is_outcome).count();
        messages.extend_from_slice(trailing);
    }
    (all, trailing_count)
}

/// Plays files, and returns what a reader knows with each snapshot.
fn played(sandbox: &Sandbox, files: &[String]) -> Vec<Known> {
    let args = ["play", "--wait-for-readers", "1", "--rate", "max"];
    let args: Vec<_> = args.into_iter().chain(files.iter().map(String::as_str)).collect();
    let mut player = Process::start_ready(Program::Recorder, sandbox, &args);
    let mut tap = Tap::attach_in_lockstep(&sandbox.endpoint()).unwrap();
    let (mut known, mut all) = (Known::default(), Vec::new());
    wait_for("the end of the replay", || {
        tap.wait(Duration::from_millis(20));
        let is_running = player.is_running();
        while let Some(state) = tap.next_state(|_| {}) {
            known.step = state.header.step;
            known.torn_count = state.header.torn_count as usize;
            known.torn = state.torn.indices().collect();
            known.colliders.clone_from(&state.colliders.colliders);
            known.parameters.clone_from(&state.parameters.values);
            known.outcomes.extend(state.changes.iter().filter_map(|change| match change {
                Change::Outcome(outcome) => Some((outcome.step, outcome.index)),
                _ => None,
            }));
            all.push(known.clone());
        }
        tap.ready().unwrap();
        (!is_running).then_some(())
    });
    player.wait().success();
    all
}

#[test]
fn changes_between_the_last_snapshot_of_a_file_and_the_first_of_the_next_are_played() {
    let every = ["--every", "40"];
    for (node_args, recorder_args) in [(&[][..], &every[..]), (&every, &[])] {
        let sandbox = Sandbox::new();
        let files = split(&sandbox, node_args, recorder_args);
        let (recorded, trailing_count) = read(&files);
        assert!(recorded.last().unwrap().outcomes.len() > 20, "there are commands");
        if recorder_args.is_empty() {
            assert!(trailing_count > 20, "{trailing_count}: there are outcomes between the files");
        } else {
            for pair in files.windows(2) {
                let [last, first] = [steps(&pair[0]).pop(), steps(&pair[1]).first().copied()];
                assert_eq!(last.map(|step| step + 1), first, "a file ends with its last snapshot");
            }
        }
        let shown = played(&sandbox, &files);
        assert_eq!(shown.len(), recorded.len(), "each snapshot");
        for (shown, recorded) in shown.iter().zip(&recorded) {
            let step = shown.step;
            assert_eq!((step, shown.torn.len()), (recorded.step, shown.torn_count));
            assert!(shown == recorded, "step {step} with {node_args:?} and {recorder_args:?}");
        }
    }
}
