//! Ctrl-C ends every program while it reads a large recording, SIGUSR1 ends no recorder, and a time ends one
//! that holds the steps of that time.

use integration_tests::{Process, Program, Sandbox, Signal, ctl, record, wait_for};
use serde_json::Value;

use super::raw::small;

/// A program that reads a recording, and its answer to Ctrl-C.
struct Reader<'a> {
    args: Vec<&'a str>,
    code: i32,
    /// A part of its output.
    output: &'static str,
}

/// Returns a recording that takes seconds to read.
fn large_recording(sandbox: &Sandbox) -> String {
    let file = sandbox.path("large.mcap");
    let args = ["simulate", "curtain", "--steps", "24000", "--compression", "none", "-o", &file];
    Process::run(Program::Recorder, sandbox, &args).success();
    file
}

#[test]
fn sigusr1_does_not_end_a_recording_without_a_black_box() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope", "--paused"]);
    let file = sandbox.path("run.mcap");
    let mut recording = record(&sandbox, &file);
    recording.signal(Signal::USR1);
    recording.wait_for_line("warning: SIGUSR1 writes the memory of a black box");
    ctl(&sandbox, &["step", "20"]);
    assert_eq!(recording.interrupt().code, Some(0));
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    assert!(verified.contains("20 steps bit-identical"), "{verified}");
}

#[test]
fn a_recording_of_a_stopped_node_says_that_the_node_does_not_answer() {
    let sandbox = Sandbox::new();
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope"]);
    node.signal(Signal::STOP);
    let args = ["record", "-o", &sandbox.path("run.mcap"), "--duration", "300ms"];
    let recorded = Process::run(Program::Recorder, &sandbox, &args);
    node.signal(Signal::CONT);
    assert_eq!(recorded.code, Some(1), "{recorded:?}");
    let expected = format!("process {} runs as 'sim' in domain ", node.id());
    assert!(recorded.stderr.contains(&expected), "{recorded:?}");
    assert!(recorded.stderr.contains("but does not answer (is it stopped"), "{recorded:?}");
}

#[test]
fn a_recording_prints_its_progress_for_a_program() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope"]);
    let file = sandbox.path("run.mcap");
    let args = ["record", "-o", &file, "--progress", "--json"];
    let mut recording = Process::start(Program::Recorder, &sandbox, &args);
    wait_for("a line with snapshots and a size", || {
        let lines = recording.wait_for_output(1);
        let last: Value = serde_json::from_str(lines.last()?).unwrap();
        let number = |name: &str| last[name].as_f64().unwrap();
        assert!(number("seconds") > 0.0 && last["lost"].is_object(), "{last}");
        (number("snapshots") > 0.0 && number("size_bytes") > 0.0).then_some(())
    });
    let ended = recording.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let report: Value = serde_json::from_str(ended.stdout.lines().last().unwrap()).unwrap();
    assert_eq!(report["stop_reason"], "signal");
}

#[test]
fn a_recording_ends_cleanly_when_the_reader_of_its_progress_has_gone() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope"]);
    let file = sandbox.path("run.mcap");
    let recorder = Program::Recorder.path().display().to_string();
    // The reader ends with the first line that counts a snapshot.
    let script = r#"set -o pipefail; "$0" record -o "$1" --progress | grep -qv '"snapshots":0,'"#;
    let args = ["-c", script, &recorder, &file];
    let ended = Process::start(Program::Bash, &sandbox, &args).wait();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    let info = Process::run(Program::Recorder, &sandbox, &["info", &file, "--json"]).json();
    assert_eq!(info["stop_reason"], "reader of the progress gone", "{info}");
}

#[test]
fn a_recording_of_a_time_has_the_steps_that_a_node_makes_in_that_time() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope"]);
    let skipped = || ctl(&sandbox, &["status"])["skipped_periods"].as_u64().unwrap();
    let before = skipped();
    let file = sandbox.path("run.mcap");
    let args = ["record", "-o", &file, "--duration", "1s", "--json"];
    let report = Process::run(Program::Recorder, &sandbox, &args).json();
    let step = |name: &str| report[name].as_u64().unwrap();
    // A node that does not get enough of the processor gives steps up.
    let steps = step("last_step") - step("first_step") + skipped() - before;
    assert!(steps >= 240, "{steps} steps of 240: {report}");
    assert_eq!(report["stop_reason"], "duration reached");
    // A paused node makes no more steps, and the recording ends all the same.
    let paused = sandbox.path("paused.mcap");
    let args = ["record", "-o", &paused, "--duration", "1s"];
    let mut recording = Process::start(Program::Recorder, &sandbox, &args);
    recording.wait_for_line("recording from step ");
    ctl(&sandbox, &["pause"]);
    assert!(recording.wait().success().ends_with("stopped     duration reached\n"));
}

#[test]
fn every_reader_of_a_recording_stops_at_a_signal() {
    let sandbox = Sandbox::new();
    let file = large_recording(&sandbox);
    let pictures = sandbox.path("pictures");
    let commands = ["simulate", "rope", "--steps", "1", "--commands", file.as_str()];
    // To draw them all would take a minute.
    let export = ["export", &file, "--png", &pictures, "--frames", "400"];
    let (table, vtk) = (sandbox.path("table.csv"), sandbox.path("vtk"));
    for Reader { args, code, output } in [
        Reader { args: vec!["verify", &file], code: 1, output: "interrupted" },
        Reader { args: export.to_vec(), code: 1, output: "interrupted" },
        Reader { args: vec!["export", &file, "--csv", &table], code: 1, output: "interrupted" },
        Reader {
            args: vec!["export", &file, "--vtk", &vtk, "--every", "20ms"],
            code: 1,
            output: "interrupted",
        },
        Reader { args: commands.to_vec(), code: 1, output: "interrupted" },
    ] {
        let mut process = Process::start(Program::Recorder, &sandbox, &args);
        process.wait_until_it_handles(Signal::INT);
        let finished = process.interrupt();
        assert_eq!(finished.code, Some(code), "{args:?}: {finished:?}");
        let text = finished.stdout + &finished.stderr;
        assert!(text.contains(output), "{args:?}: {text}");
    }
}

/// The other tests end programs while they read the recording for the first time.
#[test]
fn an_export_that_is_interrupted_while_it_writes_leaves_no_file() {
    let sandbox = Sandbox::new();
    let file = large_recording(&sandbox);
    let folder = sandbox.path("frames");
    let args = ["export", &file, "--obj", &folder, "--every", "20ms"];
    let process = Process::start(Program::Recorder, &sandbox, &args);
    let count = || std::fs::read_dir(&folder).map_or(0, Iterator::count);
    wait_for("a written file", || (count() > 0).then_some(()));
    let finished = process.interrupt();
    assert_eq!((finished.code, count()), (Some(1), 0), "{finished:?}");
    let folder = sandbox.path("cache");
    std::fs::create_dir(&folder).unwrap();
    let cache = format!("{folder}/run.pc2");
    let args = ["export", &file, "--pc2", &cache];
    let process = Process::start(Program::Recorder, &sandbox, &args);
    let count = || std::fs::read_dir(&folder).map_or(0, Iterator::count);
    wait_for("a begun file", || (count() > 0).then_some(()));
    let finished = process.interrupt();
    assert_eq!((finished.code, count()), (Some(1), 0), "{finished:?}");
}

#[test]
fn a_scan_of_many_records_stops_at_a_signal() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("records.mcap");
    let (_, mut bytes) = small(&sandbox);
    // Private records without content. A file without an end is scanned.
    bytes.extend([0x80, 0, 0, 0, 0, 0, 0, 0, 0].repeat(20_000_000));
    std::fs::write(&file, &bytes).unwrap();
    let repaired = sandbox.path("repaired.mcap");
    for (program, args, code) in [
        (Program::ViewerBridge, vec!["--replay", &file, "--listen", "127.0.0.1:0"], Some(0)),
        (Program::Recorder, vec!["verify", &file], Some(1)),
        (Program::Recorder, vec!["check", &file], Some(1)),
        (Program::Recorder, vec!["repair", &file, &repaired], Some(1)),
    ] {
        let mut process = Process::start(program, &sandbox, &args);
        process.wait_until_it_handles(Signal::INT);
        let finished = process.interrupt();
        assert_eq!(finished.code, code, "{args:?}: {finished:?}");
    }
}
