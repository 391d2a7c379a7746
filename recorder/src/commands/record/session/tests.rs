//! The start, the end and the order of a recording, and the counts of missing messages. The states
//! are built by hand.

use sim_contract::{
    Action, ColliderState, Colliders, CollidersHeader, Command, ConstraintState, KeyframeHeader,
    LoadHeader, LoadedScene, NodeStatus, OUTCOME_FLAG_CONTROL, ParameterValues, Parameters,
    ParametersHeader, ParticleFlags, ParticleState, SnapshotHeader, TearCause, TearsHeader, Torn,
    TornConstraint, Update,
};

use recording::{Message, Topic};

use super::*;
use crate::commands::record::batch::RunEnd;
use crate::commands::record::queue::Content;

mod gaps;
mod next_file;

const RUN_ID: u64 = 77;
const NOW: Now = Now { realtime_ns: 5_000_000_000, monotonic_ns: 2_000_000_000 };

/// The parts of a state that change rarely.
#[derive(Debug)]
struct Node {
    load: LoadedScene,
    particles: Vec<ParticleState>,
    torn: Torn,
    colliders: Colliders,
    parameters: Parameters,
}

impl Node {
    /// A node with one particle and nothing torn.
    fn new() -> Self {
        let header = LoadHeader { run_id: RUN_ID, rate_hz: 10, count: 1, ..LoadHeader::default() };
        let load = LoadedScene {
            header,
            scene: b"version = 1\nname = \"dot\"\nsolver.rate_hz = 10\n".to_vec(),
            constraints: vec![ConstraintState::default()],
            bends: Vec::new(),
            triangles: Vec::new(),
        };
        Self {
            load,
            particles: vec![ParticleState::default()],
            torn: Torn { header: tears_header(0), constraints: Vec::new() },
            colliders: Colliders { header: colliders_header(0), colliders: Vec::new() },
            parameters: Parameters { header: parameters_header(0), ..Parameters::default() },
        }
    }

    /// Publishes a state.
    fn publish(
        &self,
        session: &mut Session,
        header: SnapshotHeader,
        changes: &[Change],
        batch: &mut Batch,
    ) -> Result<(), LoadError> {
        let state = State {
            header: &header,
            particles: &self.particles,
            load: &self.load,
            torn: &self.torn,
            colliders: &self.colliders,
            parameters: &self.parameters,
            changes,
        };
        session.accept_state(&state, NOW, batch)
    }
}

/// Returns the number of missing messages on all topics.
fn missing_count(session: &Session) -> u64 {
    session.closing(String::new()).missing().values().sum()
}

/// Publishes a state alone.
fn publish(session: &mut Session, header: SnapshotHeader, changes: &[Change]) -> Batch {
    let mut batch = Batch::default();
    Node::new().publish(session, header, changes, &mut batch).unwrap();
    batch.sort();
    batch
}

/// Sends messages without a state.
fn send(session: &mut Session, updates: &[Update<'_>]) -> Batch {
    let mut batch = Batch::default();
    add(session, updates, &mut batch);
    batch
}

fn add(session: &mut Session, updates: &[Update<'_>], batch: &mut Batch) {
    let mut messages = Messages::default();
    for update in updates {
        messages.add(update);
    }
    session.accept_messages(messages, NOW, batch);
    batch.sort();
}

fn header(step: u64, outcome_count: u64) -> SnapshotHeader {
    SnapshotHeader {
        run_id: RUN_ID,
        step,
        outcome_count,
        particle_count: 1,
        snapshot_index: u32::try_from(step).unwrap(),
        // One second ago.
        publish_monotonic_ns: 1_000_000_000,
        ..SnapshotHeader::default()
    }
}

fn keyframe_header(step: u64) -> KeyframeHeader {
    KeyframeHeader { run_id: RUN_ID, step, size_bytes: 1, ..KeyframeHeader::default() }
}

fn keyframe(step: u64) -> Change {
    Change::Keyframe(keyframe_header(step), vec![1])
}

fn tears_header(step: u64) -> TearsHeader {
    TearsHeader { run_id: RUN_ID, step, ..TearsHeader::default() }
}

/// A list of new cuts. `count` constraints are torn in all.
fn tears(step: u64, new: &[u32], count: u32) -> Change {
    let new_count = u32::try_from(new.len()).unwrap();
    let header = TearsHeader { new_count, count, ..tears_header(step) };
    Change::Tears(header, new.iter().copied().map(cut).collect())
}

fn cut(constraint: u32) -> TornConstraint {
    TornConstraint::new(constraint, Some(TearCause::Cut))
}

fn colliders_header(step: u64) -> CollidersHeader {
    CollidersHeader { run_id: RUN_ID, step, count: 0, list_index: 0 }
}

fn parameters_header(step: u64) -> ParametersHeader {
    ParametersHeader { run_id: RUN_ID, step, ..ParametersHeader::default() }
}

fn outcome(index: u64, step: u64) -> Outcome {
    let command = Command::new(1, index, Action::Reset);
    Outcome { run_id: RUN_ID, ..Outcome::new(index, step, command, Ok(())) }
}

/// Returns names such as "snapshot 3" and "/keyframe 3".
fn names(batch: &Batch) -> Vec<String> {
    let name = |content: &Content| match content {
        Content::Snapshot(row, _) => format!("snapshot {}", row.step),
        Content::Update(message) => format!("{} {}", message.topic().name(), message.step()),
    };
    batch.contents.iter().map(name).collect()
}

/// Returns the tears, the events and the number of colliders in each step.
fn side_rows(batch: &Batch) -> Vec<String> {
    let text = |content: &Content| match content {
        Content::Update(Message::Tears(row)) => {
            Some(format!("{}: tore {:?} by {:?}", row.step, row.constraints, row.causes))
        }
        Content::Update(Message::Colliders(row)) => {
            Some(format!("{}: {} colliders", row.step, row.colliders.len()))
        }
        Content::Update(Message::Event(row)) => Some(format!("{}: {}", row.step, row.text)),
        _ => None,
    };
    batch.contents.iter().filter_map(text).collect()
}

/// Returns the constraints that tore before the recording.
fn torn_before(batch: &Batch) -> &[u32] {
    match &batch.header.as_ref().unwrap().rows[..] {
        [Message::Topology(row), Message::Surface(_)] => &row.torn,
        rows => panic!("{rows:?}"),
    }
}

/// A session that started at step 4, after two outcomes.
fn started() -> Session {
    let mut session = Session::default();
    let batch = publish(&mut session, header(4, 2), &[Change::Load, keyframe(4)]);
    assert!(batch.header.is_some());
    session
}

#[test]
fn the_recording_starts_at_the_first_state_with_a_keyframe() {
    let mut session = Session::default();
    assert!(names(&publish(&mut session, header(2, 0), &[Change::Load, keyframe(1)])).is_empty());
    assert!(names(&publish(&mut session, header(3, 0), &[])).is_empty());
    let batch = publish(&mut session, header(4, 0), &[keyframe(4)]);
    assert_eq!(names(&batch), ["/parameters 0", "/keyframe 4", "snapshot 4"]);
    assert!(torn_before(&batch).is_empty());
    let run = batch.header.unwrap().run;
    assert_eq!((run.scene_name.as_str(), run.rate_hz, run.constraint_count), ("dot", 10, 1));
    // Published at a wall-clock time of 4 s, in step 4 at 10 Hz.
    assert_eq!(run.epoch_ns, 4_000_000_000 - 400_000_000);
    assert_eq!(names(&publish(&mut session, header(5, 0), &[])), ["snapshot 5"]);
    assert_eq!((session.first_step(), missing_count(&session)), (Some(4), 0));
}

#[test]
fn a_keyframe_that_came_after_outcomes_does_not_start_the_recording_at_its_state() {
    let mut session = Session::default();
    // The node has published outcome 2 before this recorder joined.
    let late =
        KeyframeHeader { outcome_count: 2, published_outcome_count: 3, ..keyframe_header(4) };
    let changes = [Change::Load, Change::Keyframe(late, vec![1])];
    assert!(names(&publish(&mut session, header(4, 2), &changes)).is_empty());
    assert!(names(&send(&mut session, &[Update::Outcome(&outcome(3, 5))])).is_empty());
    assert!(names(&send(&mut session, &[Update::Keyframe(&late, &[1])])).is_empty());
    let batch = publish(&mut session, header(5, 4), &[keyframe(5)]);
    assert_eq!(names(&batch), ["/parameters 0", "/keyframe 5", "snapshot 5"]);
    assert_eq!((session.first_step(), missing_count(&session)), (Some(5), 0));
}

#[test]
fn a_keyframe_that_a_paused_node_publishes_after_the_state_starts_the_recording() {
    let mut session = Session::default();
    assert!(names(&publish(&mut session, header(9, 0), &[Change::Load])).is_empty());
    let answer = outcome(0, 10);
    assert!(names(&send(&mut session, &[Update::Outcome(&answer)])).is_empty());
    let batch = send(&mut session, &[Update::Keyframe(&keyframe_header(9), &[1])]);
    let expected = ["/parameters 0", "/keyframe 9", "snapshot 9", "/outcomes 10"];
    assert_eq!(names(&batch), expected);
    // The tap passes on the keyframe with the next state as well.
    let batch = publish(&mut session, header(10, 1), &[keyframe(9)]);
    assert_eq!(names(&batch), ["snapshot 10"]);
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn a_keyframe_that_comes_with_the_next_state_starts_the_recording_before_it() {
    let mut session = Session::default();
    assert!(names(&publish(&mut session, header(9, 0), &[Change::Load])).is_empty());
    let batch = publish(&mut session, header(10, 0), &[keyframe(9)]);
    let expected = ["/parameters 0", "/keyframe 9", "snapshot 9", "snapshot 10"];
    assert_eq!(names(&batch), expected);
}

#[test]
fn outcomes_that_the_first_state_does_not_contain_are_kept() {
    let mut session = Session::default();
    let outcomes = [outcome(0, 1), outcome(1, 3)];
    let updates = outcomes.each_ref().map(Update::Outcome);
    assert!(names(&send(&mut session, &updates)).is_empty());
    let mut batch = publish(&mut session, header(2, 1), &[Change::Load, keyframe(2)]);
    add(&mut session, &[], &mut batch);
    assert_eq!(names(&batch)[1..], ["/keyframe 2", "snapshot 2", "/outcomes 3"]);
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn the_recording_ends_with_the_last_requested_step_and_counts_nothing_after_it() {
    let (mut session, node) = (Session::new(Some(2)), Node::new());
    let mut batch = Batch::default();
    let load = [Change::Load, keyframe(0)];
    node.publish(&mut session, header(0, 0), &load, &mut batch).unwrap();
    for step in [1, 2] {
        assert_eq!(batch.end, None);
        node.publish(&mut session, header(step, step), &[keyframe(step)], &mut batch).unwrap();
    }
    assert_eq!(batch.end, Some(RunEnd::EndStep));
    let outcomes = [outcome(0, 1), outcome(1, 2), outcome(2, 3)];
    add(&mut session, &outcomes.each_ref().map(Update::Outcome), &mut batch);
    let expected = [
        "/keyframe 0",
        "snapshot 0",
        "/outcomes 1",
        "/keyframe 1",
        "snapshot 1",
        "/outcomes 2",
        "/keyframe 2",
        "snapshot 2",
    ];
    assert_eq!(names(&batch)[1..], expected);
    assert_eq!(missing_count(&session), 0);
    assert_eq!(session.counts()[Topic::Particles].received, 3);
}

#[test]
fn a_state_beyond_the_last_requested_step_ends_the_recording() {
    let mut session = Session::new(Some(2));
    publish(&mut session, header(0, 0), &[Change::Load, keyframe(0)]);
    let batch = publish(&mut session, header(5, 0), &[keyframe(5)]);
    assert_eq!((names(&batch).len(), batch.end), (0, Some(RunEnd::EndStep)));
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn messages_are_written_in_the_order_of_publication() {
    let (mut session, node) = (started(), Node::new());
    let mut batch = Batch::default();
    node.publish(&mut session, header(5, 3), &[keyframe(5)], &mut batch).unwrap();
    node.publish(&mut session, header(6, 4), &[keyframe(6)], &mut batch).unwrap();
    let status = |run_id, step| NodeStatus { run_id, step, ..NodeStatus::default() };
    let statuses = [status(RUN_ID, 5), status(RUN_ID + 1, 5), status(RUN_ID, 3)];
    let outcomes = [outcome(2, 5), outcome(3, 6), outcome(4, 7)];
    let mut updates: Vec<_> = statuses.iter().map(Update::Status).collect();
    updates.extend(outcomes.iter().map(Update::Outcome));
    add(&mut session, &updates, &mut batch);
    let expected = [
        "/outcomes 5",
        "/keyframe 5",
        "/status 5",
        "snapshot 5",
        "/outcomes 6",
        "/keyframe 6",
        "snapshot 6",
        "/outcomes 7",
    ];
    assert_eq!(names(&batch), expected);
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn outcomes_of_the_first_state_of_other_runs_and_of_a_replay_are_skipped() {
    let mut session = started();
    let other = Outcome { run_id: RUN_ID + 1, ..outcome(7, 5) };
    let control = Outcome { flags: OUTCOME_FLAG_CONTROL, ..outcome(2, 5) };
    let outcomes = [outcome(1, 4), other, control];
    let batch = send(&mut session, &outcomes.each_ref().map(Update::Outcome));
    assert!(names(&batch).is_empty());
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn another_run_ends_the_recording_and_is_not_part_of_it() {
    let (mut session, node) = (started(), Node::new());
    let mut batch = Batch::default();
    node.publish(&mut session, header(5, 3), &[], &mut batch).unwrap();
    let other = SnapshotHeader { run_id: RUN_ID + 1, ..header(0, 0) };
    node.publish(&mut session, other, &[Change::Load, keyframe(0)], &mut batch).unwrap();
    let outcomes = [outcome(2, 5), outcome(3, 7)];
    add(&mut session, &outcomes.each_ref().map(Update::Outcome), &mut batch);
    assert_eq!(names(&batch), ["/outcomes 5", "snapshot 5"]);
    assert_eq!(batch.end, Some(RunEnd::NewRun));
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn another_load_ends_the_recording() {
    let mut session = started();
    let other = SnapshotHeader { topology_revision: 1, ..header(5, 2) };
    let batch = publish(&mut session, other, &[Change::Load, tears(5, &[], 0), keyframe(5)]);
    assert_eq!((names(&batch).len(), batch.end), (0, Some(RunEnd::NewLoad)));
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn an_invalid_scene_is_refused() {
    let mut node = Node::new();
    node.load.scene = b"version = 99".to_vec();
    let (mut session, mut batch) = (Session::default(), Batch::default());
    let result = node.publish(&mut session, header(0, 0), &[Change::Load], &mut batch);
    assert!(matches!(result, Err(LoadError::Scene(_))));
}

#[test]
fn a_late_recording_starts_with_the_torn_constraints_and_the_colliders() {
    let mut node = Node::new();
    node.torn.constraints = vec![cut(9), cut(1), cut(4)];
    node.torn.header = TearsHeader { new_count: 1, count: 3, ..tears_header(6) };
    node.colliders.header = colliders_header(2);
    node.colliders.colliders = vec![ColliderState::default(); 2];
    node.parameters.header = parameters_header(5);
    let start = |step| {
        let (mut session, mut batch) = (Session::default(), Batch::default());
        let header = SnapshotHeader { torn_count: 3, ..header(step, 0) };
        let changes = [Change::Load, keyframe(step)];
        node.publish(&mut session, header, &changes, &mut batch).unwrap();
        batch.sort();
        assert_eq!(missing_count(&session), 0);
        batch
    };
    let first = start(6);
    assert_eq!(torn_before(&first), [9, 1]);
    let expected = ["/colliders 2", "/parameters 5", "/tears 6", "/keyframe 6", "snapshot 6"];
    assert_eq!(names(&first), expected);
    assert_eq!(side_rows(&first), ["2: 2 colliders", "6: tore [4] by [\"cut\"]"]);
    let later = start(7);
    assert_eq!(torn_before(&later), [9, 1, 4]);
    assert_eq!(names(&later), ["/colliders 2", "/parameters 5", "/keyframe 7", "snapshot 7"]);
}

#[test]
fn the_recording_starts_only_with_a_complete_state() {
    let starts = |change: fn(&mut Node)| {
        let mut node = Node::new();
        change(&mut node);
        let (mut session, mut batch) = (Session::default(), Batch::default());
        let changes = [Change::Load, keyframe(4)];
        node.publish(&mut session, header(4, 0), &changes, &mut batch).unwrap();
        batch.header.is_some()
    };
    assert!(starts(|_| {}));
    assert!(!starts(|node| node.torn.header = TearsHeader::default()));
    assert!(!starts(|node| node.torn.constraints = vec![cut(1)]));
    assert!(!starts(|node| node.colliders.header = CollidersHeader::default()));
    assert!(!starts(|node| node.parameters.header = ParametersHeader::default()));
}

#[test]
fn parameters_of_the_next_step_follow_with_its_state() {
    let mut node = Node::new();
    node.parameters.header = parameters_header(5);
    let (mut session, mut batch) = (Session::default(), Batch::default());
    let changes = [Change::Load, keyframe(4)];
    node.publish(&mut session, header(4, 0), &changes, &mut batch).unwrap();
    batch.sort();
    assert_eq!(names(&batch), ["/keyframe 4", "snapshot 4"]);
    let changed = Change::Parameters(parameters_header(5), ParameterValues::default());
    let batch = publish(&mut session, header(5, 0), &[changed]);
    assert_eq!(names(&batch), ["/parameters 5", "snapshot 5"]);
}

#[test]
fn tears_colliders_and_events_precede_their_snapshot() {
    let (mut session, mut node) = (started(), Node::new());
    node.particles[0].flags = ParticleFlags::FROZEN;
    let second = CollidersHeader { list_index: 1, ..colliders_header(5) };
    let colliders = Change::Colliders(second, vec![ColliderState::default()]);
    let changes = [colliders, tears(5, &[0], 1), keyframe(5)];
    let header = SnapshotHeader { torn_count: 1, ..header(5, 2) };
    let mut batch = Batch::default();
    node.publish(&mut session, header, &changes, &mut batch).unwrap();
    batch.sort();
    let expected = ["/colliders 5", "/tears 5", "/keyframe 5", "/events 5", "snapshot 5"];
    assert_eq!(names(&batch), expected);
    let frozen = "5: particle 0 was not finite and is frozen";
    assert_eq!(side_rows(&batch), ["5: 1 colliders", "5: tore [0] by [\"cut\"]", frozen]);
    let counts = session.counts();
    for topic in [Topic::Colliders, Topic::Tears, Topic::Events] {
        assert_eq!((counts[topic].received, counts[topic].gaps), (1, 0), "{topic:?}");
    }
}
