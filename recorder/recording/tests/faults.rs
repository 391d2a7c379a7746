//! Recordings on a disk that fails: errors, short writes and a full disk, at random places. A recording
//! is never complete unless everything is in it, and it is readable up to the failure.

use std::cell::RefCell;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::rc::Rc;

use recording::{
    Closing, Compression, LogEnd, LogOptions, LogReader, LogWriter, Message, RunDescription,
    StepRow, Up, WriteError,
};
use sim_messages::ParticleState;

const EIO: i32 = 5;
const EFBIG: i32 = 27;
const ENOSPC: i32 = 28;

const SEEDS: u64 = 400;
const STEPS: u64 = 60;
/// Larger than a whole recording, so that only the calls of `flush` reach the file.
const LARGE_BUFFER: usize = 1 << 20;

/// A deterministic pseudo-random generator (Marsaglia's xorshift64).
#[derive(Debug, Clone)]
struct Random(u64);

impl Random {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        usize::try_from(self.0 % limit as u64).unwrap()
    }
}

/// A failure of the disk.
#[derive(Debug, Clone, Copy)]
struct Fault {
    /// Number of bytes that still fit.
    after_bytes: usize,
    os_error: i32,
    /// The next write succeeds, as after a disk was freed or a cable was plugged in again.
    is_transient: bool,
}

/// A file that writes a random part of what it is given, is interrupted, and fails at its fault.
#[derive(Debug)]
struct FaultyFile {
    bytes: Rc<RefCell<Vec<u8>>>,
    random: Random,
    fault: Option<Fault>,
}

impl Write for FaultyFile {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        if self.random.below(8) == 0 {
            return Err(ErrorKind::Interrupted.into());
        }
        let mut bytes = self.bytes.borrow_mut();
        let mut count = 1 + self.random.below(data.len());
        if let Some(fault) = self.fault {
            count = count.min(fault.after_bytes - bytes.len().min(fault.after_bytes));
            if count == 0 {
                self.fault = self.fault.filter(|fault| !fault.is_transient);
                return Err(io::Error::from_raw_os_error(fault.os_error));
            }
        }
        bytes.extend_from_slice(&data[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The course of a recording on a faulty file.
struct Course {
    bytes: Vec<u8>,
    /// Number of messages before the last successful flush.
    flushed_count: usize,
    result: Result<(), WriteError>,
}

fn messages() -> Vec<Message> {
    let snapshot = |step: u64| {
        let position = [step as f32, 0.5, -0.0];
        let particles = vec![ParticleState { position, ..ParticleState::default() }; 3];
        let row = StepRow { step, scene_step: step, ..StepRow::default() };
        [Message::Step(row), Message::Particles { step, particles }]
    };
    (0..STEPS).flat_map(snapshot).collect()
}

fn run() -> RunDescription {
    RunDescription {
        run_id: 7,
        epoch_ns: 0,
        scene_name: "three points".to_owned(),
        origin: [0.0; 3],
        up: Up::Y,
        rate_hz: 240,
        method: 0,
        particle_count: 3,
        constraint_count: 0,
        bend_count: 0,
        solver_version: 1,
        contract_version: 1,
        recorder_version: "0".to_owned(),
    }
}

/// Records with flushes at random, and goes on after an error, as a careless caller would.
fn record(seed: u64, fault: Option<Fault>) -> Course {
    let mut random = Random::new(seed);
    let bytes = Rc::default();
    let file = FaultyFile { bytes: Rc::clone(&bytes), random: random.clone(), fault };
    let capacity = [0, 300, LARGE_BUFFER][random.below(3)];
    let compression = [Compression::None, Compression::Lz4, Compression::Zstd][random.below(3)];
    let chunk_size_bytes = 1 + random.below(2000) as u64;
    let options = LogOptions { compression, chunk_size_bytes, ..LogOptions::default() };
    let out = BufWriter::with_capacity(capacity, file);
    let mut flushed_count = 0;
    let log = LogWriter::create(out, options, &run(), b"version = 1", 0);
    let result = log.and_then(|mut log| {
        for (index, message) in messages().iter().enumerate() {
            let written = match message {
                // As a recorder writes them: a chunk without compression has the buffer itself.
                Message::Particles { step, particles } => {
                    log.write_particles(*step, particles.as_slice().into(), 0)
                }
                _ => log.write(message, 0),
            };
            if random.below(10) == 0 && log.flush().is_ok() {
                assert!(written.is_ok(), "a flush succeeds after an error");
                flushed_count = index + 1;
            }
        }
        log.finish(&Closing::default()).map(drop)
    });
    Course { bytes: bytes.take(), flushed_count, result }
}

/// Reads the messages of a file, and its end. `None` if it has no readable header.
fn read(bytes: &[u8]) -> Option<(Vec<Message>, LogEnd, Option<Closing>)> {
    let mut log = LogReader::new(bytes).ok()?;
    let mut messages = Vec::new();
    while let Some(logged) = log.next_message().unwrap() {
        messages.push(logged.message);
    }
    Some((messages, log.end().unwrap().clone(), log.closing().cloned()))
}

/// Asserts the invariants of a recording, whatever happened to it.
fn check(seed: u64, course: &Course) {
    let written = messages();
    let Some((read, end, closing)) = read(&course.bytes) else {
        assert!(course.result.is_err() && course.flushed_count == 0, "seed {seed}: no header");
        return;
    };
    assert!(written.starts_with(&read), "seed {seed}: it contains something else");
    assert!(read.len() >= course.flushed_count, "seed {seed}: flushed messages are missing");
    let is_complete = end == LogEnd::Complete;
    // A disk that recovers before the file is dropped may complete it in spite of the error.
    assert!(is_complete || course.result.is_err(), "seed {seed}: {end} without an error");
    // The closing metadata precedes the index, which may be missing.
    let is_whole = read.len() == written.len();
    assert!(is_whole || !is_complete && closing.is_none(), "seed {seed}: complete with gaps");
}

#[test]
fn short_and_interrupted_writes_lose_nothing() {
    for seed in 0..SEEDS {
        let course = record(seed, None);
        assert!(course.result.is_ok(), "seed {seed}: {:?}", course.result);
        check(seed, &course);
    }
}

#[test]
fn a_recording_on_a_failing_disk_is_never_complete_and_readable_up_to_the_failure() {
    for seed in 0..SEEDS {
        let mut random = Random::new(!seed);
        let size_bytes = record(seed, None).bytes.len();
        let fault = Fault {
            after_bytes: random.below(size_bytes),
            os_error: [EIO, EFBIG, ENOSPC][random.below(3)],
            is_transient: random.below(2) == 0,
        };
        let course = record(seed, Some(fault));
        assert!(course.result.is_err(), "seed {seed}");
        check(seed, &course);
    }
}

#[test]
fn the_error_of_a_full_disk_and_of_a_limit_name_the_remedy() {
    for (os_error, remedy) in [(ENOSPC, "free space"), (EFBIG, "ulimit -f")] {
        let fault = Fault { after_bytes: 0, os_error, is_transient: false };
        let error = record(1, Some(fault)).result.unwrap_err();
        // A large buffer reaches the disk at the end; the error is the same.
        assert!(error.to_string().contains(remedy), "{error}");
    }
}
