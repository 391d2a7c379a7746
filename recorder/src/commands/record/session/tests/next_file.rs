//! Files that follow each other: a message between two files is in one of them, or one of them declares it as missing.

use std::sync::Arc;

use sim_contract::SnapshotFlags;

use super::*;
use crate::commands::record::queue::{Entry, Queue};
use crate::commands::record::report::{Report, Written};
use crate::commands::record::split::WritePosition;
use crate::commands::record::splitter::{SplitOptions, Splitter};

/// Ends the file before a state of [`Node::new`]. `messages` have arrived before it. Returns the last
/// contents of the file, and the messages that it leaves to the next one.
fn end_before(
    session: &mut Session,
    header: &SnapshotHeader,
    changes: &[Change],
    updates: &[Update<'_>],
) -> (Vec<String>, Messages) {
    let node = Node::new();
    let state = State {
        header,
        particles: &node.particles,
        load: &node.load,
        torn: &node.torn,
        colliders: &node.colliders,
        parameters: &node.parameters,
        changes,
    };
    let (mut messages, mut batch) = (Messages::default(), Batch::default());
    for update in updates {
        messages.add(update);
    }
    session.accept_before(&state, &mut messages, &mut batch);
    batch.sort();
    (names(&batch), messages)
}

#[test]
fn messages_of_earlier_steps_end_a_file_and_those_of_its_step_begin_the_next_one() {
    let mut session = started();
    let next = header(8, 5);
    let earlier = Change::Parameters(parameters_header(6), ParameterValues::default());
    let status = |step| NodeStatus { run_id: RUN_ID, step, ..NodeStatus::default() };
    let (outcomes, statuses) = ([outcome(2, 5), outcome(3, 7), outcome(4, 8)], [5, 8].map(status));
    let updates: Vec<_> =
        outcomes.iter().map(Update::Outcome).chain(statuses.iter().map(Update::Status)).collect();
    let changes = [earlier, keyframe(8)];
    let (last, messages) = end_before(&mut session, &next, &changes, &updates);
    assert_eq!(last, ["/outcomes 5", "/status 5", "/parameters 6", "/outcomes 7"]);
    assert_eq!(session.end_file(String::new()).missing(), [].into());
    let mut batch = Batch::default();
    Node::new().publish(&mut session, next, &changes, &mut batch).unwrap();
    session.accept_messages(messages, NOW, &mut batch);
    batch.sort();
    let expected = ["/parameters 0", "/outcomes 8", "/keyframe 8", "/status 8", "snapshot 8"];
    assert_eq!(names(&batch), expected);
    // Snapshots 5 to 7 are in neither file.
    let missing = [("/particles", 3), ("/steps", 3)];
    assert_eq!(session.closing(String::new()).missing(), missing.into());
}

#[test]
fn the_end_of_a_node_ends_the_file_of_its_run_only() {
    let mut splitter = Splitter::new(
        started(),
        Arc::new(Queue::new(1 << 20)),
        Arc::new(WritePosition::default()),
        SplitOptions::default(),
    );
    assert!(!splitter.end_file_of(RUN_ID + 1, "owner gone"), "this run has just started");
    assert_eq!(splitter.run_id(), Some(RUN_ID));
    assert!(splitter.end_file_of(RUN_ID, "owner gone"));
    assert_eq!(splitter.run_id(), None);
}

#[test]
fn files_of_one_run_have_one_epoch() {
    let mut session = started();
    end_before(&mut session, &header(5, 2), &[keyframe(5)], &[]);
    session.end_file(String::new());
    // Published later than its step says, as after a pause.
    let late = SnapshotHeader { publish_monotonic_ns: 1_700_000_000, ..header(5, 2) };
    let batch = publish(&mut session, late, &[keyframe(5)]);
    assert_eq!(batch.header.unwrap().run.epoch_ns, 3_600_000_000);
    assert_eq!(missing_count(&session), 0);
}

#[test]
fn the_missing_start_of_a_later_run_is_declared_unless_it_is_a_replay() {
    for (flags, missing) in [(0, 6), (SnapshotFlags::REPLAY, 0)] {
        let mut session = started();
        session.end_file(String::new());
        let first = SnapshotHeader { run_id: RUN_ID + 1, flags, ..header(3, 0) };
        let own = KeyframeHeader { run_id: RUN_ID + 1, ..keyframe_header(3) };
        let changes = [Change::Load, Change::Keyframe(own, vec![1])];
        let mut node = Node::new();
        for run_id in [&mut node.torn.header.run_id, &mut node.colliders.header.run_id] {
            *run_id = RUN_ID + 1;
        }
        node.parameters.header.run_id = RUN_ID + 1;
        let mut batch = Batch::default();
        node.publish(&mut session, first, &changes, &mut batch).unwrap();
        assert_eq!(batch.header.unwrap().run.run_id, RUN_ID + 1);
        assert_eq!(missing_count(&session), missing, "snapshots 0 to 2 on two topics");
    }
}

#[test]
fn the_last_requested_step_holds_across_files() {
    let mut session = Session::new(Some(3));
    publish(&mut session, header(4, 0), &[Change::Load, keyframe(4)]);
    session.end_file(String::new());
    let batch = publish(&mut session, header(5, 0), &[keyframe(5)]);
    assert_eq!(batch.end, None);
    publish(&mut session, header(6, 0), &[]);
    assert_eq!(publish(&mut session, header(7, 0), &[]).end, Some(RunEnd::EndStep));
}

/// Memory for what waits in the tests below: less than the start of three files.
const LIMIT_BYTES: usize = 1 << 16;

/// Publishes a state of a node, with its load.
fn feed_load(splitter: &mut Splitter, node: &mut Node, header: SnapshotHeader) {
    let SnapshotHeader { run_id, step, .. } = header;
    node.load.header.run_id = run_id;
    node.torn.header.run_id = run_id;
    node.colliders.header.run_id = run_id;
    node.parameters.header.run_id = run_id;
    let own = KeyframeHeader { run_id, ..keyframe_header(step) };
    let state = State {
        header: &header,
        particles: &node.particles,
        load: &node.load,
        torn: &node.torn,
        colliders: &node.colliders,
        parameters: &node.parameters,
        changes: &[Change::Load, Change::Keyframe(own, vec![1])],
    };
    splitter.accept_state(&state, &mut Messages::default()).unwrap();
    splitter.accept_messages(Messages::default());
}

/// Empties the queue. Returns the numbers of recorded snapshots, of missing snapshots and of missing outcomes that
/// the ends of files declare.
fn drain(queue: &Queue) -> [u64; 3] {
    let mut sums = [0; 3];
    while let Some(entry) = queue.pop() {
        let Entry::End(closing, _) = entry else { continue };
        let (steps, outcomes) = (closing.counts[Topic::Steps], closing.counts[Topic::Outcomes]);
        let found = [steps.received - steps.lost, steps.lost + steps.gaps, outcomes.gaps];
        sums.iter_mut().zip(found).for_each(|(sum, one)| *sum += one);
    }
    sums
}

#[test]
fn loads_and_runs_while_the_disk_stalls_take_bounded_memory_and_are_declared() {
    const LOADS: u32 = 300;
    let queue = Arc::new(Queue::new(LIMIT_BYTES));
    let options = SplitOptions { is_following: true, ..SplitOptions::default() };
    let mut splitter =
        Splitter::new(Session::default(), Arc::clone(&queue), Arc::default(), options);
    let mut node = Node::new();
    node.load.scene.extend(vec![b'#'; LIMIT_BYTES / 2]);
    for number in 0..LOADS {
        // Three runs, of which the last two begin while the disk stalls; a run has 100 loads and 50 outcomes.
        let (run, index) = (number / 100, number % 100);
        let (run_id, topology_revision) = (RUN_ID + u64::from(run), index);
        let first = header(index.into(), (index / 2).into());
        feed_load(&mut splitter, &mut node, SnapshotHeader { run_id, topology_revision, ..first });
        assert!(queue.size_bytes() < 2 * LIMIT_BYTES, "load {number}");
    }
    let before = drain(&queue);
    assert!(before[0] > 0 && before[0] < 4, "{before:?}");
    // The disk has caught up, so the next load begins a file.
    let next = SnapshotHeader { run_id: RUN_ID + 3, ..header(0, 0) };
    feed_load(&mut splitter, &mut node, next);
    splitter.end_file("signal".to_owned());
    let after = drain(&queue);
    assert_eq!(after[0], 1);
    assert_eq!(before[0] + before[1] + after[0] + after[1], u64::from(LOADS) + 1);
    assert_eq!(before[2] + after[2], 3 * 49);
    assert_eq!(splitter.undeclared(), AllCounts::default());
}

#[test]
fn what_no_file_declares_is_in_the_report() {
    let queue = Arc::new(Queue::new(LIMIT_BYTES));
    let options = SplitOptions { is_following: true, ..SplitOptions::default() };
    let mut splitter =
        Splitter::new(Session::default(), Arc::clone(&queue), Arc::default(), options);
    let mut node = Node::new();
    node.load.scene.extend(vec![b'#'; LIMIT_BYTES]);
    for step in 0..10 {
        let topology_revision = u32::try_from(step).unwrap();
        feed_load(
            &mut splitter,
            &mut node,
            SnapshotHeader { topology_revision, ..header(step, step) },
        );
    }
    let undeclared = splitter.undeclared();
    assert_eq!(undeclared[Topic::Steps].gaps, 9);
    assert_eq!(undeclared[Topic::Outcomes].gaps, 9);
    let mut written = Written::default();
    written.add_undeclared(&undeclared);
    let report = Report::new(&written, 0, "signal".to_owned());
    assert!(!report.is_complete());
    let text = report.to_string();
    let lost = "lost        /outcomes 9\nlost        /particles 9\nlost        /steps 9\n";
    assert!(text.contains(lost), "{text}");
}
