//! Recordings of formats 4 and 5 are proved as before, and a recording of today does not pass as an older one,
//! nor as one of a scene that is turned.

use mcap::records::op;
use sim_solver::scene::Up;

use super::bytes::{metadata_bytes, metadata_of};
use super::{Record, file_of, records, topics, verified, written_with};
use crate::log::{ContentSelection, LogOptions, LogReader, LogWriter, RunDescription, Topic};
use crate::proof_tests::edits::edit::MESSAGE_HEADER_SIZE_BYTES;

/// Changes the metadata of a record, if it has this name.
fn change_entry((opcode, body): &mut Record, name: &str, key: &str, value: Option<&str>) {
    if *opcode != op::METADATA || metadata_of(body).name != name {
        return;
    }
    let mut map = metadata_of(body).metadata;
    assert!(map.remove(key).is_some());
    map.extend(value.map(|value| (key.to_owned(), value.to_owned())));
    *body = metadata_bytes(name, &map);
}

/// Returns the bytes of a channel on `/keyframe` as in format 4.
fn plain_channel(body: &[u8]) -> Vec<u8> {
    let text =
        |text: &str| [&u32::try_from(text.len()).unwrap().to_le_bytes(), text.as_bytes()].concat();
    [&body[..2], &[0, 0], &text("/keyframe"), &text("application/octet-stream"), &[0; 4]].concat()
}

/// Removes the bends from a message on `/topology`.
fn remove_bends(body: &mut Vec<u8>) {
    let place = body.windows(8).position(|bytes| bytes == b",\"bends\"").unwrap();
    body.truncate(place);
    body.push(b'}');
}

fn as_format_5(records: &mut [Record]) {
    let topics = topics(records);
    for record in records.iter_mut() {
        change_entry(record, "run", "format_version", Some("5"));
        change_entry(record, "run", "bend_count", None);
        let (opcode, body) = record;
        if *opcode == op::MESSAGE && topics[usize::from(body[0])] == Some(Topic::Topology) {
            remove_bends(body);
        }
    }
}

fn as_format_4(records: &mut [Record]) {
    let topics = topics(records);
    for record in records.iter_mut() {
        change_entry(record, "run", "format_version", Some("4"));
        change_entry(record, "run", "up", None);
        change_entry(record, "run", "bend_count", None);
        change_entry(record, "recorder", "tf.written", Some("0"));
        let (opcode, body) = record;
        let is_topology = |id: u8| topics[usize::from(id)] == Some(Topic::Topology);
        let is_keyframe = |id: u8| topics[usize::from(id)] == Some(Topic::Keyframe);
        match *opcode {
            op::CHANNEL if is_keyframe(body[0]) => *body = plain_channel(body),
            op::MESSAGE if is_topology(body[0]) => remove_bends(body),
            op::MESSAGE if is_keyframe(body[0]) => {
                let (header, message) = body.split_at(MESSAGE_HEADER_SIZE_BYTES);
                let (fields, _) = super::not_compared::keyframe(message).unwrap();
                *body = [header, &message[fields.len()..]].concat();
            }
            _ => {}
        }
    }
}

#[test]
fn a_recording_of_format_4_is_identical_except_for_the_form_of_its_messages() {
    let mut records = records(&written_with(ContentSelection::default()));
    as_format_4(&mut records);
    let (finding, not_covered) = verified(&file_of(&records));
    assert_eq!(finding, None);
    assert!(not_covered.iter().any(|line| line.contains("because the format is older")));
}

#[test]
fn a_recording_of_format_5_needs_no_bends() {
    let file = written_with(ContentSelection::default());
    let mut old = records(&file);
    as_format_5(&mut old);
    let (finding, not_covered) = verified(&file_of(&old));
    assert_eq!(finding, None);
    assert!(not_covered.iter().any(|line| line.contains("because the format is older")));

    let topics = topics(&old);
    let mut without = records(&file);
    let is_topology = |(opcode, body): &&mut Record| {
        *opcode == op::MESSAGE && topics[usize::from(body[0])] == Some(Topic::Topology)
    };
    remove_bends(&mut without.iter_mut().find(is_topology).unwrap().1);
    let (finding, _) = verified(&file_of(&without));
    assert!(finding.is_some(), "a recording of today has them");
}

#[test]
fn a_recording_with_another_axis_up_than_its_scene_is_found() {
    let file = written_with(ContentSelection::default());
    let mut log = LogReader::new(file.as_slice()).unwrap();
    let run = RunDescription { up: Up::Z, ..log.run().clone() };
    let options = LogOptions::default();
    let mut turned = LogWriter::create(Vec::new(), options, &run, log.scene(), 0).unwrap();
    while let Some(logged) = log.next_message().unwrap() {
        turned.write(&logged.message, logged.log_time_ns).unwrap();
    }
    let (finding, _) = verified(&turned.finish(log.closing().unwrap()).unwrap());
    let expected = "its 'up' is not that of the scene";
    assert!(finding.as_ref().is_some_and(|text| text.contains(expected)), "{finding:?}");
}

#[test]
fn a_recording_of_today_that_claims_an_older_format_is_found() {
    let mut records = records(&written_with(ContentSelection::default()));
    for record in &mut records {
        change_entry(record, "run", "format_version", Some("4"));
    }
    let (finding, _) = verified(&file_of(&records));
    let expected = "the metadata 'run': its format_version is older than /keyframe";
    assert!(finding.as_ref().is_some_and(|text| text.contains(expected)), "{finding:?}");
}
