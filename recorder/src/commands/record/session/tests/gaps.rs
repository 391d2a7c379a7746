//! The counts of missing messages.

use sim_contract::{MemberChange, MemberChangeKind, NodeStatus};

use super::*;
use crate::commands::record::report::{Report, Written};

#[test]
fn missing_outcomes_are_counted() {
    let mut session = started();
    publish(&mut session, header(5, 4), &[]);
    send(&mut session, &[Update::Outcome(&outcome(3, 5))]);
    assert_eq!(session.counts()[Topic::Outcomes].gaps, 1);
    publish(&mut session, header(6, 9), &[]);
    assert_eq!(session.counts()[Topic::Outcomes].gaps, 6, "including those at the end");
}

#[test]
fn missing_states_are_counted_by_their_numbers_whatever_their_steps() {
    let mut session = started();
    let mut gaps = |steps_and_indices: &[(u64, u32)]| {
        for &(step, snapshot_index) in steps_and_indices {
            publish(&mut session, SnapshotHeader { snapshot_index, ..header(step, 2) }, &[]);
        }
        let counts = session.counts();
        assert_eq!(counts[Topic::Particles].gaps, counts[Topic::Steps].gaps);
        counts[Topic::Particles].gaps
    };
    // A node that publishes every tenth step pauses at step 13, makes two single steps and resumes.
    assert_eq!(gaps(&[(10, 5), (13, 6), (14, 7), (15, 8), (20, 9)]), 0);
    // It makes single steps again while the reader waits: steps 30, 31 and 32 never arrive.
    assert_eq!(gaps(&[(40, 13)]), 3);
    assert_eq!(session.counts()[Topic::Steps].received, 7);
}

#[test]
fn missing_keyframes_are_counted() {
    let mut session = started();
    let mut publish = |step, keyframe_step, changes: &[Change]| {
        publish(&mut session, SnapshotHeader { keyframe_step, ..header(step, 2) }, changes);
        session.counts()[Topic::Keyframe].gaps
    };
    assert_eq!(publish(5, 4, &[]), 0);
    assert_eq!(publish(6, 6, &[]), 1);
    assert_eq!(publish(7, 7, &[keyframe(7)]), 1);
    assert_eq!(publish(8, 7, &[]), 1);
    assert_eq!(publish(9, 9, &[]), 2);
}

#[test]
fn dropped_changes_are_counted_from_the_start_on() {
    let mut session = Session::default();
    let lost = |count| LostChanges { parameters: count, ..Default::default() };
    session.set_lost(lost(5));
    publish(&mut session, header(4, 2), &[Change::Load, keyframe(4)]);
    assert_eq!(missing_count(&session), 0);
    session.set_lost(lost(6));
    assert_eq!(session.counts()[Topic::Parameters].gaps, 1);
}

#[test]
fn missing_lists_of_colliders_are_counted_by_their_numbers() {
    let mut session = started();
    let list = |step, list_index| {
        let header = CollidersHeader { list_index, ..colliders_header(step) };
        Change::Colliders(header, vec![ColliderState::default()])
    };
    publish(&mut session, header(5, 2), &[list(5, 1)]);
    assert_eq!(session.counts()[Topic::Colliders].gaps, 0);
    publish(&mut session, header(6, 2), &[list(6, 5), list(6, 6)]);
    assert_eq!(session.counts()[Topic::Colliders].gaps, 3);
}

#[test]
fn tears_that_never_arrived_are_counted() {
    let mut session = started();
    publish(&mut session, SnapshotHeader { torn_count: 1, ..header(5, 2) }, &[tears(5, &[0], 1)]);
    assert_eq!(session.counts()[Topic::Tears].gaps, 0);
    publish(&mut session, SnapshotHeader { torn_count: 3, ..header(6, 2) }, &[]);
    assert_eq!(session.counts()[Topic::Tears].gaps, 2);
    publish(&mut session, header(7, 3), &[tears(7, &[], 0)]);
    assert_eq!(session.counts()[Topic::Tears].gaps, 0, "after a reset");
}

fn unreadable() -> ReadError {
    ReadError::Malformed { service: "sim/tears".to_owned(), detail: "no list".to_owned() }
}

/// Adds errors. Returns `true` if they are reported.
fn add_errors(session: &mut Session, count: usize) -> bool {
    session.count_unreadable(&vec![unreadable(); count]).is_some()
}

#[test]
fn unreadable_messages_are_counted_from_the_start_on_and_make_the_report_incomplete() {
    let mut session = Session::default();
    add_errors(&mut session, 1);
    // Without its keyframe, no recording starts at this state.
    publish(&mut session, header(4, 0), &[Change::Load]);
    add_errors(&mut session, 1);
    add_errors(&mut session, 1);
    publish(&mut session, header(5, 0), &[keyframe(5)]);
    add_errors(&mut session, 1);
    assert!(session.first_step() == Some(5) && session.unreadable == 0, "{session:?}");
    add_errors(&mut session, 2);
    publish(&mut session, header(6, 0), &[]);
    add_errors(&mut session, 1);
    let closing = session.closing("signal".to_owned());
    assert_eq!(closing.missing(), [("unreadable", 3)].into());
    let mut written = Written::default();
    written.add("run.mcap".into(), &closing, Some((5, 6)));
    assert!(!Report::new(&written, 0, String::new()).is_complete());
}

#[test]
fn unreadable_messages_between_the_first_state_and_its_keyframe_are_missing() {
    let mut session = Session::default();
    publish(&mut session, header(4, 0), &[Change::Load]);
    add_errors(&mut session, 1);
    add_errors(&mut session, 1);
    publish(&mut session, header(5, 0), &[keyframe(4)]);
    add_errors(&mut session, 1);
    assert_eq!((session.first_step(), session.unreadable), (Some(4), 2));
}

#[test]
fn the_first_unreadable_message_before_the_start_and_the_first_after_it_are_reported() {
    let mut session = Session::default();
    assert_eq!([1, 0, 2].map(|count| add_errors(&mut session, count)), [true, false, false]);
    publish(&mut session, header(4, 0), &[Change::Load, keyframe(4)]);
    assert_eq!(
        [1, 0, 1, 1].map(|count| add_errors(&mut session, count)),
        [false, false, true, false]
    );
}

#[test]
fn changes_of_the_lockstep_are_recorded_once_and_missing_ones_are_counted() {
    let mut status = NodeStatus { run_id: header(4, 2).run_id, step: 4, ..NodeStatus::default() };
    let mut change = |count: u64| {
        for client_id in 0..count {
            let kind = MemberChangeKind::TimedOut as u32;
            status.member_changes.add(MemberChange { client_id, step: 5, every: 1, kind });
        }
        status
    };
    let mut session = Session::default();
    // The status before the start names two changes that precede the recording.
    send(&mut session, &[Update::Status(&change(2))]);
    publish(&mut session, header(4, 2), &[Change::Load, keyframe(4)]);
    let mut rows = |status: &NodeStatus| side_rows(&send(&mut session, &[Update::Status(status)]));
    let dropped = "5: client 0 was dropped from the lockstep: it was not ready in time";
    assert_eq!(rows(&change(1)), [dropped]);
    assert_eq!(rows(&change(0)), Vec::<String>::new());
    assert_eq!(rows(&change(40)).len(), 32);
    assert_eq!(session.counts()[Topic::Events].gaps, 8);
}

#[test]
fn changes_of_the_lockstep_between_two_files_are_missing() {
    let mut status = NodeStatus { run_id: RUN_ID, step: 4, ..NodeStatus::default() };
    let mut session = started();
    send(&mut session, &[Update::Status(&status)]);
    assert_eq!(session.end_file(String::new()).missing(), [].into());
    publish(&mut session, header(8, 2), &[keyframe(8)]);
    // The first precedes the recording, the second is in neither file, the third in this one.
    for (client_id, step) in [(0, 3), (1, 6), (2, 8)] {
        let kind = MemberChangeKind::TimedOut as u32;
        status.member_changes.add(MemberChange { client_id, step, every: 1, kind });
    }
    status.step = 8;
    let rows = side_rows(&send(&mut session, &[Update::Status(&status)]));
    assert_eq!(rows, ["8: client 2 was dropped from the lockstep: it was not ready in time"]);
    assert_eq!(session.counts()[Topic::Events].gaps, 1);
}

#[test]
fn a_message_behind_its_written_snapshot_is_missing_and_one_before_it_is_not() {
    let mut session = started();
    let mut batch = publish(&mut session, header(5, 2), &[]);
    // Both arrive with the next states, as over a tunnel.
    Node::new().publish(&mut session, header(6, 2), &[tears(5, &[0], 1)], &mut batch).unwrap();
    batch.sort();
    assert_eq!(names(&batch), ["/tears 5", "snapshot 5", "snapshot 6"]);
    session.mark_written();
    let late = publish(&mut session, header(7, 2), &[tears(6, &[1], 2), keyframe(6)]);
    assert_eq!(names(&late), ["snapshot 7"]);
    let counts = session.counts();
    assert_eq!((counts[Topic::Tears].received, counts[Topic::Keyframe].gaps), (1, 0));
    assert!(counts[Topic::Tears].gaps > 0, "{counts:?}");
}

#[test]
fn outcomes_of_later_steps_wait_for_their_states_up_to_the_end_of_the_file() {
    let mut session = started();
    publish(&mut session, header(5, 2), &[]);
    let batch = send(
        &mut session,
        &[2, 3, 4].map(|index| outcome(index, 4 + index)).each_ref().map(Update::Outcome),
    );
    assert_eq!(names(&batch), ["/outcomes 6"]);
    let mut batch = publish(&mut session, header(6, 3), &[]);
    add(&mut session, &[], &mut batch);
    assert_eq!(names(&batch), ["snapshot 6", "/outcomes 7"]);
    let mut batch = publish(&mut session, header(7, 4), &[]);
    add(&mut session, &[], &mut batch);
    assert_eq!(names(&batch), ["snapshot 7", "/outcomes 8"]);
    let far = send(&mut session, &[Update::Outcome(&outcome(5, 20))]);
    assert!(names(&far).is_empty());
    let mut rest = Batch::default();
    session.accept_rest(&mut rest);
    assert_eq!(names(&rest), ["/outcomes 20"]);
    assert_eq!(missing_count(&session), 0);
}
