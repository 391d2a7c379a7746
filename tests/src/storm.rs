//! Random commands of several clients at the same time, good and bad, with rewinds and given states.

use std::fs;
use std::path::Path;

use fastrand::Rng;
use recording::{FrameReader, LogReader};
use sim_contract::{
    Action, Client, ELEMENTS_MAX, Endpoint, GivenState, MovedObject, Outcome, Part, ParticleState,
    PathPart, PathPoint, Reason, RestoreContents, scene_hash,
};

use crate::process::{Process, ctl, record};
use crate::programs::Program;
use crate::sandbox::Sandbox;
use crate::wait::DEADLINE;

/// The size of a storm.
#[derive(Debug, Clone, Copy)]
pub struct Storm {
    /// Number of clients.
    pub clients: u64,
    /// Number of commands of each client.
    pub commands: u64,
}

/// Numbers of outcomes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Counts {
    /// Number of applied commands.
    pub applied: u64,
    /// Number of rejected commands.
    pub rejected: u64,
}

/// Numbers of a storm that was recorded and verified.
#[derive(Debug, Clone)]
pub struct Summary {
    /// The outcomes that the clients received.
    pub counts: Counts,
    /// Last step of the node.
    pub last_step: u64,
    /// Size of the recording in bytes.
    pub size_bytes: u64,
    /// The report of the recorder, with the messages that were lost.
    pub recorded: String,
    /// First line of the report of `recorder verify`.
    pub verified: String,
}

/// A state of a running node, as a client reads it.
#[derive(Debug, Clone)]
pub struct HeldState {
    /// Same as in [`GivenState`].
    pub scene_hash: u64,
    /// The particles.
    pub particles: Vec<ParticleState>,
    /// The keyframe of the same step.
    pub keyframe: Vec<u8>,
}

impl HeldState {
    /// Reads the newest state of the node in a sandbox.
    ///
    /// # Panics
    /// If no node runs there.
    pub fn read(sandbox: &Sandbox) -> Self {
        let file = sandbox.path("held.mcap");
        let args = ["state", "-o", &file, "--overwrite"];
        Process::run(Program::Recorder, sandbox, &args).success();
        let log = LogReader::open(Path::new(&file)).expect("a recording of a state");
        let scene_hash = scene_hash(log.scene());
        let mut frames = FrameReader::new(log);
        let frame = frames.next_frame().expect("a readable file").expect("a state");
        let keyframe = frame.own_keyframe().expect("a state with its keyframe").to_vec();
        Self { scene_hash, particles: frame.payload().to_vec(), keyframe }
    }

    fn particle_count(&self) -> u32 {
        u32::try_from(self.particles.len()).expect("a scene of an allowed size")
    }

    /// Returns the complete state.
    pub fn state(&self) -> GivenState<'_> {
        let Self { scene_hash, particles, keyframe } = self;
        GivenState { scene_hash: *scene_hash, particles, keyframe: Some(keyframe) }
    }

    /// Returns the positions and velocities.
    pub fn motion(&self) -> GivenState<'_> {
        GivenState { keyframe: None, ..self.state() }
    }
}

/// Runs a storm on a node of its own with a built-in scene, records it, and verifies the recording in another process.
///
/// # Panics
/// If a program fails, or the recording is not bit-identical up to the last step.
pub fn run(scene: &str, rate_hz: u32, storm: Storm) -> Summary {
    let sandbox = Sandbox::new();
    let file = sandbox.path("storm.mcap");
    let rate = rate_hz.to_string();
    let args = ["run", scene, "--rate", &rate];
    let node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let held = HeldState::read(&sandbox);
    let recording = record(&sandbox, &file);
    let counts = send(&sandbox, &held, storm);
    ctl(&sandbox, &["pause"]);
    let recorded = recording.interrupt();
    // A busy machine may lose snapshots, which the file declares.
    assert!(matches!(recorded.code, Some(0 | 3)), "{}", recorded.stderr);
    let status = ctl(&sandbox, &["status"]);
    node.interrupt().success();
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    let verified = verified.lines().next().unwrap_or_default().to_owned();
    assert!(verified.contains("steps bit-identical"), "{verified}");
    let last_step = status["step"].as_u64().expect("a step");
    assert!(verified.contains(&format!("..={last_step})")), "{verified}, not up to {last_step}");
    let size_bytes = fs::metadata(&file).expect("the recording").len();
    Summary { counts, last_step, size_bytes, recorded: recorded.stdout, verified }
}

/// Sends random commands from several clients at the same time. Each waits for the outcome of a command
/// before it sends the next one.
///
/// # Panics
/// If an outcome is missing, or is not one that the command can have.
pub fn send(sandbox: &Sandbox, held: &HeldState, storm: Storm) -> Counts {
    let endpoint = sandbox.endpoint();
    std::thread::scope(|scope| {
        let start = |seed| {
            let endpoint = &endpoint;
            scope.spawn(move || disturb(endpoint, held, Rng::with_seed(seed), storm.commands))
        };
        let threads: Vec<_> = (1..=storm.clients).map(start).collect();
        threads.into_iter().fold(Counts::default(), |sum, thread| {
            let counts = thread.join().expect("a client that ends");
            let applied = sum.applied + counts.applied;
            Counts { applied, rejected: sum.rejected + counts.rejected }
        })
    })
}

fn disturb(endpoint: &Endpoint, held: &HeldState, mut rng: Rng, count: u64) -> Counts {
    let mut client = Client::attach(endpoint).expect("a running node");
    let mut counts = Counts::default();
    for _ in 0..count {
        let outcome = match rng.u32(0..16) {
            0 => give(&mut client, &held.state()),
            1 => give(&mut client, &held.motion()),
            2 => {
                let outcome = give(&mut client, &damaged(held, &mut rng).state());
                assert_eq!(outcome.reason(), Some(Reason::InvalidState), "{outcome:?}");
                outcome
            }
            3 => {
                let outcome = request(&mut client, bad_action(held, &mut rng));
                assert!(!outcome.is_applied(), "{outcome:?}");
                outcome
            }
            _ => {
                let outcome = request(&mut client, action(held, &mut rng));
                assert_ne!(outcome.reason(), Some(Reason::InvalidState), "{outcome:?}");
                outcome
            }
        };
        if outcome.is_applied() {
            counts.applied += 1;
        } else {
            counts.rejected += 1;
        }
    }
    counts
}

fn give(client: &mut Client, state: &GivenState<'_>) -> Outcome {
    client.restore(state, DEADLINE).expect("an outcome of a given state")
}

fn request(client: &mut Client, action: Action) -> Outcome {
    client.request(action, DEADLINE).expect("an outcome")
}

/// Returns an action that the node may apply or reject.
fn action(held: &HeldState, rng: &mut Rng) -> Action {
    // Some are just past the last one.
    let particle = rng.u32(0..held.particle_count() + 32);
    let target = [rng.f32() - 0.5, rng.f32() - 0.5, rng.f32() - 0.5];
    let (translation, rotation) = (target, [0.0, 0.0, 0.0, 1.0]);
    match rng.u32(0..16) {
        0 => Action::Rewind { to_step: None, back_steps: Some(rng.u32(0..100)) },
        1 => Action::Rewind { to_step: Some(rng.u64(0..2000)), back_steps: None },
        2 => Action::Reset,
        3 => Action::CutRadius { center: target, radius: 0.05 },
        4 => Action::Pin { particle },
        5 => Action::Unpin { particle },
        6 => Action::Release { particle, force: true },
        7 => Action::Push { center: target, radius: 0.3, delta: target, limit: Some(0.01) },
        8 => set("damping", rng.f32()),
        // They change every constraint, which a node prepares beside the loop if there are many.
        9 => set("compliance", rng.f32() * 1e-4),
        10 => set("tear_stretch", 2.0 + rng.f32()),
        // Motions that are on their way for many steps.
        11 => Action::MoveCollider { collider: 0, translation, rotation, over_s: rng.f32() * 0.5 },
        12 => {
            let point = |time| PathPoint { time, translation, rotation };
            let points = [point(0.1), point(0.3 + rng.f64())];
            let path = PathPart::new(&points).unwrap_or(PathPart::EMPTY);
            let object = MovedObject::Collider;
            Action::Follow { object, object_index: 0, path, append: rng.bool() }
        }
        _ => Action::Grab { particle, target, over_s: rng.f32() * 0.5 },
    }
}

/// Returns an action that every node rejects.
fn bad_action(held: &HeldState, rng: &mut Rng) -> Action {
    let (target, over_s) = ([f32::NAN, 0.0, f32::INFINITY], 0.05);
    match rng.u32(0..8) {
        0 => Action::Pin { particle: rng.u32(held.particle_count()..) },
        1 => Action::Cut { constraint: rng.u32(ELEMENTS_MAX..) },
        2 => Action::Grab { particle: 90, target, over_s },
        3 => Action::CutRadius { center: target, radius: 0.05 },
        4 => set("substeps", 0.5),
        6 => Action::set("bending", 0.1).for_part(Part::Block(rng.u32(1000..))),
        5 => Action::Rewind { to_step: Some(u64::MAX >> 12), back_steps: None },
        // A command alone has no state.
        _ => Action::Restore { contents: RestoreContents::State, state_hash: rng.u64(..) },
    }
}

fn set(parameter: &str, value: f32) -> Action {
    Action::set(parameter, value)
}

/// Returns a state with one fault.
fn damaged(held: &HeldState, rng: &mut Rng) -> HeldState {
    let mut held = held.clone();
    let index = rng.usize(..held.particles.len());
    match rng.u32(0..5) {
        0 => held.scene_hash ^= 1,
        1 => held.particles.truncate(index),
        2 => held.particles[index].position[1] = f32::NAN,
        3 => held.keyframe.truncate(20),
        _ => held.keyframe.push(0),
    }
    held
}
