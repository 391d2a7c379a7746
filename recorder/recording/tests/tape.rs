//! A tape wound to any step shows the state of the solver in that step, which a reader of the whole
//! file finds too.
//!
//! The tests simulate a scene with cuts, resets and colliders, write it in small chunks, and keep the
//! states of the solver for comparison.

use std::fs;
use std::path::PathBuf;

use recording::simulation::forces_row;
use recording::{
    Closing, CollidersRow, ContentSelection, Frame, FrameReader, LogEnd, LogOptions, LogReader,
    LogWriter, Message, OutcomeRow, RunDescription, StepRow, SurfaceRow, Tape, TapeError, TearsRow,
    TopologyRow, Up, state_hash,
};
use sim_messages::{
    Action, Command, ConstraintState, LoadHeader, Outcome, ParticleState, TearCause, TornConstraint,
};
use sim_solver::{Scene, Solver};

const SCENE: &str = "
    version = 1
    [solver]
    rate_hz = 60
    [[generate]]
    shape = 'cloth'
    columns = 6
    rows = 6
    spacing = 0.1
    pinned = 'top'";

/// Number of simulated steps, and the cuts and resets in some of them.
const STEPS: u64 = 300;
const CUTS: [(u64, u32); 6] = [(7, 3), (40, 11), (41, 2), (125, 30), (210, 5), (250, 12)];
const RESETS: [u64; 2] = [90, 210];
/// Steps between two keyframes.
const KEYFRAME_PERIOD: u64 = 60;

/// The state of the solver after a step.
#[derive(Debug, Clone, PartialEq)]
struct Expected {
    step: u64,
    particles: Vec<ParticleState>,
    torn: Vec<u32>,
    causes: Vec<Option<TearCause>>,
    hash: u64,
}

/// The format of a test recording.
#[derive(Debug, Clone, Copy)]
struct Style {
    every: u64,
    has_keyframes: bool,
    has_forces: bool,
    chunk_size_bytes: u64,
}

const PLAIN: Style =
    Style { every: 1, has_keyframes: true, has_forces: false, chunk_size_bytes: 6000 };

fn expected(solver: &Solver, step: u64) -> Expected {
    Expected {
        step,
        particles: bytemuck::cast_slice(solver.particles()).to_vec(),
        torn: solver.torn().to_vec(),
        causes: solver.tear_causes().iter().map(|cause| Some(*cause)).collect(),
        hash: solver.state_hash(),
    }
}

fn reset_outcome(step: u64) -> Message {
    let command = Command::new(1, step, Action::Reset);
    Message::Outcome(OutcomeRow::from(&Outcome::new(0, step, command, Ok(()))))
}

/// Returns the messages of a step except its snapshot, in the order of publication.
fn updates(solver: &Solver, step: u64, style: Style) -> Vec<Message> {
    let mut messages = Vec::new();
    if RESETS.contains(&step) {
        messages.push(reset_outcome(step));
    }
    if step.is_multiple_of(25) {
        messages.push(Message::Colliders(CollidersRow { step, colliders: Vec::new() }));
    }
    let new = solver.torn().len() - solver.new_torn_count();
    if solver.new_torn_count() > 0 {
        let causes = solver.tear_causes()[new..].iter().map(|one| one.name().to_owned());
        let constraints = solver.torn()[new..].to_vec();
        messages.push(Message::Tears(TearsRow { step, constraints, causes: causes.collect() }));
    }
    if style.has_keyframes && step.is_multiple_of(KEYFRAME_PERIOD) {
        messages.push(Message::Keyframe { step, bytes: solver.keyframe().encode() });
    }
    if style.has_forces && step > 0 {
        messages.push(Message::Forces(forces_row(solver, step).unwrap()));
    }
    messages
}

/// Computes a step with its cuts and resets.
fn advance(solver: &mut Solver, step: u64) {
    if RESETS.contains(&step) {
        solver.reset();
    }
    for (_, constraint) in CUTS.iter().filter(|(of, _)| *of == step) {
        solver.cut(*constraint).unwrap();
    }
    solver.step();
}

fn topology(solver: &Solver) -> Message {
    let constraints: Vec<_> = solver
        .constraints()
        .map(|one| ConstraintState {
            a: one.a,
            b: one.b,
            rest_length: one.rest_length,
            compliance: one.compliance,
            kind: one.kind as u32,
        })
        .collect();
    Message::Topology(TopologyRow::new(&LoadHeader::default(), &constraints, &[]))
}

fn written(style: Style) -> (Vec<u8>, Vec<Expected>) {
    let scene = Scene::from_toml(SCENE, "scene.toml").unwrap();
    let mut solver = Solver::new(&scene);
    solver.compute_forces(style.has_forces);
    let run = RunDescription {
        run_id: 7,
        epoch_ns: 1_700_000_000_000_000_001,
        scene_name: "cloth".to_owned(),
        origin: [0.0; 3],
        up: Up::Y,
        rate_hz: 60,
        method: 0,
        particle_count: 36,
        constraint_count: u32::try_from(solver.constraint_count()).unwrap(),
        bend_count: u32::try_from(solver.bend_count()).unwrap(),
        solver_version: 1,
        contract_version: 1,
        recorder_version: "0.1.0".to_owned(),
    };
    let selection =
        ContentSelection { has_forces: style.has_forces, ..ContentSelection::default() };
    let options =
        LogOptions { selection, chunk_size_bytes: style.chunk_size_bytes, ..LogOptions::default() };
    let mut log = LogWriter::create(Vec::new(), options, &run, SCENE.as_bytes(), 0).unwrap();
    log.write(&topology(&solver), 0).unwrap();
    let surface = SurfaceRow { step: 0, triangles: Vec::new() };
    log.write(&Message::Surface(surface), 0).unwrap();
    let mut all = Vec::new();
    for step in 0..=STEPS {
        if step > 0 {
            advance(&mut solver, step);
        }
        for message in updates(&solver, step, style) {
            log.write(&message, step).unwrap();
        }
        if step.is_multiple_of(style.every) {
            let state = expected(&solver, step);
            log.write(&Message::Step(row(&solver, step)), step).unwrap();
            let particles = state.particles.clone();
            log.write(&Message::Particles { step, particles }, step).unwrap();
            all.push(state);
        }
    }
    (log.finish(&Closing::default()).unwrap(), all)
}

fn row(solver: &Solver, step: u64) -> StepRow {
    StepRow {
        step,
        scene_step: solver.scene_step(),
        state_hash: solver.state_hash(),
        torn_count: u32::try_from(solver.torn().len()).unwrap(),
        ..StepRow::default()
    }
}

/// A file that is removed when its guard is dropped.
struct TestFile(PathBuf);

impl TestFile {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("tape-{}-{name}.mcap", std::process::id()));
        fs::write(&path, bytes).unwrap();
        Self(path)
    }

    fn open(&self) -> Result<Tape, TapeError> {
        Tape::open(&self.0, None, &mut |_, _| {})
    }
}

impl Drop for TestFile {
    fn drop(&mut self) {
        let _left = fs::remove_file(&self.0);
    }
}

/// Returns steps in forward, backward and scattered order.
fn tour() -> impl Iterator<Item = u64> {
    let scattered = (0..=STEPS).map(|step| step * 127 % (STEPS + 1));
    scattered.chain(0..=STEPS).chain((0..=STEPS).rev())
}

fn assert_shows(tape: &mut Tape, step: u64, all: &[Expected]) {
    let expected = all.iter().rfind(|one| one.step <= step).unwrap();
    let state = tape.state_at(step).unwrap();
    let torn: Vec<_> = state.torn.indices().collect();
    let found = Expected {
        step: state.row.step,
        particles: state.particles.to_vec(),
        causes: state.torn.constraints.iter().map(TornConstraint::cause).collect(),
        hash: state_hash(&state.particles, &torn),
        torn,
    };
    assert_eq!(found, *expected, "wound to step {step}");
    let colliders_step = state.colliders.unwrap().step;
    assert_eq!(colliders_step, expected.step / 25 * 25, "wound to step {step}");
}

#[test]
fn a_tape_shows_the_state_of_the_solver_at_any_step() {
    let styles = [
        ("plain", PLAIN),
        ("decimated", Style { every: 4, ..PLAIN }),
        ("without-keyframes", Style { has_keyframes: false, ..PLAIN }),
        ("one-chunk", Style { chunk_size_bytes: 1 << 20, ..PLAIN }),
        ("tiny-chunks", Style { chunk_size_bytes: 1, ..PLAIN }),
    ];
    for (name, style) in styles {
        let (bytes, all) = written(style);
        let file = TestFile::new(name, &bytes);
        let mut tape = file.open().unwrap();
        assert_eq!((tape.first_step(), tape.last_step(), tape.stride()), (0, STEPS, style.every));
        tour().for_each(|step| assert_shows(&mut tape, step, &all));
        assert_eq!(tape.drain_faults(), Vec::<String>::new());
    }
}

#[test]
fn a_newly_opened_tape_shows_the_state_in_the_file() {
    let (bytes, all) = written(PLAIN);
    let file = TestFile::new("linear", &bytes);
    let mut frames = FrameReader::new(LogReader::new(bytes.as_slice()).unwrap());
    let mut step = 0;
    while let Some(frame) = frames.next_frame().unwrap() {
        // A newly opened tape has no cached chunks.
        if step % 37 == 0 {
            let state = file.open().unwrap().state_at(step).unwrap();
            assert_eq!((state.row, state.particles.as_slice()), (frame.row, frame.payload()));
            assert_shows(&mut file.open().unwrap(), step, &all);
        }
        step += 1;
    }
    assert_eq!(step, STEPS + 1);
}

#[test]
fn neighboring_steps_are_found_across_chunks() {
    let (bytes, all) = written(Style { every: 3, ..PLAIN });
    let file = TestFile::new("neighbours", &bytes);
    let mut tape = file.open().unwrap();
    for pair in all.windows(2) {
        assert_eq!(tape.step_after(pair[0].step).unwrap(), pair[1].step);
        assert_eq!(tape.step_at(pair[1].step - 1).unwrap(), pair[0].step);
    }
    assert_eq!(tape.step_after(tape.last_step()).unwrap(), STEPS);
}

/// Reads a file from its start, and returns each frame with its step.
#[test]
fn the_forces_of_any_step_are_found_where_there_are_any() {
    // In the smaller chunks, the forces are in another one than the snapshot.
    for chunk_size_bytes in [6000, 1] {
        let (bytes, _) = written(Style { has_forces: true, chunk_size_bytes, ..PLAIN });
        let file = TestFile::new(&format!("forces-{chunk_size_bytes}"), &bytes);
        let mut tape = file.open().unwrap();
        let scene = Scene::from_toml(SCENE, "scene.toml").unwrap();
        let mut solver = Solver::new(&scene);
        solver.compute_forces(true);
        let mut all = vec![None];
        for step in 1..=STEPS {
            advance(&mut solver, step);
            all.push(forces_row(&solver, step));
        }
        assert!(all[100].as_ref().unwrap().impulses.iter().any(|one| one[1].0 != 0.0));
        for (step, row) in tour().map(|step| (step, &all[usize::try_from(step).unwrap()])) {
            assert_eq!(&tape.forces_at(step).unwrap(), row, "step {step}");
        }
    }
    let file = TestFile::new("no-forces", &written(PLAIN).0);
    assert_eq!(file.open().unwrap().forces_at(100).unwrap(), None);
}

fn frames(bytes: &[u8]) -> Vec<(u64, Frame)> {
    let mut reader = FrameReader::new(LogReader::new(bytes).unwrap());
    let frames = std::iter::from_fn(|| reader.next_frame().unwrap());
    frames.map(|frame| (frame.row.step, frame)).collect()
}

#[test]
fn a_reader_continues_after_any_step_as_if_it_had_read_everything_before() {
    let (bytes, _) = written(Style { every: 3, ..PLAIN });
    let file = TestFile::new("wind", &bytes);
    let mut tape = file.open().unwrap();
    let mut reader = FrameReader::new(LogReader::open(&file.0).unwrap());
    let all = frames(&bytes);
    for step in tour() {
        tape.wind(&mut reader, step).unwrap();
        let at = all.partition_point(|(of, _)| *of <= step);
        for (_, expected) in all[at..].iter().take(2) {
            assert_eq!(reader.next_frame().unwrap().as_ref(), Some(expected), "after step {step}");
        }
        if at == all.len() {
            assert_eq!(reader.next_frame().unwrap(), None);
        }
        let keyframe = tape.keyframe_at(step).unwrap().map(|(step, _)| step);
        // The last recorded step up to this one may precede the keyframe.
        let recorded = all[at - 1].0;
        assert_eq!(keyframe, Some(recorded / KEYFRAME_PERIOD * KEYFRAME_PERIOD), "{step}");
    }
    tape.rewind(&mut reader);
    assert_eq!(reader.next_frame().unwrap().as_ref(), Some(&all[0].1));
}

#[test]
fn a_reader_continues_with_the_messages_of_the_next_step() {
    let (bytes, _) = written(PLAIN);
    let file = TestFile::new("next", &bytes);
    let mut tape = file.open().unwrap();
    let mut reader = FrameReader::new(LogReader::open(&file.0).unwrap());
    for (step, constraint) in CUTS {
        tape.wind(&mut reader, step - 1).unwrap();
        let next = reader.next_frame().unwrap().unwrap();
        let tears = next.updates.iter().find_map(|update| match update {
            Message::Tears(row) => Some((row.step, row.constraints.clone())),
            _ => None,
        });
        assert_eq!((next.row.step, tears), (step, Some((step, vec![constraint]))));
    }
}

#[test]
fn a_reader_continues_behind_a_damaged_chunk() {
    let (mut bytes, _) = written(PLAIN);
    let all = frames(&bytes);
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    let file = TestFile::new("wind-damaged", &bytes);
    let mut tape = file.open().unwrap();
    let mut reader = FrameReader::new(LogReader::open(&file.0).unwrap());
    let missing = (0..=STEPS).find(|step| tape.step_at(*step).unwrap() < *step).unwrap();
    let behind = tape.step_after(missing - 1).unwrap();
    assert!(behind > missing);
    // The chunk before the one of this step is the damaged one.
    for step in [behind, behind + 1, missing - 1, behind] {
        tape.wind(&mut reader, step).unwrap();
        let next = reader.next_frame().unwrap();
        if step >= behind {
            assert_eq!(next.unwrap(), all[usize::try_from(step).unwrap() + 1].1);
        } else {
            assert_eq!(next, None);
            assert!(matches!(reader.end(), Some(LogEnd::Damaged { .. })));
        }
    }
}

#[test]
fn a_file_without_an_end_is_shown_as_far_as_it_goes() {
    let (bytes, all) = written(PLAIN);
    let file = TestFile::new("cut", &bytes[..bytes.len() / 2]);
    let mut reports = Vec::new();
    let mut tape = Tape::open(&file.0, None, &mut |at, of| reports.push((at, of))).unwrap();
    assert!(matches!(tape.log().end(), LogEnd::Truncated { .. }) && !tape.log().has_index());
    assert!(reports.first().is_some_and(|(at, of)| at < of), "{reports:?}");
    let last_step = tape.last_step();
    assert!((50..STEPS - 50).contains(&last_step), "ends with step {last_step}");
    for step in tour().filter(|step| *step <= last_step) {
        assert_shows(&mut tape, step, &all);
    }
}

#[test]
fn everything_except_a_damaged_chunk_is_shown() {
    let (mut bytes, all) = written(PLAIN);
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    let file = TestFile::new("damaged", &bytes);
    let mut tape = file.open().unwrap();
    let steps: Vec<_> = (0..=STEPS).map(|step| tape.step_at(step).unwrap()).collect();
    let missing: Vec<_> = (0..=STEPS).filter(|step| !steps.contains(step)).collect();
    assert!(!missing.is_empty() && missing.len() < 60, "{missing:?}");
    let faults = tape.drain_faults();
    assert!(faults.len() == 1 && faults[0].contains("is damaged"), "{faults:?}");
    let behind = missing.last().unwrap().next_multiple_of(KEYFRAME_PERIOD);
    for step in (0..missing[0]).chain(behind..=STEPS) {
        assert_shows(&mut tape, step, &all);
    }
    assert_eq!(tape.step_after(missing[0] - 1).unwrap(), missing.last().unwrap() + 1);
}

#[test]
fn a_file_without_a_state_reports_the_reason() {
    let (bytes, _) = written(PLAIN);
    let open = |name: &str, bytes: &[u8]| {
        TestFile::new(name, bytes).open().err().map(|error| error.to_string()).unwrap()
    };
    assert_eq!(
        open("empty", &[]),
        "is empty: a recorder that is killed before it has recorded a second leaves such a file"
    );
    assert_eq!(open("short", &[0x89]), "is not an MCAP file");
    assert_eq!(open("other", b"version = 1\n[solver]\nrate_hz = 60\n"), "is not an MCAP file");
    let head = open("head", &bytes[..bytes.len() / 100]);
    assert!(head.contains("head") || head.contains("/topology"), "{head}");
}
