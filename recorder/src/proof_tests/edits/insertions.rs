//! No message can be inserted unnoticed, even if the end of the file counts it.

use std::collections::BTreeMap;

use crate::log::{CollidersRow, EventRow, Message, StepRow, Topic};
use mcap::records::op;

use super::bytes::{metadata_bytes, metadata_of};
use super::{Record, file_of, records, topics, verified, written};
use crate::proof_tests::{check, rebuild, rebuild_with_gaps};
use crate::verification::{Verdict, VerifyReport};

/// Returns the topic of a message.
fn topic_of(record: &Record, topics: &[Option<Topic>]) -> Option<Topic> {
    let (opcode, body) = record;
    (*opcode == op::MESSAGE).then(|| topics[usize::from(body[0])].unwrap())
}

/// Counts one more message of a topic at the end of the file.
fn count_one_more(records: &mut [Record], topic: Topic) {
    let is_end = |(opcode, body): &&mut Record| {
        *opcode == op::METADATA && metadata_of(body).name == "recorder"
    };
    let (_, body) = records.iter_mut().find(is_end).unwrap();
    let mut map: BTreeMap<_, _> = metadata_of(body).metadata;
    for field in ["received", "written"] {
        let count = map.get_mut(&format!("{}.{field}", &topic.name()[1..])).unwrap();
        *count = (count.parse::<u64>().unwrap() + 1).to_string();
    }
    *body = metadata_bytes("recorder", &map);
}

#[test]
fn every_message_that_is_repeated_anywhere_is_found_or_named_as_not_compared() {
    let records = records(&written());
    let topics = topics(&records);
    let end = 1 + records.iter().rposition(|record| topic_of(record, &topics).is_some()).unwrap();
    let mut unnoticed = Vec::new();
    for (place, record) in records.iter().enumerate() {
        let Some(topic) = topic_of(record, &topics) else { continue };
        if topic == Topic::Tf {
            continue;
        }
        for at in place + 1..=end {
            let mut changed = records.clone();
            count_one_more(&mut changed, topic);
            changed.insert(at, record.clone());
            let (finding, not_covered) = verified(&file_of(&changed));
            let is_named = |words: &str| not_covered.iter().any(|line| line.contains(words));
            let is_noticed = finding.is_some()
                || topic == Topic::Status
                    && is_named("number and the values of messages on /status")
                || at == end && is_named("1 message after the last snapshot");
            if !is_noticed {
                unnoticed.push(format!("record {place} on {} at {at}", topic.name()));
            }
        }
    }
    assert!(unnoticed.is_empty(), "{unnoticed:#?}");
}

/// Inserts messages before the row of a step.
fn with_inserted(step: u64, inserted: &[Message]) -> VerifyReport {
    let file = written();
    let mut log = Vec::new();
    rebuild(&file, |message| {
        if matches!(&message, Message::Step(row) if row.step == step) {
            log.extend_from_slice(inserted);
        }
        log.push(message);
        None
    });
    check(&super::rewritten(&file, &log)).0
}

#[test]
fn rows_of_steps_after_the_last_snapshot_are_counted_as_not_compared() {
    let last = super::STEPS;
    let colliders = Message::Colliders(CollidersRow { step: 99, colliders: Vec::new() });
    let mut outcomes = Vec::new();
    rebuild(&written(), |message| {
        if let Message::Outcome(row) = &message {
            outcomes.push(row.clone());
        }
        None
    });
    let mut outcome = outcomes.pop().unwrap();
    (outcome.step, outcome.index) = (99, 1000);
    let report = with_inserted(last, &[colliders, Message::Outcome(outcome.clone())]);
    assert_eq!(report.verdict, Verdict::Identical, "{report}");
    let words = "2 messages after the last snapshot".to_owned();
    assert!(report.not_covered.contains(&words), "{:?}", report.not_covered);

    // An index between those of the file is missing, and one that is past is there twice.
    (outcome.step, outcome.index) = (last, 0);
    let report = with_inserted(last, &[Message::Outcome(outcome)]);
    assert!(report.to_string().contains("outcome 0 is in the file twice"), "{report}");
}

#[test]
fn a_row_of_steps_without_its_snapshot_is_an_error() {
    let row = StepRow { step: 1, ..StepRow::default() };
    let log = [Message::Step(row), Message::Step(StepRow { step: 2, ..row })];
    let file = super::rewritten(&written(), &log);
    let (finding, _) = verified(&file);
    let expected = "the row of step 1 in /steps is not followed by its snapshot in /particles";
    assert!(finding.as_deref().is_some_and(|text| text.contains(expected)), "{finding:?}");
}

#[test]
fn events_of_other_steps_are_compared_with_their_particles() {
    let event = |step, particle: u32| {
        let text = format!("particle {particle} was not finite and is frozen");
        let (kind, particle) = ("frozen".into(), Some(particle));
        Message::Event(EventRow { step, kind, particle, client_id: None, text })
    };
    // Nothing is missing before this step, so each event has the step of its snapshot.
    for inserted in [event(1, 0), event(3, 0), event(2, 4000), event(2, 3)] {
        let report = with_inserted(2, std::slice::from_ref(&inserted));
        let found = report.to_string();
        assert!(found.contains("step 2 differs: its events in /events"), "{inserted:?}: {found}");
    }
    // Without the snapshots of steps 1 and 2, the events of step 1 belong to that of step 3.
    let without = |inserted: &[Message]| {
        let is_missing = |step| step == 1 || step == 2;
        let mut inserted = inserted.to_vec();
        let file = rebuild_with_gaps(&written(), 2, |message| match &message {
            Message::Step(row) if is_missing(row.step) => Vec::new(),
            Message::Particles { step, .. } if is_missing(*step) => Vec::new(),
            Message::Step(row) if row.step == 3 => {
                [std::mem::take(&mut inserted), vec![message]].concat()
            }
            _ => vec![message],
        });
        check(&file).0
    };
    let report = without(&[]);
    assert_eq!(report.verdict, Verdict::Identical, "{report}");
    assert_eq!(report.lost, BTreeMap::from([("/particles", 2), ("/steps", 2)]));
    for inserted in [event(2, 4000), event(2, 3), event(0, 0), event(4, 0), event(3, 4000)] {
        let report = without(std::slice::from_ref(&inserted));
        let found = report.to_string();
        assert!(found.contains("its events in /events"), "{inserted:?}: {found}");
    }
}

#[test]
fn content_of_other_programs_is_named_as_not_compared() {
    let text = |text: &[u8]| [&u32::try_from(text.len()).unwrap().to_le_bytes(), text].concat();
    let schema = |data: &[u8]| {
        let parts = [vec![200, 0], text(b"other"), text(b"json"), text(data)];
        (op::SCHEMA, parts.concat())
    };
    let long = "a record longer than any of a recorder";
    let records = records(&written());
    for (data, words) in [("{}".to_owned(), "schema 'other'"), (" ".repeat(70_000), long)] {
        let mut changed = records.clone();
        changed.insert(records.len() - 1, schema(data.as_bytes()));
        let (finding, not_covered) = verified(&file_of(&changed));
        assert_eq!(finding, None);
        let expected = format!("{words}, which no recorder writes");
        assert!(not_covered.contains(&expected), "{not_covered:?}");
    }
}
