//! The number of threads does not affect a simulation: recordings are equal byte for byte, and a
//! recording made with one thread verifies with two.

use std::path::Path;

use integration_tests::{Finished, Process, Program, Sandbox};
use recording::{LogReader, Message};

/// A sheet that is big enough for several threads, falls onto a ball, and tears there.
const SCENE: &str = r#"
version = 1

[solver]
rate_hz = 120
substeps = 2
tethers = true
tear_stretch = 1.05
tear_force = 40

[[collider]]
shape = "sphere"
center = [2.5, -0.2, 2.5]
radius = 0.2

[[generate]]
shape = "cloth"
columns = 100
rows = 100
spacing = 0.05
down = [0, 0, 1]
pinned = "corners"
"#;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Counts the torn constraints of a recording.
fn torn_count(file: &str) -> usize {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let rows = std::iter::from_fn(|| log.next_message().unwrap());
    let torn = rows.filter_map(|logged| match logged.message {
        Message::Tears(row) => Some(row.constraints.len()),
        _ => None,
    });
    torn.sum()
}

#[test]
fn simulate_writes_the_same_file_with_any_number_of_threads() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("sheet.toml", SCENE);
    let files = ["1", "2", "3"].map(|threads| {
        let file = sandbox.path(&format!("{threads}.mcap"));
        let args = ["simulate", &scene, "--steps", "60", "--threads", threads, "-o", &file];
        recorder(&sandbox, &args).success();
        file
    });
    assert!(torn_count(&files[0]) > 0, "the sheet must tear");
    let [one, two, three] = files.each_ref().map(|file| std::fs::read(file).unwrap());
    // Not `assert_eq`, which would print megabytes.
    assert!(one == two, "two threads wrote a different file");
    assert!(one == three, "three threads wrote a different file");
    let verified = recorder(&sandbox, &["verify", &files[0], "--threads", "2"]).success();
    assert!(verified.starts_with("60 steps bit-identical"), "{verified}");
}

#[test]
fn an_invalid_number_of_threads_exits_with_2_and_names_the_range() {
    let sandbox = Sandbox::new();
    for (program, command) in [
        (Program::SimNode, &["run", "curtain"][..]),
        (Program::Recorder, &["simulate", "curtain", "--steps", "1"]),
        (Program::Recorder, &["verify", "run.mcap"]),
    ] {
        for threads in ["0", "65", "-1", "x"] {
            let finished =
                Process::run(program, &sandbox, &[command, &["--threads", threads]].concat());
            assert_eq!(finished.code, Some(2), "{program:?} {threads}: {}", finished.stderr);
            for words in ["--threads", "from 1 to 64"] {
                assert!(finished.stderr.contains(words), "no \"{words}\" in: {}", finished.stderr);
            }
        }
    }
}
