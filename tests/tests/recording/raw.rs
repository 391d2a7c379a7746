//! The bytes of recordings, for files that no recorder writes.

use integration_tests::{Process, Program, Sandbox};

/// The first bytes of a file.
pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Opcode of a chunk.
pub(crate) const CHUNK: u8 = 6;

/// Returns a record of a file.
pub(crate) fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    [&[opcode], &(body.len() as u64).to_le_bytes()[..], body].concat()
}

/// Returns a small recording, and the part of it up to its first chunk.
pub(crate) fn small(sandbox: &Sandbox) -> (Vec<u8>, Vec<u8>) {
    let file = sandbox.path("small.mcap");
    let args = ["simulate", "pendulum", "--steps", "240", "-o", &file];
    Process::run(Program::Recorder, sandbox, &args).success();
    let bytes = std::fs::read(&file).unwrap();
    let head = bytes[..position_of(&bytes, CHUNK)].to_vec();
    (bytes, head)
}

/// Returns the position of the first record with an opcode.
pub(crate) fn position_of(file: &[u8], opcode: u8) -> usize {
    let mut at = MAGIC.len();
    while file[at] != opcode {
        let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap());
        at += 9 + usize::try_from(length).unwrap();
    }
    at
}
