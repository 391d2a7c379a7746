//! No edit of a recording goes unnoticed, even if every checksum and the index are gone.
//!
//! Each content of a small recording is changed in turn: every value of every JSON message, bytes of
//! the other messages, and the bytes of the header, the metadata, the scene, the schemas and the
//! channels. Every edit is found, or the report says that the content is not compared.

mod bytes;
mod edit;
mod insertions;
mod json;
mod not_compared;
mod older_format;

use std::sync::atomic::AtomicBool;

use crate::log::{
    Closing, ContentSelection, LogOptions, LogReader, LogWriter, Message, StatusRow, Topic,
    parse_commands,
};
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};
use sim_contract::NodeStatus;
use sim_solver::{Scene, Solver};

use bytes::{byte_edits, message_header_edits, metadata_edits};
use edit::{Change, Edit, MESSAGE_HEADER_SIZE_BYTES};
use json::json_edits;
use not_compared::not_compared;

use crate::proof_tests::{ALL, finish};
use crate::simulation::{Job, States, simulate};
use crate::verification::{Verdict, verify};

/// A scene whose recording has every topic: a particle that freezes, a cut, a moving collider,
/// and bends.
const SCENE: &str = "
    version = 1
    name = 'edits'
    origin = [1, 2, 3]
    [solver]
    rate_hz = 2
    max_speed = 3e38
    [[particle]]
    position = [0, 9, 0]
    [[particle]]
    position = [1, 9, 0]
    [[constraint]]
    particles = [0, 1]
    rest_length = 1e30
    [[generate]]
    shape = 'cloth'
    columns = 2
    rows = 2
    spacing = 0.5
    pinned = 'top'
    bending = 1e-3
    [[bend]]
    particles = [0, 2, 3]
    rigidity = 0.5
    [[collider]]
    shape = 'sphere'
    center = [0, 20, 0]
    radius = 0.5
    velocity = [0.1, 0, 0]";
const COMMANDS: &str = r#"
    {"step":1,"kind":"cut","constraint":2}
    {"step":1,"kind":"pin","particle":4000}
    {"step":2,"kind":"set","parameter":"damping","value":0.5}
    {"step":2,"kind":"pin","particle":5}
    {"step":3,"kind":"pause"}"#;
const STEPS: u64 = 4;

/// A record of a file: its opcode and its bytes.
type Record = (u8, Vec<u8>);

/// A recording with every topic.
fn written() -> Vec<u8> {
    written_with(ContentSelection::default().with_forces().with_energy())
}

fn written_with(selection: ContentSelection) -> Vec<u8> {
    let scene = Scene::from_toml(SCENE, "edits.toml").unwrap();
    let commands = parse_commands(COMMANDS, "test").unwrap();
    let job = Job::new(scene, commands, STEPS);
    let mut solver = Solver::new(&job.scene);
    solver.compute_forces(selection.has_topic(Topic::Forces));
    let (run, scene) = (job.description(&solver), job.scene.to_toml());
    let options = LogOptions { selection, ..LogOptions::default() };
    let mut log = LogWriter::create(Vec::new(), options, &run, scene.as_bytes(), 0).unwrap();
    let status = StatusRow::from(&NodeStatus { step: 0, ..NodeStatus::default() });
    log.write(&Message::Status(status), 0).unwrap();
    simulate(&job, States::first(solver), Some(&mut log), &AtomicBool::new(false), |_| {}).unwrap();
    let stop_reason = "steps reached".to_owned();
    let mut closing = Closing { stop_reason, unreadable: 0, counts: *log.counts() };
    closing.counts.set_received_to_written();
    log.finish(&closing).unwrap()
}

/// Writes other messages into the recording of the same run.
fn rewritten(file: &[u8], messages: &[Message]) -> Vec<u8> {
    let log = LogReader::new(file).unwrap();
    let options = LogOptions { selection: log.selection(), ..LogOptions::default() };
    let mut new = LogWriter::create(Vec::new(), options, log.run(), log.scene(), 0).unwrap();
    for message in messages {
        new.write(message, 0).unwrap();
    }
    finish(new, 0)
}

/// Returns the records of the data section, without chunks.
fn records(file: &[u8]) -> Vec<Record> {
    let mut reader = LinearReader::new();
    let (mut records, mut rest) = (Vec::new(), file);
    while let Some(event) = reader.next_event() {
        match event.unwrap() {
            LinearReadEvent::ReadRequest(count) => {
                let count = count.min(rest.len());
                reader.insert(count).copy_from_slice(&rest[..count]);
                reader.notify_read(count);
                rest = &rest[count..];
            }
            LinearReadEvent::Record { opcode: op::DATA_END, .. } => break,
            LinearReadEvent::Record { opcode: op::MESSAGE_INDEX, .. } => {}
            LinearReadEvent::Record { opcode, data } => records.push((opcode, data.to_vec())),
        }
    }
    records
}

/// Writes a file without chunks, checksums and index.
fn file_of(records: &[Record]) -> Vec<u8> {
    let mut file = mcap::MAGIC.to_vec();
    let end = [(op::DATA_END, vec![0; 4]), (op::FOOTER, vec![0; 20])];
    for (opcode, body) in records.iter().chain(&end) {
        let mut body = body.clone();
        if *opcode == op::ATTACHMENT {
            let crc = body.len() - 4;
            body[crc..].fill(0);
        }
        file.push(*opcode);
        file.extend((body.len() as u64).to_le_bytes());
        file.extend(body);
    }
    file.extend(mcap::MAGIC);
    file
}

/// Returns the result of a verification, and the content that it does not compare: `None` if it finds
/// no difference.
fn verified(file: &[u8]) -> (Option<String>, Vec<String>) {
    let log = match LogReader::new(file) {
        Ok(log) => log,
        Err(error) => return (Some(error.to_string()), Vec::new()),
    };
    let report = match verify(log, ALL, &AtomicBool::new(false), |_| {}) {
        Err(error) => return (Some(error.to_string()), Vec::new()),
        Ok(report) => report,
    };
    match report.incomplete_end() {
        Some(end) => (Some(end.to_string()), Vec::new()),
        None if report.verdict == Verdict::Identical => (None, report.not_covered),
        None => (Some(report.to_string()), report.not_covered),
    }
}

/// Returns every edit of a record.
fn edits(record: &Record, topics: &[Option<Topic>]) -> Vec<Edit> {
    let (opcode, body) = record;
    let (place, changes) = match *opcode {
        op::MESSAGE => {
            let topic = topics[usize::from(u16::from_le_bytes([body[0], body[1]]))].unwrap();
            let (header, data) = body.split_at(MESSAGE_HEADER_SIZE_BYTES);
            let mut changes = match topic {
                Topic::Tf | Topic::Keyframe | Topic::Particles => {
                    byte_edits(body, MESSAGE_HEADER_SIZE_BYTES)
                }
                _ => json_edits(data)
                    .into_iter()
                    .map(|edit| Change::new(&edit.what, [header, &edit.bytes].concat()))
                    .collect(),
            };
            changes.extend(message_header_edits(body));
            (topic.name().to_owned(), changes)
        }
        // The checksum of an attachment is gone too.
        op::ATTACHMENT => ("attachment".to_owned(), byte_edits(&body[..body.len() - 4], 0)),
        op::METADATA => {
            let name = body[4..4 + usize::from(body[0])].to_vec();
            (format!("metadata '{}'", String::from_utf8(name).unwrap()), metadata_edits(body))
        }
        // Before its text are the profile and the lengths.
        op::HEADER => ("header".to_owned(), byte_edits(body, 8)),
        op::SCHEMA => ("schema".to_owned(), byte_edits(body, 0)),
        _ => ("channel".to_owned(), byte_edits(body, 0)),
    };
    let pad = |bytes: Vec<u8>| {
        if *opcode == op::ATTACHMENT { [bytes, vec![0; 4]].concat() } else { bytes }
    };
    changes
        .into_iter()
        .map(|Change { what, bytes }| Edit {
            place: place.clone(),
            what,
            original: body.clone(),
            bytes: pad(bytes),
        })
        .collect()
}

/// Returns the topic of each channel, by its id.
fn topics(records: &[Record]) -> Vec<Option<Topic>> {
    let mut topics = vec![None; 64];
    for (_, body) in records.iter().filter(|(opcode, _)| *opcode == op::CHANNEL) {
        let Ok(mcap::records::Record::Channel(channel)) = mcap::parse_record(op::CHANNEL, body)
        else {
            panic!("a channel")
        };
        topics[usize::from(channel.id)] = Topic::from_name(&channel.topic);
    }
    topics
}

/// Returns the step of a message, from its sequence.
fn step_of(record: &Record) -> Option<u32> {
    let (opcode, body) = record;
    (*opcode == op::MESSAGE).then(|| u32::from_le_bytes([body[2], body[3], body[4], body[5]]))
}

#[test]
fn every_edit_is_found_or_named_as_not_compared() {
    let records = records(&written());
    let (finding, not_covered) = verified(&file_of(&records));
    assert_eq!(finding, None);
    let topics = topics(&records);
    let present = |topic: Topic| {
        let is_on = |(opcode, body): &Record| {
            *opcode == op::MESSAGE && topics[usize::from(body[0])] == Some(topic)
        };
        assert!(records.iter().any(is_on), "no message on {}", topic.name());
    };
    Topic::ALL.into_iter().for_each(present);
    let (mut unnoticed, mut unnamed, mut compared) = (Vec::new(), Vec::new(), Vec::new());
    for (place, record) in records.iter().enumerate() {
        for edit in edits(record, &topics) {
            let mut changed = records.clone();
            changed[place].1.clone_from(&edit.bytes);
            let (finding, _) = verified(&file_of(&changed));
            let name = format!("record {place} {}: {}", edit.place, edit.what);
            match (finding, not_compared(&edit)) {
                (Some(text), Some(_)) => compared.push(format!("{name}: {text}")),
                (Some(text), None) => {
                    // These edits change the place or the step of a message.
                    let is_moved = ["channel", "sequence", "publish_time", "/step", "/index"];
                    let step = step_of(record).filter(|_| !is_moved.contains(&&*edit.what));
                    let has_step = step.is_none_or(|step| text.contains(&format!("step {step}")));
                    let is_message = record.0 == op::MESSAGE && edit.what != "channel";
                    // A changed command shows in the state, or else in the id of the run.
                    let is_command = edit.place == "/outcomes" && edit.what.starts_with('/');
                    let has_place = !is_message || is_command || text.contains(&edit.place);
                    let is_run_id = is_command && text.contains("the commands in /outcomes");
                    if !has_place || !(has_step || is_run_id) {
                        unnamed.push(format!("{name}: {text}"));
                    }
                }
                (None, Some(words)) if not_covered.iter().any(|line| line.contains(words)) => {}
                (None, _) => unnoticed.push(name),
            }
        }
    }
    assert!(unnoticed.is_empty(), "{unnoticed:#?}");
    assert!(unnamed.is_empty(), "{unnamed:#?}");
    assert!(compared.is_empty(), "the report names these as not compared: {compared:#?}");
}

#[test]
fn every_missing_message_is_found() {
    let records = records(&written());
    for (place, (opcode, _)) in records.iter().enumerate() {
        if *opcode == op::MESSAGE {
            let mut changed = records.clone();
            changed.remove(place);
            assert!(verified(&file_of(&changed)).0.is_some(), "record {place}");
        }
    }
}
