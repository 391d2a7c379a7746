//! Recordings read back as they were written, and unreadable files are named.
//!
//! Small recordings are built in memory, then truncated, damaged or replaced.

use std::io::{Cursor, Read};

use recording::{
    Closing, CollidersRow, EventRow, FrameReader, LogEnd, LogOptions, LogReader, LogWriter,
    LoggedMessage, Message, OutcomeRow, ParametersRow, ReadError, RunDescription, StatusRow,
    StepRow, SurfaceRow, TearsRow, Topic, TopologyRow, Up, WriteError,
};
use sim_messages::{
    Action, BendState, ColliderState, Command, ConstraintState, LoadHeader, NodeStatus, Outcome,
    ParameterValues, ParticleState, Reason, Triangle,
};

fn run() -> RunDescription {
    RunDescription {
        run_id: u64::MAX,
        epoch_ns: 1_700_000_000_000_000_001,
        scene_name: "two points".to_owned(),
        origin: [1.0, 2.0, 3.0],
        up: Up::Y,
        rate_hz: 240,
        method: 0,
        particle_count: 2,
        constraint_count: 1,
        bend_count: 1,
        solver_version: 1,
        contract_version: 1,
        recorder_version: "0.1.0".to_owned(),
    }
}

const SCENE: &[u8] = b"version = 1\nname = \"two points\"\n";

fn step_row(step: u64) -> StepRow {
    StepRow {
        step,
        scene_step: step,
        state_hash: 0x00ab_0000_0000_0000 + step,
        topology_revision: 0,
        torn_count: 0,
        outcome_count: 2,
        wake_late_ns: u64::MAX,
        solve_ns: 5,
        snapshot_index: 7,
        energy: None,
    }
}

fn particles(step: u64) -> Vec<ParticleState> {
    let bits = u32::try_from(step).unwrap();
    let odd = ParticleState {
        position: [-0.0, f32::from_bits(0x7fc0_0001 + bits), f32::INFINITY],
        inverse_mass: 1.0 / 3.0,
        velocity: [1.0e-45, bits as f32, -1.5],
        flags: bits,
    };
    vec![odd, ParticleState::default()]
}

fn outcomes() -> [OutcomeRow; 2] {
    let target = [f32::NEG_INFINITY, 0.1, -0.0];
    let grab = Command::new(7, 8, Action::Grab { particle: 1, target, over_s: 0.25 });
    let step = Command::new(9, 1 << 52, Action::Step { count: 3 });
    [
        OutcomeRow::from(&Outcome::new(0, 3, grab, Err(Reason::NonFinite))),
        OutcomeRow::from(&Outcome::new(1, 3, step, Ok(()))),
    ]
}

fn colliders(step: u64) -> CollidersRow {
    let floor = ColliderState { normal: [0.0, 1.0, 0.0], friction: 0.5, ..Default::default() };
    CollidersRow::new(step, &[floor]).unwrap()
}

fn messages() -> Vec<Message> {
    let load = LoadHeader { particle_count: 2, rate_hz: 240, ..LoadHeader::default() };
    let constraint = ConstraintState { a: 0, b: 1, rest_length: 0.1, compliance: 1e-7, kind: 2 };
    let bend = BendState {
        particles: [0, 1, 0, 1],
        coefficients: [0.5, -1.5, 1.0, 0.0],
        geometry: 1e-3,
        rigidity: 0.02,
        rest: 0.0,
        shape: 2,
        block: -1,
    };
    let mut status = NodeStatus { step: 3, real_time_factor: 0.999, ..NodeStatus::default() };
    status.set_scene_name("two points");
    let [rejected, applied] = outcomes();
    let mut messages = vec![
        Message::Topology(TopologyRow::new(&load, &[constraint], &[bend])),
        Message::Surface(SurfaceRow::new(&load, &[Triangle { corners: [0, 1, 0] }])),
        Message::Colliders(colliders(2)),
        Message::Tears(TearsRow { step: 2, constraints: vec![0], causes: vec!["cut".to_owned()] }),
        Message::Parameters(ParametersRow { step: 2, values: ParameterValues::default() }),
        Message::Keyframe { step: 2, bytes: vec![0, 255, 3] },
        Message::Step(step_row(2)),
        Message::Particles { step: 2, particles: particles(2) },
        Message::Outcome(rejected),
        Message::Outcome(applied),
        Message::Status(StatusRow::from(&status)),
        Message::Event(EventRow {
            step: 3,
            kind: "frozen".to_owned(),
            particle: Some(1),
            client_id: None,
            text: "particle 1 was not finite".to_owned(),
        }),
    ];
    for step in 3..40 {
        messages.push(Message::Step(step_row(step)));
        messages.push(Message::Particles { step, particles: particles(step) });
    }
    messages
}

fn write(options: LogOptions) -> Vec<u8> {
    let mut log = LogWriter::create(Vec::new(), options, &run(), SCENE, 10).unwrap();
    for (count, message) in messages().iter().enumerate() {
        log.write(message, 100 + count as u64).unwrap();
        if count % 20 == 10 {
            log.flush().unwrap();
        }
    }
    let mut closing = Closing { stop_reason: "SIGINT".to_owned(), ..Closing::default() };
    closing.counts[Topic::Particles].received = 38;
    log.finish(&closing).unwrap()
}

fn read_all<R: Read>(log: &mut LogReader<R>) -> Result<Vec<LoggedMessage>, ReadError> {
    std::iter::from_fn(|| log.next_message().transpose()).collect()
}

/// Returns particles as bytes, because NaN differs from itself.
fn bits(message: &Message) -> Vec<u8> {
    match message {
        Message::Particles { particles, .. } => bytemuck::cast_slice(particles).to_vec(),
        other => format!("{other:?}").into_bytes(),
    }
}

#[test]
fn a_recording_reads_back_as_it_was_written() {
    for compression in
        [recording::Compression::None, recording::Compression::Lz4, recording::Compression::Zstd]
    {
        let file =
            write(LogOptions { compression, chunk_size_bytes: 500, ..LogOptions::default() });
        let mut log = LogReader::new(file.as_slice()).unwrap();
        assert_eq!(*log.run(), run());
        assert_eq!(log.scene(), SCENE);
        let read = read_all(&mut log).unwrap();
        let written = messages();
        assert_eq!(read.len(), written.len());
        for (count, (logged, message)) in read.iter().zip(&written).enumerate() {
            assert_eq!(bits(&logged.message), bits(message), "message {count}");
            assert_eq!(u64::from(logged.sequence), message.step());
            assert_eq!(logged.log_time_ns, 100 + count as u64);
            assert_eq!(logged.publish_time_ns, run().time_of_step_ns(message.step()));
        }
        assert_eq!(log.end(), Some(&LogEnd::Complete));
        let closing = log.closing().unwrap();
        assert_eq!(closing.stop_reason, "SIGINT");
        assert_eq!(closing.counts[Topic::Particles].received, 38);
    }
}

#[test]
fn outcomes_survive_a_round_trip_through_their_rows() {
    for row in outcomes() {
        assert_eq!(OutcomeRow::from(&Outcome::from(&row)), row);
    }
}

#[test]
fn rows_have_the_documented_form() {
    let [rejected, applied] = outcomes();
    assert_eq!(
        serde_json::to_string(&rejected).unwrap(),
        r#"{"step":3,"client_id":7,"sequence":8,"index":0,"kind":"grab","particle":1,"target":["-inf",0.1,-0.0],"over_s":0.25,"status":"rejected","reason":"non_finite"}"#
    );
    assert_eq!(
        serde_json::to_string(&applied).unwrap(),
        r#"{"step":3,"client_id":9,"sequence":4503599627370496,"index":1,"kind":"step","count":3,"status":"applied","reason":""}"#
    );
    assert_eq!(
        serde_json::to_string(&step_row(12)).unwrap(),
        r#"{"step":12,"scene_step":12,"state_hash":"00ab00000000000c","topology_revision":0,"torn_count":0,"outcome_count":2,"wake_late_ns":18446744073709551615,"solve_ns":5,"snapshot_index":7}"#
    );
    let Message::Topology(topology) = &messages()[0] else { panic!("not the topology") };
    assert_eq!(
        serde_json::to_string(topology).unwrap(),
        r#"{"step":0,"revision":0,"a":[0],"b":[1],"rest_length":[0.1],"compliance":[1e-7],"kind":[2],"torn":[],"bends":{"particles":[0,1,0,1],"coefficients":[0.5,-1.5,1.0,0.0],"geometry":[0.001],"rigidity":[0.02],"rest":[0.0],"shape":[2],"block":[-1]}}"#
    );
}

#[test]
fn the_other_rows_have_the_documented_form() {
    let expected = [
        r#"{"step":2,"colliders":[{"shape":"plane","normal":[0.0,1.0,0.0],"offset":0.0,"restitution":0.0,"friction":0.5,"velocity":[0.0,0.0,0.0]}]}"#,
        r#"{"step":2,"constraints":[0],"causes":["cut"]}"#,
        r#"{"step":3,"kind":"frozen","particle":1,"text":"particle 1 was not finite"}"#,
    ];
    let rows = messages().into_iter().filter_map(|message| match message {
        Message::Colliders(row) => Some(serde_json::to_string(&row).unwrap()),
        Message::Tears(row) => Some(serde_json::to_string(&row).unwrap()),
        Message::Event(row) => Some(serde_json::to_string(&row).unwrap()),
        _ => None,
    });
    assert_eq!(rows.collect::<Vec<_>>(), expected);
}

#[test]
fn recordings_of_other_formats_are_refused() {
    for version in ["6", "8"] {
        let mut file = write(LogOptions::default());
        let needle = b"format_version\x01\0\0\x007";
        let place = file.windows(needle.len()).position(|window| window == needle).unwrap();
        file[place + needle.len() - 1] = version.as_bytes()[0];
        let error = LogReader::new(Cursor::new(file)).map(|_| ()).unwrap_err().to_string();
        let expected = format!("has format version {version}; this recorder reads version 7.");
        assert!(error.starts_with(&expected), "{error}");
    }
}

#[test]
fn log_times_never_decrease() {
    let mut log = LogWriter::create(Vec::new(), LogOptions::default(), &run(), SCENE, 50).unwrap();
    for (step, log_time_ns) in [(0, 60), (1, 40), (2, 70)] {
        log.write(&Message::Step(step_row(step)), log_time_ns).unwrap();
    }
    let file = log.finish(&Closing::default()).unwrap();
    let read = read_all(&mut LogReader::new(file.as_slice()).unwrap()).unwrap();
    assert_eq!(read.iter().map(|logged| logged.log_time_ns).collect::<Vec<_>>(), [60, 60, 70]);
}

#[test]
fn snapshots_received_at_once_have_log_times_of_their_own() {
    let mut log = LogWriter::create(Vec::new(), LogOptions::default(), &run(), SCENE, 50).unwrap();
    for (step, log_time_ns) in [(0, 60), (1, 60), (2, 60), (3, 61), (4, 70)] {
        log.write(&Message::Step(step_row(step)), log_time_ns).unwrap();
        log.write(&Message::Particles { step, particles: particles(step) }, log_time_ns).unwrap();
    }
    let file = log.finish(&Closing::default()).unwrap();
    let read = read_all(&mut LogReader::new(file.as_slice()).unwrap()).unwrap();
    let all: Vec<_> = read.iter().map(|logged| logged.log_time_ns).collect();
    assert!(all.is_sorted(), "{all:?}");
    let is_snapshot = |one: &&LoggedMessage| one.message.topic() == Topic::Particles;
    let snapshots = read.iter().filter(is_snapshot).map(|logged| logged.log_time_ns);
    assert_eq!(snapshots.collect::<Vec<_>>(), [60, 61, 62, 63, 70]);
}

#[test]
fn frames_contain_the_messages_before_their_snapshot() {
    let file = write(LogOptions::default());
    let mut frames = FrameReader::new(LogReader::new(file.as_slice()).unwrap());
    let first = frames.next_frame().unwrap().unwrap();
    assert_eq!((first.row.step, first.updates.len()), (2, 6));
    let second = frames.next_frame().unwrap().unwrap();
    assert_eq!((second.row.step, second.updates.len()), (3, 4));
    let mut step = 3;
    while let Some(frame) = frames.next_frame().unwrap() {
        step += 1;
        assert_eq!(frame.row, step_row(step));
    }
    assert_eq!((step, frames.end()), (39, Some(&LogEnd::Complete)));
}

#[test]
fn a_snapshot_without_its_row_is_an_error() {
    let mut log = LogWriter::create(Vec::new(), LogOptions::default(), &run(), SCENE, 0).unwrap();
    log.write(&Message::Step(step_row(4)), 0).unwrap();
    log.write(&Message::Particles { step: 5, particles: particles(5) }, 0).unwrap();
    let file = log.finish(&Closing::default()).unwrap();
    let mut frames = FrameReader::new(LogReader::new(file.as_slice()).unwrap());
    assert!(matches!(frames.next_frame(), Err(ReadError::NoRow { step: 5 })));
}

#[test]
fn a_truncated_file_is_read_up_to_the_cut() {
    let file = write(LogOptions { chunk_size_bytes: 500, ..LogOptions::default() });
    let whole = read_all(&mut LogReader::new(file.as_slice()).unwrap()).unwrap();
    let mut readable_counts = Vec::new();
    for length in (0..file.len()).step_by(7) {
        let cut = &file[..length];
        match LogReader::new(cut) {
            Ok(mut log) => {
                let read = read_all(&mut log).unwrap();
                for (logged, expected) in read.iter().zip(&whole) {
                    assert_eq!(bits(&logged.message), bits(&expected.message));
                }
                let Some(LogEnd::Truncated { byte }) = log.end() else {
                    panic!("cut at {length}: {:?}", log.end());
                };
                assert!(*byte <= length as u64, "{byte} of {length}");
                readable_counts.push(read.len());
            }
            Err(ReadError::Empty) => assert_eq!(length, 0),
            Err(ReadError::NotMcap) => assert!((1..100).contains(&length), "{length}"),
            Err(ReadError::NoHeader(LogEnd::Truncated { .. })) => {
                assert!(length < 1000, "{length}");
            }
            Err(other) => panic!("cut at {length}: {other}"),
        }
    }
    assert!(readable_counts.is_sorted());
    assert_eq!(readable_counts.last(), Some(&whole.len()), "only the index was cut");
    assert!(readable_counts.iter().any(|count| (1..whole.len() - 10).contains(count)));
}

#[test]
fn bytes_behind_the_end_are_reported_after_all_messages() {
    let file = write(LogOptions::default());
    let count = read_all(&mut LogReader::new(file.as_slice()).unwrap()).unwrap().len();
    for appended in [&b"x"[..], &file] {
        let longer = [&file, appended].concat();
        let mut log = LogReader::new(longer.as_slice()).unwrap();
        assert_eq!(read_all(&mut log).unwrap().len(), count);
        let Some(LogEnd::Damaged { byte, cause }) = log.end() else { panic!("{:?}", log.end()) };
        assert_eq!(*byte, file.len() as u64);
        assert!(cause.starts_with("other bytes follow the end"), "{cause}");
    }
}

#[test]
fn flushed_messages_outlive_a_killed_recorder() {
    let shared = SharedOut::default();
    let mut log =
        LogWriter::create(shared.clone(), LogOptions::default(), &run(), SCENE, 0).unwrap();
    for step in 0..10 {
        log.write(&Message::Step(step_row(step)), 0).unwrap();
        if step == 6 {
            log.flush().unwrap();
        }
    }
    let killed = shared.bytes();
    let mut reader = LogReader::new(killed.as_slice()).unwrap();
    assert_eq!(read_all(&mut reader).unwrap().len(), 7);
    assert!(matches!(reader.end(), Some(LogEnd::Truncated { .. })));
    drop(log);
    assert_eq!(shared.bytes(), killed, "a dropped writer must not finish the file");
}

#[test]
fn one_flipped_bit_anywhere_is_detected() {
    let file = write(LogOptions { chunk_size_bytes: 500, ..LogOptions::default() });
    let whole: Vec<_> = messages().iter().map(bits).collect();
    for place in (0..file.len()).step_by(13) {
        let mut damaged = file.clone();
        damaged[place] ^= 1 << (place % 8);
        let Ok(mut log) = LogReader::new(damaged.as_slice()) else { continue };
        let Ok(read) = read_all(&mut log) else { continue };
        assert_ne!(log.end(), Some(&LogEnd::Complete), "bit of byte {place}");
        // A damaged opcode hides a whole chunk. The remaining messages are unchanged.
        let mut written = whole.iter();
        for logged in &read {
            let message = bits(&logged.message);
            assert!(written.any(|one| *one == message), "bit of byte {place} gave another message");
        }
    }
}

#[test]
fn a_flipped_bit_in_a_chunk_is_a_checksum_error() {
    let options = LogOptions { compression: recording::Compression::None, ..LogOptions::default() };
    let mut file = write(options);
    let needle = b"particle 1 was not finite";
    let place = file.windows(needle.len()).position(|window| window == needle).unwrap();
    file[place] ^= 4;
    let mut log = LogReader::new(file.as_slice()).unwrap();
    read_all(&mut log).unwrap();
    let end = log.end().unwrap().to_string();
    assert!(end.contains("Chunk CRC failed"), "{end}");
}

#[test]
fn files_that_are_not_recordings_are_named() {
    for not_mcap in [&b"x"[..], b"particles = 3\nand so on and so on and so on"] {
        let error = LogReader::new(not_mcap).unwrap_err();
        assert_eq!(error.to_string(), "is not an MCAP file");
    }
    let mut other =
        mcap::WriteOptions::new().library("cat").create(Cursor::new(Vec::new())).unwrap();
    let channel = other.add_channel(0, "/cat", "json", &std::collections::BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    other.write_to_known_channel(&header, b"{}").unwrap();
    other.finish().unwrap();
    let error = LogReader::new(other.into_inner().into_inner().as_slice()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "is an MCAP file of 'cat', not a recording of a simulation (no metadata 'run' before its first message)"
    );
}

#[test]
fn nothing_is_written_after_the_first_error() {
    let shared = SharedOut::default();
    let full = shared.clone().limited_to(10_000);
    let options = LogOptions { chunk_size_bytes: 100, ..LogOptions::default() };
    let mut log = LogWriter::create(full, options, &run(), SCENE, 0).unwrap();
    let error = (0..10_000)
        .find_map(|step| log.write(&Message::Step(step_row(step)), 0).err())
        .expect("the disk is full");
    assert!(error.to_string().starts_with("cannot write: "), "{error}");
    let length = shared.bytes().len();
    assert!(matches!(log.write(&Message::Step(step_row(1)), 0), Err(WriteError::Stopped)));
    assert!(matches!(log.flush(), Err(WriteError::Stopped)));
    assert!(matches!(log.finish(&Closing::default()), Err(WriteError::Stopped)));
    assert_eq!(shared.bytes().len(), length);
}

/// A sink that outlives its writer and may have a size limit.
#[derive(Clone, Default)]
struct SharedOut {
    bytes: std::sync::Arc<std::sync::Mutex<Vec<u8>>>,
    limit: Option<usize>,
}

impl SharedOut {
    fn bytes(&self) -> Vec<u8> {
        self.bytes.lock().unwrap().clone()
    }

    fn limited_to(self, limit: usize) -> Self {
        Self { limit: Some(limit), ..self }
    }
}

impl std::io::Write for SharedOut {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let mut all = self.bytes.lock().unwrap();
        if self.limit.is_some_and(|limit| all.len() + bytes.len() > limit) {
            return Err(std::io::ErrorKind::StorageFull.into());
        }
        all.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
