//! The readers of recordings, on the bytes of a file.

use std::fs::File;
use std::io::Write;
use std::os::fd::{AsRawFd, OwnedFd};

use recording::{
    Closing, Compression, FrameReader, LogEnd, LogOptions, LogReader, LogWriter, Message,
    RunDescription, Tape,
};
use rustix::fs::{MemfdFlags, memfd_create};

/// Most steps of a recording to show.
const STEPS_MAX: usize = 32;

/// Reads a file in all three ways, and checks that they agree.
pub fn check(file: &[u8]) {
    let Ok(mut log) = LogReader::new(file) else {
        // The tape reads the same header.
        assert!(Tape::open(&memory_file(file).1, None, &mut |_, _| {}).is_err());
        return;
    };
    let mut messages = Vec::new();
    let mut is_valid = true;
    loop {
        match log.next_message() {
            Ok(Some(logged)) => messages.push(logged.message),
            Ok(None) => break,
            Err(_) => {
                is_valid = false;
                break;
            }
        }
    }
    check_frames(file, &messages);
    if is_valid {
        check_copy(log.run(), log.scene(), &messages);
    }
    check_tape(file);
}

/// The snapshots of the frames are those of the messages, as far as both go.
fn check_frames(file: &[u8], messages: &[Message]) {
    let Ok(mut log) = LogReader::new(file) else { unreachable!("the header was readable") };
    let mut frames = FrameReader::new(log);
    let mut snapshots =
        messages.iter().filter(|message| matches!(message, Message::Particles { .. }));
    while let Ok(Some(frame)) = frames.next_frame() {
        let step = frame.row.step;
        // A recording of commands has none.
        let Some(particles) = frame.particles else { continue };
        let particles = Message::Particles { step, particles };
        crate::assert_same(&Some(&particles), &snapshots.next());
    }
}

/// The messages, written to another recording, read back the same.
fn check_copy(run: &RunDescription, scene: &[u8], messages: &[Message]) {
    let options = LogOptions { compression: Compression::None, ..LogOptions::default() };
    let mut copy = LogWriter::create(Vec::new(), options, run, scene, 0).expect("a valid header");
    for message in messages {
        copy.write(message, 0).expect("a valid message");
    }
    let copy = copy.finish(&Closing::default()).expect("a valid end");
    let mut log = LogReader::new(copy.as_slice()).expect("the header of a written file");
    for message in messages {
        let read = log.next_message().expect("a written message");
        crate::assert_same(&read.map(|logged| logged.message).as_ref(), &Some(message));
    }
    assert_eq!(log.next_message().expect("the end of a written file"), None);
    assert_eq!(log.end(), Some(&LogEnd::Complete));
}

/// Winds a tape from step to step.
fn check_tape(file: &[u8]) {
    let (_memory, path) = memory_file(file);
    let Ok(mut tape) = Tape::open(&path, None, &mut |_, _| {}) else { return };
    let (first, last) = (tape.first_step(), tape.last_step());
    assert!(first <= last && tape.stride() > 0);
    let mut step = first;
    for _ in 0..STEPS_MAX {
        assert_eq!(tape.step_at(step).expect("memory has no read errors"), step);
        if let Ok(state) = tape.state_at(step) {
            assert_eq!(state.row.step, step);
            assert_eq!(state.particles.len(), tape.run().particle_count as usize);
        }
        let next = tape.step_after(step).expect("memory has no read errors");
        if next == step {
            break;
        }
        assert!(next > step);
        step = next;
    }
    for step in [0, last / 2, last, u64::MAX] {
        let step = tape.step_at(step).expect("memory has no read errors");
        assert!((first..=last).contains(&step));
        _ = tape.state_at(step);
    }
    _ = tape.drain_faults();
}

/// Returns a file in memory that is open as long as the descriptor, and its path.
fn memory_file(bytes: &[u8]) -> (OwnedFd, std::path::PathBuf) {
    let memory = memfd_create("recording", MemfdFlags::CLOEXEC).expect("a file in memory");
    let mut file = File::from(memory);
    file.write_all(bytes).expect("memory takes every byte");
    let path = format!("/proc/self/fd/{}", file.as_raw_fd());
    (OwnedFd::from(file), path.into())
}
