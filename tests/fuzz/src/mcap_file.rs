//! Recordings made of the messages in an input, so that the fuzzer need not find the framing of MCAP.
//!
//! An input is a sequence of messages with [`SEPARATOR`] between them. The first byte of a message
//! selects its topic, and bit 7 of it ends a chunk. The second byte is the step. The payload follows.

use recording::{LogOptions, LogWriter, RunDescription, Topic, Up};

/// Bytes between two messages. 0xff occurs neither in JSON nor in most other payloads.
pub const SEPARATOR: &[u8] = b"\xff\xfe\xff";
/// Bit of the first byte of a message that ends the chunk.
pub const END_OF_CHUNK: u8 = 1 << 7;

/// Opcodes of MCAP.
mod op {
    pub(super) const FOOTER: u8 = 0x02;
    pub(super) const MESSAGE: u8 = 0x05;
    pub(super) const CHUNK: u8 = 0x06;
    pub(super) const DATA_END: u8 = 0x0f;
}

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// The size of the scene `planar`, whose recording is a seed.
const PARTICLE_COUNT: u32 = 17;
const CONSTRAINT_COUNT: u32 = 25;

/// Returns a complete file without an index, with the messages of an input.
pub fn with_messages(data: &[u8]) -> Vec<u8> {
    let run = run();
    let mut file = header(&run);
    let mut chunk = Vec::new();
    let mut rest = data;
    while !rest.is_empty() {
        let size = rest.windows(SEPARATOR.len()).position(|window| window == SEPARATOR);
        let message = &rest[..size.unwrap_or(rest.len())];
        rest = size.map_or(&[], |size| &rest[size + SEPARATOR.len()..]);
        let Some(([topic, step], payload)) = message.split_first_chunk() else { continue };
        push_message(
            &mut chunk,
            topic % END_OF_CHUNK,
            run.time_of_step_ns(u64::from(*step)),
            payload,
        );
        if topic & END_OF_CHUNK != 0 {
            push_chunk(&mut file, &std::mem::take(&mut chunk));
        }
    }
    push_chunk(&mut file, &chunk);
    push_record(&mut file, op::DATA_END, &[&[0; 4]]);
    push_record(&mut file, op::FOOTER, &[&[0; 20]]);
    file.extend_from_slice(MAGIC);
    file
}

fn run() -> RunDescription {
    RunDescription {
        run_id: 1,
        epoch_ns: 0,
        scene_name: "planar".to_owned(),
        origin: [0.0; 3],
        up: Up::Y,
        rate_hz: 60,
        method: 1,
        particle_count: PARTICLE_COUNT,
        constraint_count: CONSTRAINT_COUNT,
        bend_count: 0,
        solver_version: 1,
        contract_version: 1,
        recorder_version: "0.1.0".to_owned(),
    }
}

/// Returns the start of a file up to the end of its first chunk, which declares the channels.
fn header(run: &RunDescription) -> Vec<u8> {
    let mut file = Vec::new();
    let log = LogWriter::create(&mut file, LogOptions::default(), run, b"version = 1", 0);
    let flushed = log.and_then(|mut log| log.flush());
    flushed.expect("memory takes every byte");
    file
}

fn push_message(chunk: &mut Vec<u8>, topic: u8, time_ns: u64, payload: &[u8]) {
    // The writer numbers the channels from 1.
    let channel = u16::from(topic) % Topic::ALL.len() as u16 + 1;
    let time = time_ns.to_le_bytes();
    push_record(chunk, op::MESSAGE, &[&channel.to_le_bytes(), &[0; 4], &time, &time, payload]);
}

/// Appends an uncompressed chunk. A checksum of 0 is not checked.
fn push_chunk(file: &mut Vec<u8>, records: &[u8]) {
    let size_bytes = (records.len() as u64).to_le_bytes();
    push_record(file, op::CHUNK, &[&[0; 16], &size_bytes, &[0; 8], &size_bytes, records]);
}

fn push_record(file: &mut Vec<u8>, opcode: u8, parts: &[&[u8]]) {
    let body = parts.concat();
    file.push(opcode);
    file.extend_from_slice(&(body.len() as u64).to_le_bytes());
    file.extend_from_slice(&body);
}
