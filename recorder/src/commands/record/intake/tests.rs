//! The start, the end and the order of a recording, and the counts of missing messages. The batches
//! are built by hand.

use sim_contract::{
    Action, ColliderState, CollidersHeader, Command, ConstraintState, NodeStatus,
    OUTCOME_FLAG_CONTROL, Outcome, ParameterValues, ParametersHeader, ParticleFlags, ParticleState,
    TearCause, TearsHeader, TornConstraint, Update,
};

use recorder::Topic;

use super::*;
use crate::commands::record::accepted::RunEnd;
use crate::commands::record::queue::Content;

const RUN_ID: u64 = 77;
const NOW: Now = Now { realtime_ns: 5_000_000_000, monotonic_ns: 2_000_000_000 };

fn header(step: u64, outcome_count: u64) -> SnapshotHeader {
    SnapshotHeader {
        run_id: RUN_ID,
        step,
        outcome_count,
        particle_count: 1,
        // One second ago.
        publish_monotonic_ns: 1_000_000_000,
        ..SnapshotHeader::default()
    }
}

fn add_load(batch: &mut Batch) {
    let load = LoadHeader { run_id: RUN_ID, rate_hz: 10, count: 1, ..LoadHeader::default() };
    batch.add_update(Update::Scene(&load, b"version = 1\nname = \"dot\"\nsolver.rate_hz = 10\n"));
    batch.add_update(Update::Topology(&load, &[ConstraintState::default()]));
    batch.add_update(Update::Surface(&load, &[]));
    batch.add_update(Update::Colliders(
        &CollidersHeader { run_id: RUN_ID, ..Default::default() },
        &[],
    ));
    add_tears(batch, 0, &[], 0);
    add_parameters(batch, 0);
}

fn add_snapshot(batch: &mut Batch, header: &SnapshotHeader) {
    batch.add_snapshot(header, &[ParticleState::default()]);
}

/// Adds a list of cut constraints.
fn add_tears(batch: &mut Batch, step: u64, torn: &[u32], new_count: u32) {
    let count = u32::try_from(torn.len()).unwrap();
    let header = TearsHeader { run_id: RUN_ID, step, since_step: 0, new_count, count };
    let cut = |one: &u32| TornConstraint::new(*one, Some(TearCause::Cut));
    let torn: Vec<_> = torn.iter().map(cut).collect();
    batch.add_update(Update::Tears(&header, &torn));
}

fn add_parameters(batch: &mut Batch, step: u64) {
    let header = ParametersHeader { run_id: RUN_ID, step, ..ParametersHeader::default() };
    batch.add_update(Update::Parameters(&header, &ParameterValues::default()));
}

fn add_keyframe(batch: &mut Batch, step: u64) {
    let header = KeyframeHeader { run_id: RUN_ID, step, size_bytes: 1 };
    batch.add_update(Update::Keyframe(&header, &[1]));
}

fn outcome(index: u64, step: u64) -> Outcome {
    Outcome::new(index, step, Command::new(1, index, Action::Reset), Ok(()))
}

/// Returns names such as "snapshot 3" and "/keyframe 3".
fn names(accepted: &Accepted) -> Vec<String> {
    let name = |content: &Content| match content {
        Content::Snapshot(row, _) => format!("snapshot {}", row.step),
        Content::Update(message) => format!("{} {}", message.topic().name(), message.step()),
    };
    accepted.contents.iter().map(name).collect()
}

/// An intake that started at step 4, after two outcomes.
fn started() -> Intake {
    let mut intake = Intake::default();
    let mut batch = Batch::default();
    add_load(&mut batch);
    add_snapshot(&mut batch, &header(4, 2));
    add_keyframe(&mut batch, 4);
    assert!(intake.accept(batch, NOW).unwrap().header.is_some());
    intake
}

#[test]
fn the_recording_starts_at_the_first_snapshot_with_a_keyframe() {
    let mut intake = Intake::default();
    let mut batch = Batch::default();
    add_load(&mut batch);
    add_keyframe(&mut batch, 1);
    add_snapshot(&mut batch, &header(2, 0));
    assert!(names(&intake.accept(batch, NOW).unwrap()).is_empty());

    let mut batch = Batch::default();
    for step in 3..6 {
        add_snapshot(&mut batch, &header(step, 0));
    }
    add_keyframe(&mut batch, 4);
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!(
        names(&accepted),
        ["/topology 0", "/surface 0", "/parameters 0", "/keyframe 4", "snapshot 4", "snapshot 5"]
    );
    let run = accepted.header.unwrap().run;
    assert_eq!((run.scene_name.as_str(), run.rate_hz, run.constraint_count), ("dot", 10, 1));
    // Published at a wall-clock time of 4 s, in step 4 at 10 Hz.
    assert_eq!(run.epoch_ns, 4_000_000_000 - 400_000_000);
    assert_eq!(intake.first_step(), Some(4));
}

#[test]
fn a_keyframe_that_arrives_after_its_snapshot_starts_the_recording() {
    let mut intake = Intake::default();
    let mut batch = Batch::default();
    add_load(&mut batch);
    add_snapshot(&mut batch, &header(9, 0));
    batch.add_update(Update::Outcome(&outcome(0, 10)));
    assert!(names(&intake.accept(batch, NOW).unwrap()).is_empty());
    let mut batch = Batch::default();
    add_keyframe(&mut batch, 9);
    let accepted = intake.accept(batch, NOW).unwrap();
    let expected =
        ["/topology 0", "/surface 0", "/parameters 0", "/keyframe 9", "snapshot 9", "/outcomes 10"];
    assert_eq!(names(&accepted), expected);
}

#[test]
fn an_outcome_before_the_first_snapshot_is_kept() {
    let mut intake = Intake::default();
    let mut batch = Batch::default();
    add_load(&mut batch);
    batch.add_update(Update::Outcome(&outcome(0, 1)));
    assert!(names(&intake.accept(batch, NOW).unwrap()).is_empty());
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &header(0, 0));
    add_keyframe(&mut batch, 0);
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!(names(&accepted)[3..], ["/keyframe 0", "snapshot 0", "/outcomes 1"]);
    assert_eq!(intake.counts().missing(), 0);
}

#[test]
fn the_recording_ends_with_the_last_requested_step_and_counts_nothing_after_it() {
    let mut intake = Intake::new(Some(2));
    let mut batch = Batch::default();
    add_load(&mut batch);
    for step in [0, 1, 2, 5] {
        add_snapshot(&mut batch, &header(step, step));
        add_keyframe(&mut batch, step);
        batch.add_update(Update::Outcome(&outcome(step, step + 1)));
    }
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!(accepted.end, Some(RunEnd::EndStep));
    let expected = [
        "/keyframe 0",
        "snapshot 0",
        "/keyframe 1",
        "/outcomes 1",
        "snapshot 1",
        "/keyframe 2",
        "/outcomes 2",
        "snapshot 2",
    ];
    assert_eq!(names(&accepted)[3..], expected);
    assert_eq!(intake.counts().missing(), 0);
    assert_eq!(intake.counts()[Topic::Particles].received, 3);
}

#[test]
fn a_batch_is_written_in_the_order_of_publication() {
    let mut intake = started();
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &header(5, 3));
    add_snapshot(&mut batch, &header(6, 4));
    for run_id in [RUN_ID, RUN_ID + 1] {
        let status = NodeStatus { run_id, step: 5, ..NodeStatus::default() };
        batch.add_update(Update::Status(&status));
    }
    for step in [5, 6, 7] {
        add_keyframe(&mut batch, step);
    }
    for (index, step) in [(2, 5), (3, 6), (4, 7)] {
        batch.add_update(Update::Outcome(&outcome(index, step)));
    }
    let expected = [
        "/keyframe 5",
        "/outcomes 5",
        "/status 5",
        "snapshot 5",
        "/keyframe 6",
        "/outcomes 6",
        "snapshot 6",
        "/keyframe 7",
        "/outcomes 7",
    ];
    assert_eq!(names(&intake.accept(batch, NOW).unwrap()), expected);
    assert_eq!(intake.counts().missing(), 0);
}

#[test]
fn outcomes_of_the_first_state_and_answers_of_a_replay_are_skipped() {
    let mut intake = started();
    let mut batch = Batch::default();
    batch.add_update(Update::Outcome(&outcome(1, 4)));
    let control = Outcome { flags: OUTCOME_FLAG_CONTROL, ..outcome(2, 5) };
    batch.add_update(Update::Outcome(&control));
    assert!(names(&intake.accept(batch, NOW).unwrap()).is_empty());
    assert_eq!(intake.counts().missing(), 0);
}

#[test]
fn missing_outcomes_are_counted() {
    let mut intake = started();
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &header(5, 4));
    batch.add_update(Update::Outcome(&outcome(3, 5)));
    intake.accept(batch, NOW).unwrap();
    assert_eq!(intake.counts()[Topic::Outcomes].gaps, 1);
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &header(6, 9));
    intake.accept(batch, NOW).unwrap();
    assert_eq!(intake.counts()[Topic::Outcomes].gaps, 6, "including those at the end");
}

#[test]
fn missing_snapshots_are_counted_by_the_stride_of_the_node() {
    let mut intake = started();
    let mut batch = Batch::default();
    // The node paused at step 30. Steps 20, 24 and 36 are missing.
    for step in [8, 12, 16, 28, 30, 32, 40] {
        add_snapshot(&mut batch, &SnapshotHeader { stride: 4, ..header(step, 2) });
    }
    intake.accept(batch, NOW).unwrap();
    let counts = intake.counts();
    assert_eq!(counts[Topic::Particles].gaps, 3);
    assert_eq!((counts[Topic::Particles].received, counts[Topic::Steps].received), (8, 8));
}

#[test]
fn missing_keyframes_are_counted() {
    let mut intake = started();
    let mut batch = Batch::default();
    for (step, keyframe_step) in [(5, 4), (6, 6), (7, 7), (8, 7)] {
        add_snapshot(&mut batch, &SnapshotHeader { keyframe_step, ..header(step, 2) });
    }
    add_keyframe(&mut batch, 7);
    // A keyframe that was read before its snapshot does not affect those in between.
    add_keyframe(&mut batch, 11);
    intake.accept(batch, NOW).unwrap();
    assert_eq!(intake.counts()[Topic::Keyframe].gaps, 1);
    let mut batch = Batch::default();
    for (step, keyframe_step) in [(9, 9), (10, 10), (11, 11)] {
        add_snapshot(&mut batch, &SnapshotHeader { keyframe_step, ..header(step, 2) });
    }
    intake.accept(batch, NOW).unwrap();
    assert_eq!(intake.counts()[Topic::Keyframe].gaps, 3);
}

#[test]
fn another_run_ends_the_recording_and_is_not_part_of_it() {
    let mut intake = started();
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &header(5, 3));
    add_snapshot(&mut batch, &SnapshotHeader { run_id: 78, ..header(0, 0) });
    batch.add_update(Update::Outcome(&outcome(2, 5)));
    batch.add_update(Update::Outcome(&outcome(3, 7)));
    let other = KeyframeHeader { run_id: 78, step: 9, size_bytes: 1 };
    batch.add_update(Update::Keyframe(&other, &[1]));
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!(names(&accepted), ["/outcomes 5", "snapshot 5"]);
    assert_eq!(accepted.end, Some(RunEnd::NewRun));
    assert_eq!(intake.counts().missing(), 0);
}

#[test]
fn another_load_ends_the_recording() {
    let mut intake = started();
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &SnapshotHeader { topology_revision: 1, ..header(5, 2) });
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!((names(&accepted).len(), accepted.end), (0, Some(RunEnd::NewLoad)));
}

#[test]
fn an_invalid_scene_is_refused() {
    let mut intake = Intake::default();
    let mut batch = Batch::default();
    add_load(&mut batch);
    let load = LoadHeader { run_id: RUN_ID, ..LoadHeader::default() };
    batch.add_update(Update::Scene(&load, b"version = 99"));
    add_snapshot(&mut batch, &header(0, 0));
    add_keyframe(&mut batch, 0);
    assert!(matches!(intake.accept(batch, NOW), Err(IntakeError::Scene(_))));
}

/// Returns the tears, the events and the number of colliders in each step.
fn side_rows(accepted: &Accepted) -> Vec<String> {
    let text = |content: &Content| match content {
        Content::Update(Message::Topology(row)) => Some(format!("torn {:?}", row.torn)),
        Content::Update(Message::Tears(row)) => {
            Some(format!("{}: tore {:?} by {:?}", row.step, row.constraints, row.causes))
        }
        Content::Update(Message::Colliders(row)) => {
            Some(format!("{}: {} colliders", row.step, row.colliders.len()))
        }
        Content::Update(Message::Event(row)) => Some(format!("{}: {}", row.step, row.text)),
        _ => None,
    };
    accepted.contents.iter().filter_map(text).collect()
}

fn add_colliders(batch: &mut Batch, step: u64, count: usize) {
    let header = CollidersHeader { run_id: RUN_ID, step, ..CollidersHeader::default() };
    batch.add_update(Update::Colliders(&header, &vec![ColliderState::default(); count]));
}

#[test]
fn a_late_recording_starts_with_the_torn_constraints_and_the_colliders() {
    let mut intake = Intake::default();
    let mut batch = Batch::default();
    add_load(&mut batch);
    add_tears(&mut batch, 3, &[0], 1);
    for step in [1, 2, 7] {
        add_colliders(&mut batch, step, 2);
    }
    for step in [6, 7] {
        add_snapshot(&mut batch, &SnapshotHeader { torn_count: 1, ..header(step, 0) });
        add_keyframe(&mut batch, step);
    }
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!(side_rows(&accepted), ["torn [0]", "2: 2 colliders", "7: 2 colliders"]);
    assert_eq!(
        names(&accepted)[..4],
        ["/topology 0", "/surface 0", "/parameters 0", "/colliders 2"]
    );
    assert_eq!(intake.counts().missing(), 0);
}

#[test]
fn the_recording_starts_only_when_the_torn_constraints_are_known() {
    let mut intake = Intake::default();
    let torn = |step| SnapshotHeader { torn_count: 1, ..header(step, 0) };
    let mut batch = Batch::default();
    add_load(&mut batch);
    add_snapshot(&mut batch, &torn(6));
    add_keyframe(&mut batch, 6);
    assert!(names(&intake.accept(batch, NOW).unwrap()).is_empty());
    let mut batch = Batch::default();
    add_tears(&mut batch, 5, &[0], 1);
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!(
        names(&accepted),
        ["/topology 0", "/surface 0", "/parameters 0", "/keyframe 6", "snapshot 6"]
    );
    assert_eq!(side_rows(&accepted), ["torn [0]"]);
}

#[test]
fn tears_colliders_and_events_precede_their_snapshot() {
    let mut intake = started();
    let mut batch = Batch::default();
    let frozen = ParticleState { flags: ParticleFlags::FROZEN, ..ParticleState::default() };
    batch.add_snapshot(&SnapshotHeader { torn_count: 1, ..header(5, 2) }, &[frozen]);
    add_keyframe(&mut batch, 5);
    add_tears(&mut batch, 5, &[0], 1);
    add_colliders(&mut batch, 5, 1);
    let accepted = intake.accept(batch, NOW).unwrap();
    let expected = ["/colliders 5", "/tears 5", "/keyframe 5", "/events 5", "snapshot 5"];
    assert_eq!(names(&accepted), expected);
    let frozen = "5: particle 0 was not finite and is frozen";
    assert_eq!(side_rows(&accepted), ["5: 1 colliders", "5: tore [0] by [\"cut\"]", frozen]);
    let counts = intake.counts();
    for topic in [Topic::Colliders, Topic::Tears, Topic::Events] {
        assert_eq!((counts[topic].received, counts[topic].gaps), (1, 0), "{topic:?}");
    }
}

#[test]
fn messages_of_another_load_are_not_part_of_the_recording() {
    let mut intake = started();
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &header(5, 2));
    add_tears(&mut batch, 6, &[], 0);
    add_colliders(&mut batch, 6, 3);
    assert_eq!(names(&intake.accept(batch, NOW).unwrap()), ["snapshot 5"]);
    let mut batch = Batch::default();
    add_snapshot(&mut batch, &SnapshotHeader { topology_revision: 1, ..header(6, 3) });
    let accepted = intake.accept(batch, NOW).unwrap();
    assert_eq!((names(&accepted).len(), accepted.end), (0, Some(RunEnd::NewLoad)));
    assert_eq!(intake.counts().missing(), 0);
}

#[test]
fn tears_before_and_after_a_reset_are_both_recorded() {
    let mut intake = started();
    for (step, since_step) in [(5, 0), (9, 8)] {
        let mut batch = Batch::default();
        let header_of_tears =
            TearsHeader { run_id: RUN_ID, step, since_step, new_count: 1, count: 1 };
        let torn = TornConstraint::new(0, Some(TearCause::Cut));
        batch.add_update(Update::Tears(&header_of_tears, &[torn]));
        add_snapshot(&mut batch, &SnapshotHeader { torn_count: 1, ..header(step, 2) });
        let accepted = intake.accept(batch, NOW).unwrap();
        assert_eq!(side_rows(&accepted), [format!("{step}: tore [0] by [\"cut\"]")]);
    }
    assert_eq!(intake.counts()[Topic::Tears].gaps, 0);
}
