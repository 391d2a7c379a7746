//! Files that claim to be huge are refused with an error by every program that reads recordings, in
//! an address space that does not hold what they claim.

use integration_tests::{Finished, Process, Program, Sandbox};
use recording::{Closing, LogOptions, LogReader, LogWriter, Message, RunDescription};

use super::raw::{CHUNK, MAGIC, position_of, record, small};

/// Address space of a program. A quarter of it is for a file; the rest is for the program and the
/// stacks of its threads, which are reserved but not used.
const ADDRESS_SPACE_BYTES: u64 = 1 << 30;
/// More memory than a program may use for a small scene.
const CLAIM_BYTES: usize = 1200 << 20;

const HEADER: u8 = 1;
const SCHEMA: u8 = 3;
const CHUNK_INDEX: u8 = 8;
const ATTACHMENT: u8 = 9;
const METADATA: u8 = 12;

/// A file that claims to be huge.
struct Hostile {
    name: &'static str,
    bytes: Vec<u8>,
    /// A part of the error of every program that reads past the header.
    error: &'static str,
}

/// Returns a chunk without content that claims these sizes.
fn chunk(uncompressed: u64, compression: &[u8], compressed: u64) -> Vec<u8> {
    let length = u32::try_from(compression.len()).unwrap();
    let body = [
        &[0; 16][..],
        &uncompressed.to_le_bytes(),
        &[1; 4],
        &length.to_le_bytes(),
        compression,
        &compressed.to_le_bytes(),
    ]
    .concat();
    let size = body.len() as u64 + compressed;
    [&[CHUNK], &size.to_le_bytes()[..], &body].concat()
}

/// Writes keyframes of 16 KB that no snapshot follows. They compress to almost nothing.
fn keyframes(head: &[u8], chunk_size_bytes: u64) -> Vec<u8> {
    let run = RunDescription { ..LogReader::new(head).unwrap().run().clone() };
    let scene = LogReader::new(head).unwrap().scene().to_vec();
    let options = LogOptions { chunk_size_bytes, ..LogOptions::default() };
    let mut log = LogWriter::create(Vec::new(), options, &run, &scene, 0).unwrap();
    let message = Message::Keyframe { step: 0, bytes: vec![0; 16_000] };
    for _ in 0..CLAIM_BYTES / 16_000 {
        log.write(&message, 0).unwrap();
    }
    log.finish(&Closing::default()).unwrap()
}

/// Adds an index that claims a list of 4 GiB.
fn with_huge_index(file: &[u8]) -> Vec<u8> {
    let entry = record(CHUNK_INDEX, &[&[0; 32][..], &[0xff; 4], &[0; 40]].concat());
    let start = (file.len() as u64).to_le_bytes();
    let footer = record(2, &[&start[..], &[0; 12]].concat());
    [file, &entry, &footer, MAGIC].concat()
}

fn after(head: &[u8], rest: &[u8]) -> Vec<u8> {
    [head, rest, &[0; 64]].concat()
}

fn hostile_files(sandbox: &Sandbox) -> Vec<Hostile> {
    let (whole, head) = small(sandbox);
    let too_many_particles = {
        let mut bytes = whole;
        let key = b"particle_count\x01\0\0\x002";
        let place = bytes.windows(key.len()).position(|window| window == key).unwrap();
        let longer = b"particle_count\x0a\0\0\x004294967295";
        bytes.splice(place..place + key.len(), longer.iter().copied());
        let start = position_of(&bytes, METADATA);
        for at in [start + 1, start + 9 + 4 + 3] {
            bytes[at] = bytes[at].checked_add(9).unwrap();
        }
        bytes
    };
    let long = "a text or list that is longer than its record";
    let mut files = vec![
        ("text.mcap", [MAGIC, &record(HEADER, &[0xff; 32])].concat(), long),
        ("map.mcap", after(&head, &record(METADATA, &[&[0; 4][..], &[0xff; 4]].concat())), long),
        ("attachment.mcap", after(&head, &record(ATTACHMENT, &[0; 3])), long),
        ("name.mcap", after(&head, &record(ATTACHMENT, &[0xff; 40])), long),
        (
            "scene.mcap",
            [MAGIC, &[ATTACHMENT], &(1_u64 << 40).to_le_bytes()[..], &[0; 64]].concat(),
            "1099511627776 bytes",
        ),
        ("chunk.mcap", after(&head, &chunk(5 << 30, b"zstd", 64)), "a chunk of 5368709120 bytes"),
        (
            "plain.mcap",
            after(&head, &chunk((1 << 30) - 1, b"", (1 << 30) - 1)),
            "a chunk of 1073741823 bytes",
        ),
        ("data.mcap", after(&head, &chunk(100, b"lz4", 1 << 40)), "longer than its content"),
        (
            "record.mcap",
            after(&head, &[&[5][..], &(1_u64 << 62).to_le_bytes()].concat()),
            "a message of",
        ),
        ("large-chunk.mcap", keyframes(&head, 1 << 28), "a chunk of 268"),
    ];
    files.push(("particles.mcap", too_many_particles, "no valid 'particle_count'"));
    files.into_iter().map(|(name, bytes, error)| Hostile { name, bytes, error }).collect()
}

/// Runs a program that reads a recording.
fn read(sandbox: &Sandbox, program: Program, args: &[&str]) -> Finished {
    Process::start_limited(("-v", ADDRESS_SPACE_BYTES >> 10), program, sandbox, args).wait()
}

/// Returns the arguments of each program that reads a recording past its header.
fn readers<'a>(file: &'a str, pictures: &'a str) -> Vec<(Program, Vec<&'a str>)> {
    vec![
        (Program::Recorder, vec!["info", file]),
        (Program::Recorder, vec!["verify", file]),
        (Program::Recorder, vec!["play", file]),
        (Program::Recorder, vec!["export", file, "--png", pictures]),
        (Program::Recorder, vec!["simulate", "rope", "--steps", "1", "--commands", file]),
        (Program::ViewerBridge, vec!["--replay", file, "--listen", "127.0.0.1:0"]),
    ]
}

#[test]
fn a_claim_beyond_the_limits_is_an_error_of_every_program() {
    let sandbox = Sandbox::new();
    let pictures = sandbox.path("pictures");
    for Hostile { name, bytes, error } in hostile_files(&sandbox) {
        let file = sandbox.path(name);
        std::fs::write(&file, &bytes).unwrap();
        for (program, args) in readers(&file, &pictures) {
            let finished = read(&sandbox, program, &args);
            // `info` reports the intact part of a damaged file; others may find nothing to use in it.
            let is_damaged = program == Program::Recorder && finished.code == Some(3);
            let text = &finished.stderr;
            assert!(finished.code == Some(1) || is_damaged, "{program:?} {args:?}: {finished:?}");
            assert!(text.contains(name), "{program:?} {args:?}: {text}");
            // The viewer reads only the chunks that it shows.
            if program == Program::Recorder {
                assert!(text.contains(error), "{program:?} {args:?}: {text}");
            }
        }
    }
}

#[test]
fn a_check_and_a_repair_need_little_memory_for_any_claim() {
    let sandbox = Sandbox::new();
    let output = sandbox.path("repaired.mcap");
    for Hostile { name, bytes, .. } in hostile_files(&sandbox) {
        let file = sandbox.path(name);
        std::fs::write(&file, &bytes).unwrap();
        let checked = read(&sandbox, Program::Recorder, &["check", &file]);
        assert!(matches!(checked.code, Some(1 | 3)), "{name}: {checked:?}");
        let args = ["repair", &file, &output, "--overwrite"];
        let repaired = read(&sandbox, Program::Recorder, &args);
        assert!(matches!(repaired.code, Some(0 | 1 | 3)), "{name}: {repaired:?}");
        assert_eq!(repaired.code == Some(1), repaired.stderr.contains("error: "), "{name}");
    }
}

#[test]
fn messages_that_belong_to_no_snapshot_are_refused_before_they_fill_the_memory() {
    let sandbox = Sandbox::new();
    let (_, head) = small(&sandbox);
    let file = sandbox.path("updates.mcap");
    std::fs::write(&file, keyframes(&head, 1 << 20)).unwrap();
    let pictures = sandbox.path("pictures");
    for (program, args) in readers(&file, &pictures) {
        let finished = read(&sandbox, program, &args);
        match args[0] {
            // They keep no message.
            "info" | "simulate" => assert_eq!(finished.code, Some(0), "{finished:?}"),
            "--replay" => assert_eq!(finished.code, Some(1), "{finished:?}"),
            _ => {
                assert_eq!(finished.code, Some(1), "{args:?}: {finished:?}");
                let expected = "updates.mcap: the messages before byte";
                assert!(finished.stderr.contains(expected), "{args:?}: {}", finished.stderr);
            }
        }
    }
}

#[test]
fn an_index_with_a_huge_list_is_replaced_by_a_scan() {
    let sandbox = Sandbox::new();
    let (_, head) = small(&sandbox);
    let file = sandbox.path("index.mcap");
    std::fs::write(&file, with_huge_index(&head)).unwrap();
    let args = ["--replay", &file, "--listen", "127.0.0.1:0"];
    let finished = read(&sandbox, Program::ViewerBridge, &args);
    assert_eq!(finished.code, Some(1), "{finished:?}");
    assert!(finished.stderr.contains("index.mcap: has no readable /topology"), "{finished:?}");
}

/// Size of a schema that is as long as a reader accepts one, nearly.
const SCHEMA_SIZE_BYTES: u32 = 60_000;

/// Returns a chunk of schemas with consecutive ids, compressed to almost nothing.
fn schemas(first_id: u16, count: u16) -> Vec<u8> {
    // A frame of zstd (RFC 8878): a window of 128 KiB, then blocks.
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd, 0, 7 << 3];
    let block = |size: u32, kind: u32, is_last: u32| {
        (size << 3 | kind << 1 | is_last).to_le_bytes()[..3].to_vec()
    };
    let mut uncompressed = 0;
    for id in first_id..first_id + count {
        let text = |text: &[u8]| [&u32::try_from(text.len()).unwrap().to_le_bytes(), text].concat();
        let fields = [&id.to_le_bytes()[..], &text(b"name"), &text(b"json")].concat();
        let size = fields.len() as u64 + 4 + u64::from(SCHEMA_SIZE_BYTES);
        let start = [&[SCHEMA], &size.to_le_bytes()[..], &fields, &SCHEMA_SIZE_BYTES.to_le_bytes()]
            .concat();
        frame.extend(block(u32::try_from(start.len()).unwrap(), 0, 0));
        frame.extend(&start);
        frame.extend(block(SCHEMA_SIZE_BYTES, 1, u32::from(id + 1 == first_id + count)));
        frame.push(b' ');
        uncompressed += size + 9;
    }
    let sizes = [&[0; 16][..], &uncompressed.to_le_bytes(), &[0; 4], &4_u32.to_le_bytes(), b"zstd"];
    let body = [&sizes.concat()[..], &(frame.len() as u64).to_le_bytes(), &frame].concat();
    record(CHUNK, &body)
}

#[test]
fn a_verification_keeps_no_schemas_of_other_programs() {
    let sandbox = Sandbox::new();
    let (_, head) = small(&sandbox);
    let file = sandbox.path("schemas.mcap");
    // Together more than the address space.
    let chunks: Vec<_> = (0..300).map(|chunk| schemas(1000 + chunk * 68, 68)).collect();
    let size_bytes = 300 * 68 * u64::from(SCHEMA_SIZE_BYTES);
    assert!(size_bytes > ADDRESS_SPACE_BYTES);
    std::fs::write(&file, after(&head, &chunks.concat())).unwrap();
    let finished = read(&sandbox, Program::Recorder, &["verify", &file]);
    assert_eq!(finished.code, Some(3), "{finished:?}");
    // The reader has reached the end.
    assert!(finished.stderr.contains("a record with opcode 0"), "{finished:?}");
    let repaired =
        read(&sandbox, Program::Recorder, &["repair", &file, &sandbox.path("repaired.mcap")]);
    assert_eq!(repaired.code, Some(3), "{repaired:?}");
    assert!(repaired.stdout.contains("the schemas and channels have more than"), "{repaired:?}");
}
