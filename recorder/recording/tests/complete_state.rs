//! The complete state of any step of a recording is that of a solver that has made the steps itself, also
//! between recorded snapshots, and a recording that does not lead to it is an error.

use std::fs;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use recording::simulation::{Job, States, simulate};
use recording::{
    Closing, CompleteState, CompleteStateError, LogOptions, LogReader, LogWriter, Message, Tape,
    Topic, complete_state, parse_commands,
};
use sim_host::Stop;
use sim_messages::scene_hash;
use sim_solver::{Keyframe, Scene, Solver, builtin};

const COMMANDS: &str = r#"
    {"step":10,"kind":"grab","particle":90,"target":[0.5,0.2,0.3],"over_s":0.25}
    {"step":20,"kind":"pause"}
    {"step":50,"kind":"cut","constraint":7}
    {"step":70,"kind":"release","particle":90}
    {"step":290,"kind":"pin","particle":160}
"#;
const STEPS: u64 = 400;
/// Steps between two recorded snapshots.
const STRIDE: u64 = 7;
/// The steps of the recorded keyframes. The last one has no snapshot.
const KEYFRAMES: [u64; 3] = [0, 70, 240];

fn job() -> Job {
    let scene = Scene::from_toml(builtin::text("curtain").unwrap(), "curtain").unwrap();
    Job::new(scene, parse_commands(COMMANDS, "test").unwrap(), STEPS)
}

/// Returns the state after each step of a solver that makes all of them.
fn solver_states() -> Vec<CompleteState> {
    let job = job();
    let scene_hash = scene_hash(job.scene.to_toml().as_bytes());
    let state = |solver: &Solver| CompleteState {
        scene_hash,
        particles: bytemuck::cast_slice(solver.particles()).to_vec(),
        keyframe: solver.keyframe().encode(),
        state_hash: solver.state_hash(),
    };
    let mut solver = Solver::new(&job.scene);
    let mut states = vec![state(&solver)];
    for step in 1..=STEPS {
        for command in job.commands.iter().filter(|command| command.step == step) {
            solver.apply(command.client_id, &command.action).unwrap();
        }
        solver.step();
        states.push(state(&solver));
    }
    states
}

/// A recording of every seventh snapshot.
struct Recording {
    path: PathBuf,
    tape: Tape,
}

impl Recording {
    /// Writes what `edit` returns for each message.
    fn write(name: &str, edit: impl Fn(Message) -> Option<Message>) -> Self {
        let job = job();
        let solver = Solver::new(&job.scene);
        let (run, scene) = (job.description(&solver), job.scene.to_toml());
        let create = |chunk_size_bytes| {
            let options = LogOptions { chunk_size_bytes, ..LogOptions::default() };
            LogWriter::create(Vec::new(), options, &run, scene.as_bytes(), 0).unwrap()
        };
        let mut whole = create(1 << 20);
        let states = States::first(solver);
        simulate(&job, states, Some(&mut whole), &AtomicBool::new(false), |_| {}).unwrap();
        let whole = whole.finish(&Closing::default()).unwrap();
        let mut whole = LogReader::new(whole.as_slice()).unwrap();
        let mut sparse = create(50_000);
        while let Some(logged) = whole.next_message().unwrap() {
            if let Some(message) = Some(logged.message).filter(is_recorded).and_then(&edit) {
                sparse.write(&message, logged.log_time_ns).unwrap();
            }
        }
        let name = format!("complete-state-{name}-{}.mcap", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::write(&path, sparse.finish(&Closing::default()).unwrap()).unwrap();
        let tape = Tape::open(&path, None, &mut |_, _| ()).unwrap();
        Self { path, tape }
    }

    fn state(&mut self, step: u64) -> Result<CompleteState, CompleteStateError> {
        complete_state(&mut self.tape, step, u64::MAX, &Stop::default())
    }

    fn error(&mut self, step: u64) -> String {
        self.state(step).unwrap_err().to_string()
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        fs::remove_file(&self.path).unwrap();
    }
}

fn is_recorded(message: &Message) -> bool {
    match message {
        Message::Keyframe { step, .. } => KEYFRAMES.contains(step),
        Message::Step(_) | Message::Particles { .. } => message.step().is_multiple_of(STRIDE),
        _ => true,
    }
}

#[test]
fn the_state_of_every_step_is_that_of_a_solver_that_made_the_steps() {
    let mut recording = Recording::write("all", Some);
    let states = solver_states();
    // 0 and 70 have a keyframe, 77 and 399 a snapshot, and the others neither.
    for step in [0, 3, 9, 10, 15, 20, 49, 50, 69, 70, 71, 77, 239, 240, 241, 289, 290, 398, 399] {
        let expected = &states[usize::try_from(step).unwrap()];
        let mut found = recording.state(step).unwrap();
        let mut keyframe = Keyframe::decode(&found.keyframe).unwrap();
        // The keyframe of step 70 is that of a solver, which never pauses.
        assert_eq!(keyframe.paused, (20..70).contains(&step), "step {step}");
        keyframe.paused = false;
        found.keyframe = keyframe.encode();
        assert!(found == *expected, "step {step}");
    }
}

#[test]
fn a_step_that_the_recording_does_not_reach_is_an_error() {
    let mut recording = Recording::write("reach", Some);
    assert_eq!(recording.error(400), "ends before step 400");
    let error = complete_state(&mut recording.tape, 100, 29, &Stop::default());
    let text = "step 100 takes 30 steps from the last complete state (allowed: up to 29)";
    assert_eq!(error.unwrap_err().to_string(), text);
    let mut late = Recording::write("late", |message| {
        let is_first = matches!(&message, Message::Keyframe { step: 0, .. });
        (!is_first).then_some(message)
    });
    assert_eq!(late.error(69), "has no complete state up to step 69 to start from");
    late.state(70).unwrap();
}

#[test]
fn a_state_between_two_snapshots_is_proved_by_the_next_one() {
    let mut changed = Recording::write("changed", |mut message| {
        if let Message::Particles { step: 105, particles } = &mut message {
            particles[150].position[0] += 1e-6;
        }
        Some(message)
    });
    changed.state(98).unwrap();
    for step in [99, 104, 105, 106] {
        let error = changed.error(step);
        assert!(error.starts_with("step 105 cannot be simulated: /particles: "), "{error}");
    }
}

/// Its readers share the open file, so none continues in the new one at a byte of the old one.
#[test]
fn an_open_recording_stays_the_same_when_another_file_gets_its_name() {
    let mut recording = Recording::write("replaced", Some);
    let is_kept = |message: &Message| message.step() > 0 || message.topic() != Topic::Keyframe;
    let other = Recording::write("replacing", |message| Some(message).filter(is_kept));
    let expected = recording.state(100).unwrap();
    fs::rename(&other.path, &recording.path).unwrap();
    fs::write(&other.path, "removed at the end of the test").unwrap();
    assert_eq!(recording.state(100).unwrap(), expected);
}

#[test]
fn missing_outcomes_are_an_error_up_to_the_next_complete_state() {
    let mut incomplete = Recording::write("incomplete", |message| {
        let is_cut = matches!(&message, Message::Outcome(row) if row.step == 50);
        (!is_cut).then_some(message)
    });
    incomplete.state(49).unwrap();
    let error = incomplete.error(52);
    assert!(error.contains("/outcomes: outcome 2 is missing"), "{error}");
    incomplete.state(70).unwrap();
}

#[test]
fn a_damaged_keyframe_is_an_error() {
    let mut damaged = Recording::write("damaged", |mut message| {
        if let Message::Keyframe { step: 70, bytes } = &mut message {
            bytes.truncate(10);
        }
        Some(message)
    });
    damaged.state(63).unwrap();
    assert!(damaged.error(71).starts_with("step 70: the message on /keyframe: "));
}
