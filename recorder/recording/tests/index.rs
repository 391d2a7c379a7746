//! Reading chunk by chunk gives the same messages as reading from the start, with an index and
//! without.
//!
//! Small recordings are written to files, then truncated and damaged.

use std::fs;
use std::path::PathBuf;

use recording::{
    Closing, IndexedLog, LogEnd, LogOptions, LogReader, LogWriter, LoggedMessage, Message,
    ReadError, RunDescription, StepRow, TearsRow, Topic, Up,
};
use sim_messages::ParticleState;

const STEPS: u64 = 200;

fn written() -> Vec<u8> {
    let run = RunDescription {
        run_id: 7,
        epoch_ns: 1_700_000_000_000_000_001,
        scene_name: "points".to_owned(),
        origin: [0.0; 3],
        up: Up::Y,
        rate_hz: 240,
        method: 0,
        particle_count: 4,
        constraint_count: 0,
        bend_count: 0,
        solver_version: 1,
        contract_version: 1,
        recorder_version: "0.1.0".to_owned(),
    };
    let options = LogOptions { chunk_size_bytes: 2000, ..LogOptions::default() };
    let mut log = LogWriter::create(Vec::new(), options, &run, b"version = 1", 0).unwrap();
    for step in 0..STEPS {
        if step == 100 {
            let tears = TearsRow { step, constraints: vec![1], causes: vec!["cut".to_owned()] };
            log.write(&Message::Tears(tears), step).unwrap();
        }
        log.write(&Message::Step(StepRow { step, ..StepRow::default() }), step).unwrap();
        let particles = vec![ParticleState { flags: 1, ..ParticleState::default() }; 4];
        log.write(&Message::Particles { step, particles }, step).unwrap();
    }
    log.finish(&Closing::default()).unwrap()
}

/// A file that is removed when its guard is dropped.
struct TestFile(PathBuf);

impl TestFile {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("index-{}-{name}.mcap", std::process::id()));
        fs::write(&path, bytes).unwrap();
        Self(path)
    }

    fn open(&self) -> Result<IndexedLog, ReadError> {
        IndexedLog::open(&self.0)
    }
}

impl Drop for TestFile {
    fn drop(&mut self) {
        let _left = fs::remove_file(&self.0);
    }
}

fn read_all(log: &mut IndexedLog) -> Vec<LoggedMessage> {
    (0..log.chunks().len()).flat_map(|chunk| log.read_chunk(chunk).unwrap()).collect()
}

fn in_order(bytes: &[u8]) -> Vec<LoggedMessage> {
    let mut log = LogReader::new(bytes).unwrap();
    std::iter::from_fn(|| log.next_message().unwrap()).collect()
}

#[test]
fn the_chunks_contain_the_messages_of_the_file_in_order() {
    let bytes = written();
    let file = TestFile::new("whole", &bytes);
    let mut log = file.open().unwrap();
    assert!(log.has_index() && log.chunks().len() > 10, "{} chunks", log.chunks().len());
    assert_eq!((log.end(), log.scene()), (&LogEnd::Complete, &b"version = 1"[..]));
    assert_eq!(read_all(&mut log), in_order(&bytes));
    // Reading from the back works too.
    let last = log.chunks().len() - 1;
    let newest = log.read_chunk(last).unwrap().pop().unwrap();
    assert_eq!(newest.message.step(), STEPS - 1);
}

#[test]
fn topics_of_a_chunk_are_known_without_reading_it() {
    let bytes = written();
    let whole = TestFile::new("topics", &bytes);
    let scanned = TestFile::new("topics-scanned", &bytes[..bytes.len() - 1]);
    for (file, has_index) in [(&whole, true), (&scanned, false)] {
        let mut log = file.open().unwrap();
        assert_eq!(log.has_index(), has_index);
        let has_tears: Vec<_> =
            log.chunks().iter().map(|chunk| chunk.has_any(&[Topic::Tears])).collect();
        assert_eq!(has_tears.iter().filter(|has| **has).count(), 1);
        for (chunk, has_tears) in has_tears.into_iter().enumerate() {
            let messages = log.read_chunk(chunk).unwrap();
            let is_tears = |logged: &LoggedMessage| logged.message.topic() == Topic::Tears;
            assert_eq!(messages.iter().any(is_tears), has_tears, "chunk {chunk}");
            assert_eq!(log.chunks()[chunk].has_any(&Topic::ALL), !messages.is_empty());
        }
    }
}

#[test]
fn a_file_without_an_end_is_scanned_up_to_the_truncation() {
    let bytes = written();
    let whole = in_order(&bytes);
    let mut counts = Vec::new();
    for length in (0..bytes.len()).step_by(97) {
        let file = TestFile::new("cut", &bytes[..length]);
        match file.open() {
            Ok(mut log) => {
                let LogEnd::Truncated { byte } = *log.end() else { panic!("{:?}", log.end()) };
                assert!(byte <= length as u64 && !log.has_index());
                let read = read_all(&mut log);
                assert_eq!(read, whole[..read.len()]);
                counts.push(read.len());
            }
            Err(ReadError::Empty | ReadError::NotMcap | ReadError::NoHeader(_)) => {
                assert!(length < 1000, "{length}");
            }
            Err(other) => panic!("cut at {length}: {other}"),
        }
    }
    assert!(counts.is_sorted() && counts.last() == Some(&whole.len()), "{counts:?}");
}

#[test]
fn a_message_index_that_is_too_short_ends_the_scan() {
    let mut bytes = written();
    let size = |bytes: &[u8], at: usize| {
        9 + usize::try_from(u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap())).unwrap()
    };
    let mut at = 8;
    while bytes[at] != 0x07 {
        at += size(&bytes, at);
    }
    bytes[at + 1] = 1;
    // A file without an end is scanned.
    bytes.truncate(bytes.len() - 20);
    let file = TestFile::new("short", &bytes);
    let whole = in_order(&written());
    let mut log = file.open().unwrap();
    assert!(
        matches!(log.end(), LogEnd::Damaged { byte, .. } if *byte == at as u64),
        "{:?}",
        log.end()
    );
    let read = read_all(&mut log);
    assert!(!read.is_empty() && read == whole[..read.len()]);
}

#[test]
fn a_flipped_bit_damages_only_its_chunk_and_never_changes_a_message() {
    let bytes = written();
    let whole = in_order(&bytes);
    for place in (0..bytes.len()).step_by(41) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        let file = TestFile::new("flipped", &damaged);
        let Ok(mut log) = file.open() else { continue };
        let mut expected = whole.iter();
        let chunks: Vec<_> = (0..log.chunks().len()).map(|chunk| log.read_chunk(chunk)).collect();
        assert!(chunks.iter().filter(|chunk| chunk.is_err()).count() <= 1, "byte {place}");
        for logged in chunks.iter().flatten().flatten() {
            assert!(expected.any(|one| one == logged), "byte {place} gave another message");
        }
    }
}

/// Returns the position of the first record of a kind, from a position on.
fn record_from(bytes: &[u8], mut at: usize, opcode: u8) -> usize {
    while bytes[at] != opcode {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    at
}

#[test]
fn a_chunk_that_begins_at_the_end_of_what_was_read_ahead_is_read() {
    const READ_AHEAD: usize = 1 << 20;
    let bytes = written();
    let whole = in_order(&bytes);
    let (head, chunks) = bytes.split_at(record_from(&bytes, 8, 6));
    for distance in 0..100 {
        // A record of another program, which the reader skips.
        let length = 8 + READ_AHEAD - distance - head.len() - 9;
        let record = [&[0x80], &(length as u64).to_le_bytes()[..], &vec![0; length]].concat();
        assert_eq!(in_order(&[head, &record, chunks].concat()), whole, "{distance} bytes");
    }
}

#[test]
fn an_index_with_a_chunk_that_is_shorter_than_a_record_is_refused() {
    let bytes = written();
    let chunk_index = record_from(&bytes, 8, 8) + 9;
    for length in 0..=9_u64 {
        let mut changed = bytes.clone();
        changed[chunk_index + 24..chunk_index + 32].copy_from_slice(&length.to_le_bytes());
        let file = TestFile::new("short", &changed);
        let read = file.open().and_then(|mut log| log.read_chunk(0));
        assert!(matches!(read, Err(ReadError::DamagedChunk { .. })), "{length}: {read:?}");
    }
}

#[test]
fn records_of_other_programs_are_skipped_behind_the_run() {
    let bytes = written();
    let whole = in_order(&bytes);
    let (head, chunks) = bytes.split_at(record_from(&bytes, 8, 6));
    // An opcode that is not known, and metadata that is longer than any of ours.
    for (opcode, length) in [(0x20, 5), (0x0c, 1 << 17)] {
        let record = [&[opcode], &(length as u64).to_le_bytes()[..], &vec![0; length]].concat();
        assert_eq!(in_order(&[head, &record, chunks].concat()), whole, "opcode {opcode}");
    }
}
