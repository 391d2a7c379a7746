//! Shared memory that another process has cut: a missing page ends a program with a message, not with a
//! signal.

use std::fs::{self, OpenOptions};
use std::path::PathBuf;

use integration_tests::{Process, Program, Sandbox, record};

#[test]
fn no_program_ends_with_a_signal_when_its_memory_is_cut() {
    let sandbox = Sandbox::new();
    let node =
        Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--threads", "3"]);
    let recorder = record(&sandbox, &sandbox.path("cut.mcap"));
    let bridge =
        Process::start_ready(Program::ViewerBridge, &sandbox, &["--listen", "127.0.0.1:0"]);
    for segment in segments(&sandbox) {
        OpenOptions::new().write(true).open(segment).unwrap().set_len(0).unwrap();
    }
    for process in [node, recorder] {
        let finished = process.wait();
        assert_eq!(finished.code, Some(1), "{finished:?}");
        assert!(finished.stderr.contains("error: a page of shared memory"), "{finished:?}");
    }
    // A bridge without pages reads nothing, and may wait for the next node. That one starts.
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    assert_eq!(node.interrupt().code, Some(0));
    let bridged = bridge.interrupt();
    assert!(matches!(bridged.code, Some(0 | 1)), "{bridged:?}");
}

/// Returns the files in `/dev/shm` that hold the lists of services and the messages.
fn segments(sandbox: &Sandbox) -> Vec<PathBuf> {
    let prefix = format!("{}_", sandbox.domain());
    let is_segment = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        name.starts_with(&prefix)
            && [".data", ".dynamic"].iter().any(|suffix| name.ends_with(suffix))
    };
    let files = fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
    let segments: Vec<_> = files.filter(is_segment).collect();
    assert!(segments.len() > 10, "{segments:?}");
    segments
}
