//! No edit of a recorded state goes unnoticed, even if every checksum and the index are gone.
//!
//! Each value of a small recording on which a state depends is changed in turn: every value of every JSON message, and
//! bytes of the particles and keyframes. Every edit is found, or it is in the list of values that no state depends on.

mod json;

use std::sync::atomic::AtomicBool;

use crate::log::encoding::protobuf::decode_keyframe;
use crate::log::{
    Closing, ContentSelection, LogOptions, LogReader, LogWriter, Message, StatusRow, Topic,
    parse_commands,
};
use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};
use sim_messages::NodeStatus;
use sim_solver::{Keyframe, Scene, Solver};

use json::{Change, json_edits};

use crate::proof_tests::ALL;
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
const PARTICLE_COUNT: usize = 6;

/// A record of a file: its opcode and its bytes.
type Record = (u8, Vec<u8>);

/// A recording with every topic.
fn written() -> Vec<u8> {
    let selection =
        ContentSelection { has_forces: true, has_energy: true, ..ContentSelection::default() };
    let scene = Scene::from_toml(SCENE, "edits.toml").unwrap();
    let commands = parse_commands(COMMANDS, "test").unwrap();
    let job = Job::new(scene, commands, STEPS);
    let mut solver = Solver::new(&job.scene);
    solver.compute_forces(true);
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

/// Returns the difference that a verification finds, if there is one.
fn difference(file: &[u8]) -> Option<String> {
    let log = match LogReader::new(file) {
        Ok(log) => log,
        Err(error) => return Some(error.to_string()),
    };
    match verify(log, ALL, &AtomicBool::new(false), |_| {}) {
        Err(error) => Some(error.to_string()),
        Ok(report) => match report.incomplete_end() {
            Some(end) => Some(end.to_string()),
            None => (report.verdict != Verdict::Identical).then(|| report.to_string()),
        },
    }
}

/// Channel, sequence and two times.
const MESSAGE_HEADER_SIZE_BYTES: usize = 22;

/// Returns every edit of the content of a message.
fn edits(body: &[u8], topic: Topic) -> Vec<Change> {
    let (header, data) = body.split_at(MESSAGE_HEADER_SIZE_BYTES);
    let all = match topic {
        Topic::Tf => Vec::new(),
        Topic::Particles => byte_edits(data, data.len() - PARTICLE_COUNT * 32),
        Topic::Keyframe => byte_edits(data, 0),
        _ => json_edits(data),
    };
    let whole = |change: Change| Change { bytes: [header, &change.bytes].concat(), ..change };
    all.into_iter().map(whole).collect()
}

/// Returns the edits of some fifty bytes.
fn byte_edits(data: &[u8], from: usize) -> Vec<Change> {
    let stride = (data.len() / 40).max(1);
    let places = (from..data.len()).filter(|place| place % stride == 0 || data.len() - place < 8);
    places
        .map(|place| {
            let mut bytes = data.to_vec();
            bytes[place] ^= 1;
            Change { what: format!("byte {place}"), bytes }
        })
        .collect()
}

/// Returns `true` for a value that no state depends on.
fn is_free(topic: Topic, what: &str, before: &[u8], after: &[u8]) -> bool {
    let is_of_pause = || before.windows(14).any(|window| window == br#""kind":"pause""#);
    match topic {
        Topic::Status | Topic::Events => true,
        Topic::Steps => {
            ["/wake_late_ns", "/solve_ns", "/snapshot_index", "/topology_revision", "no energy"]
                .contains(&what)
        }
        // The revision of the load, and the step from which it counts.
        Topic::Topology | Topic::Surface => ["/step", "/revision"].contains(&what),
        Topic::Outcomes => match what {
            "/client_id" | "/sequence" | "no disconnected" | "disconnected" => true,
            "/status" | "/reason" => is_of_pause(),
            // No particle has either index.
            "/particle" => before.windows(10).any(|window| window == br#""rejected""#),
            // `pause` and `resume` concern the node.
            _ => is_of_pause() && what == "/kind",
        },
        // A recorder does not know the causes of tears that it has missed.
        Topic::Tears => what == "no causes" || after.windows(9).any(|one| one == br#""unknown""#),
        // A missing key has its default, which most of them have.
        Topic::Parameters => what == "/time_scale" || what.starts_with("no "),
        Topic::Keyframe => is_only_paused(before, after),
        // The path and solidity of a collider are in the scene, which the simulation reads.
        Topic::Colliders => ["/path", "/solid"].iter().any(|field| what.ends_with(field)),
        _ => false,
    }
}

/// Returns `true` if only the paused flag of a keyframe differs.
fn is_only_paused(before: &[u8], after: &[u8]) -> bool {
    let keyframe = |body: &[u8]| {
        let (step, bytes) = decode_keyframe(&body[MESSAGE_HEADER_SIZE_BYTES..]).ok()?;
        Some((step, Keyframe::decode(&bytes).ok()?))
    };
    let (Some((step, mut old)), Some((new_step, new))) = (keyframe(before), keyframe(after)) else {
        return false;
    };
    old.paused = new.paused;
    step == new_step && old == new
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

/// Returns the topic of a message.
fn topic_of(record: &Record, topics: &[Option<Topic>]) -> Option<Topic> {
    let (opcode, body) = record;
    (*opcode == op::MESSAGE).then(|| topics[usize::from(body[0])].unwrap())
}

#[test]
fn every_edit_of_a_value_that_a_state_depends_on_is_found() {
    let records = records(&written());
    assert_eq!(difference(&file_of(&records)), None);
    let topics = topics(&records);
    for topic in Topic::ALL {
        let is_present = records.iter().any(|record| topic_of(record, &topics) == Some(topic));
        assert!(is_present, "no message on {}", topic.name());
    }
    let mut wrong = Vec::new();
    for (place, record) in records.iter().enumerate() {
        let Some(topic) = topic_of(record, &topics) else { continue };
        for Change { what, bytes } in edits(&record.1, topic) {
            let is_free = is_free(topic, &what, &record.1, &bytes);
            let mut changed = records.clone();
            changed[place].1 = bytes;
            // A value without an effect may be refused for its form.
            let is_found = difference(&file_of(&changed)).is_some();
            if !is_found && !is_free {
                wrong.push(format!("record {place} {}: {what}", topic.name()));
            }
        }
    }
    assert!(wrong.is_empty(), "not found: {wrong:#?}");
}

#[test]
fn every_missing_message_with_a_part_of_a_state_is_found() {
    let records = records(&written());
    let topics = topics(&records);
    let of_states = [Topic::Outcomes, Topic::Steps, Topic::Particles];
    let last = records.iter().rposition(|one| topic_of(one, &topics) == Some(Topic::Steps));
    // Without the last ones, the recording ends earlier.
    for (place, record) in records.iter().enumerate().take(last.unwrap()) {
        if topic_of(record, &topics).is_some_and(|topic| of_states.contains(&topic)) {
            let mut changed = records.clone();
            changed.remove(place);
            assert!(difference(&file_of(&changed)).is_some(), "record {place}");
        }
    }
}

#[test]
fn a_message_that_is_there_twice_is_found() {
    let records = records(&written());
    let topics = topics(&records);
    let states = [
        Topic::Topology,
        Topic::Surface,
        Topic::Colliders,
        Topic::Tears,
        Topic::Parameters,
        Topic::Forces,
        Topic::Keyframe,
        Topic::Outcomes,
        Topic::Steps,
        Topic::Particles,
    ];
    let is_snapshot = |one: &Record| topic_of(one, &topics) == Some(Topic::Particles);
    let last = records.iter().rposition(is_snapshot).unwrap();
    // Rows before the first snapshot replace earlier ones.
    let first = records.iter().position(is_snapshot).unwrap();
    for (place, record) in records.iter().enumerate() {
        if topic_of(record, &topics).is_some_and(|topic| states.contains(&topic)) {
            for at in place.max(first) + 1..last {
                let mut changed = records.clone();
                changed.insert(at, record.clone());
                assert!(difference(&file_of(&changed)).is_some(), "record {place} again at {at}");
            }
        }
    }
}
