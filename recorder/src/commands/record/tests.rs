//! A disk that stalls: what is recorded and what is declared as lost add up to what was received.

use std::io::Write;
use std::sync::{Condvar, Mutex};
use std::thread;

use recording::{
    AllCounts, Closing, Compression, FrameReader, GapCounter, LogEnd, LogOptions, LogReader,
    LogWriter, Message, OutcomeRow, RunDescription, StepRow, Topic,
};
use sim_contract::{Action, Command, Outcome, ParticleState};

use super::queue::{Content, Entry, FileEnd, Item};
use super::start::RunHeader;
use super::writer::write_item;
use super::*;

const SEEDS: u64 = 20;
const MESSAGES: u64 = 400;
/// Room for a few of the snapshots below.
const QUEUE_BYTES: usize = 100_000;
const SCENE: &[u8] = b"version = 1";

/// A deterministic pseudo-random generator (Marsaglia's xorshift64).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % limit
    }
}

/// The disk: while it stalls, every write waits.
#[derive(Debug, Default)]
struct Disk {
    is_stalled: Mutex<bool>,
    changed: Condvar,
}

impl Disk {
    fn set_stalled(&self, is_stalled: bool) {
        *self.is_stalled.lock().unwrap() = is_stalled;
        self.changed.notify_all();
    }
}

#[derive(Debug)]
struct StallingFile {
    disk: Arc<Disk>,
    bytes: Vec<u8>,
}

impl Write for StallingFile {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        let stalled = self.disk.is_stalled.lock().unwrap();
        drop(self.disk.changed.wait_while(stalled, |is_stalled| *is_stalled).unwrap());
        self.bytes.write(data)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn description() -> RunDescription {
    RunDescription {
        run_id: 7,
        scene_name: "points".to_owned(),
        rate_hz: 240,
        particle_count: 1000,
        ..RunDescription::default()
    }
}

fn snapshot(index: u32) -> Content {
    let row = StepRow { step: index.into(), snapshot_index: index, ..StepRow::default() };
    Content::Snapshot(row, vec![ParticleState::default(); 1000].as_slice().into())
}

fn keyframe(index: u32) -> Content {
    Content::Update(Message::Keyframe { step: index.into(), bytes: vec![0; 20_000] })
}

fn begun_queue(limit_bytes: usize) -> Queue {
    let queue = Queue::new(limit_bytes);
    queue.begin(
        RunHeader {
            run: description(),
            scene: SCENE.to_vec(),
            colliders: Arc::default(),
            rows: Vec::new(),
        },
        0,
    );
    queue
}

/// Writes one file of the queue. Returns it unfinished, and its end.
fn write<W: Write>(queue: &Queue, mut log: LogWriter<W>) -> (LogWriter<W>, Closing) {
    loop {
        queue.wait(WAIT_MAX).expect("it is closed without an end");
        while let Some(entry) = queue.pop() {
            match entry {
                Entry::Item(item) => write_item(&mut log, item).unwrap(),
                Entry::End(mut closing, _) => {
                    closing.counts.set_written(log.counts());
                    return (log, *closing);
                }
                Entry::Begin { .. } => {}
            }
        }
    }
}

/// Receives snapshots and keyframes while the disk stalls at times. Returns the finished file, and the
/// numbers of received messages.
fn record(seed: u64) -> (Vec<u8>, Closing) {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let (disk, queue) = (Arc::new(Disk::default()), begun_queue(QUEUE_BYTES));
    let file = StallingFile { disk: Arc::clone(&disk), bytes: Vec::new() };
    let options =
        LogOptions { compression: Compression::None, chunk_size_bytes: 1, ..LogOptions::default() };
    let log = LogWriter::create(file, options, &description(), SCENE, 0).unwrap();
    let mut closing = Closing::default();
    let (log, closing) = thread::scope(|scope| {
        let writing = scope.spawn(|| write(&queue, log));
        let mut index = 0;
        for _ in 0..MESSAGES {
            let is_snapshot = random.below(3) > 0;
            let content = if is_snapshot { snapshot(index) } else { keyframe(index) };
            index += u32::from(is_snapshot);
            for topic in [Topic::Steps, Topic::Particles, Topic::Keyframe] {
                let is_received = is_snapshot != (topic == Topic::Keyframe);
                closing.counts[topic].received += u64::from(is_received);
            }
            queue.push(Item { content, log_time_ns: 0 });
            if random.below(30) == 0 {
                disk.set_stalled(random.below(3) > 0);
            }
        }
        disk.set_stalled(false);
        queue.end(closing, FileEnd::Write);
        writing.join().unwrap()
    });
    (log.finish(&closing).unwrap().bytes, closing)
}

#[test]
fn what_is_recorded_and_what_is_declared_lost_add_up_to_what_was_received() {
    let mut lost_in_all = 0;
    for seed in 1..=SEEDS {
        let (bytes, closing) = record(seed);
        let mut log = LogReader::new(bytes.as_slice()).unwrap();
        let (mut recorded, mut gaps) = ([0; Topic::ALL.len()], GapCounter::default());
        while let Some(logged) = log.next_message().unwrap() {
            recorded[logged.message.topic().index()] += 1;
            gaps.add(&logged.message);
        }
        recorded[Topic::Tf.index()] = log.transform_count();
        assert_eq!((log.end(), log.closing()), (Some(&LogEnd::Complete), Some(&closing)));
        for (topic, counts) in closing.counts.iter() {
            let found = recorded[topic.index()];
            assert_eq!(found, counts.written, "seed {seed}: {topic:?}");
            assert_eq!(found + counts.lost, counts.received, "seed {seed}: {topic:?}");
        }
        let (shown, lost) = (gaps.counts()[Topic::Steps].gaps, closing.counts[Topic::Steps].lost);
        assert!(shown <= lost, "seed {seed}: {shown} gaps of {lost} lost snapshots");
        lost_in_all += lost;
        assert_eq!(count_in_frames(&bytes), written_count(&closing.counts));
    }
    assert!(lost_in_all > 0, "no stall was long enough");
}

fn written_count(counts: &AllCounts) -> u64 {
    counts.iter().map(|(_, counts)| counts.written).sum()
}

/// Returns the number of messages that a reader of snapshots finds in a file, with `/tf`.
fn count_in_frames(bytes: &[u8]) -> u64 {
    let mut frames = FrameReader::new(LogReader::new(bytes).unwrap());
    let mut count = 0;
    while let Some(frame) = frames.next_frame().unwrap() {
        count += frame.updates.len() + 2;
    }
    (count + frames.trailing_updates().len()) as u64 + frames.log().transform_count()
}

#[test]
fn messages_of_a_stall_without_a_snapshot_can_be_read_and_outcomes_are_kept() {
    const KEYFRAMES: u64 = 6000;
    let queue = begun_queue(256 << 20);
    let push = |content| queue.push(Item { content, log_time_ns: 0 });
    push(snapshot(0));
    for step in 1..=KEYFRAMES {
        push(Content::Update(Message::Keyframe { step, bytes: vec![0; 1 << 16] }));
        let outcome = Outcome::new(step - 1, step, Command::new(1, step, Action::Reset), Ok(()));
        push(Content::Update(Message::Outcome(OutcomeRow::from(&outcome))));
    }
    push(snapshot(7000));
    queue.end(Closing::default(), FileEnd::Write);
    let options = LogOptions::default();
    let log = LogWriter::create(Vec::new(), options, &description(), SCENE, 0).unwrap();
    let (log, Closing { counts, .. }) = write(&queue, log);
    let bytes = log.finish(&Closing::default()).unwrap();
    let sum = |topic| counts[topic].written + counts[topic].lost;
    assert!(counts[Topic::Keyframe].lost > 0);
    assert_eq!((sum(Topic::Keyframe), counts[Topic::Outcomes].written), (KEYFRAMES, KEYFRAMES));
    assert_eq!(counts[Topic::Steps].lost, 0);
    assert_eq!(count_in_frames(&bytes), written_count(&counts));
}
