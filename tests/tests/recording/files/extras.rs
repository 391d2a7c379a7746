//! Content of the user in recordings: metadata and attached files, and the options of their format.

use integration_tests::{Finished, Process, Program, Sandbox, ctl, wait_for};
use serde_json::Value;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

fn contains(file: &str, text: &[u8]) -> bool {
    std::fs::read(file).unwrap().windows(text.len()).any(|bytes| bytes == text)
}

#[test]
fn every_file_of_a_recording_has_the_metadata_and_the_attachments() {
    let sandbox = Sandbox::new();
    let notes = sandbox.write("notes.txt", "the third run of the day");
    // Longer than any record of a recorder itself.
    let large = sandbox.path("large.bin");
    std::fs::write(&large, vec![7; 20 << 20]).unwrap();
    let output = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope", "--paused"]);
    let args =
        ["record", "-o", &output, "--follow", "--preset", "small", "--meta", "operator=Ada L"];
    let args: Vec<_> = args
        .into_iter()
        .chain(["--meta", "place=", "--attach", &notes, "--attach", &large])
        .collect();
    let mut recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    recording.wait_for_line("recording from step");
    ctl(&sandbox, &["step", "5"]);
    // A file that another program replaces stays the one that was attached.
    std::fs::remove_file(&notes).unwrap();
    std::fs::write(&notes, "other").unwrap();
    ctl(&sandbox, &["load", "pendulum"]);
    ctl(&sandbox, &["step", "5"]);
    recording.interrupt().success();
    for number in 0..2 {
        let file = sandbox.path(&format!("run_{number:04}.mcap"));
        assert!(contains(&file, b"the third run of the day"), "{file}");
        assert!(contains(&file, b"operator\x05\0\0\0Ada L"), "{file}");
        let report = recorder(&sandbox, &["verify", "--json", &file]).json();
        assert_eq!(report["verdict"], "identical", "{report}");
        recorder(&sandbox, &["info", &file]).success();
    }
}

#[test]
fn content_that_cannot_be_attached_is_refused_at_the_start() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope", "--paused"]);
    let output = sandbox.path("run.mcap");
    let (missing, scene) = (sandbox.path("missing"), sandbox.write("scene.toml", ""));
    let folder = sandbox.path("folder");
    std::fs::create_dir(&folder).unwrap();
    let huge = sandbox.path("huge");
    std::fs::File::create(&huge).unwrap().set_len((256 << 20) + 1).unwrap();
    for (option, value, words) in [
        ("--attach", missing.as_str(), "No such file"),
        ("--attach", &folder, "it is a directory"),
        ("--attach", &huge, "allowed: 268435456"),
        ("--attach", &scene, "rename the file"),
        ("--meta", &format!("long={}", "x".repeat(40_000)), "use --attach"),
    ] {
        let refused = recorder(&sandbox, &["record", "-o", &output, option, value]);
        assert_eq!(refused.code, Some(1), "{option} {value:.99}: {refused:?}");
        assert!(refused.stderr.contains(words), "no \"{words}\" in: {}", refused.stderr);
    }
    for (option, value, words) in [
        ("--meta", "operator", "such as operator=Ada"),
        ("--flush-interval", "1ms", "from 100ms to 1h"),
        ("--preset", "tiny", "possible values: fast, default, small"),
        ("--split-size", "100", "at least 64KiB"),
    ] {
        let refused = recorder(&sandbox, &["record", "-o", &output, option, value]);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(refused.stderr.contains(words), "no \"{words}\" in: {}", refused.stderr);
    }
    assert!(!std::path::Path::new(&output).exists());
    assert!(!std::path::Path::new(&(output + ".part")).exists());
}

#[test]
fn a_short_flush_interval_brings_slow_messages_into_the_file() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope", "--paused"]);
    let args = ["record", "-o", &file, "--flush-interval", "1h", "--no-sync"];
    let mut rare = Process::start_ready(Program::Recorder, &sandbox, &args);
    rare.wait_for_line("recording from step");
    let other = sandbox.path("other.mcap");
    let args = ["record", "-o", &other, "--flush-interval", "100ms"];
    let _often = Process::start_ready(Program::Recorder, &sandbox, &args);
    let has_chunk = |file: &str| {
        let info = recorder(&sandbox, &["info", "--json", &format!("{file}.part")]);
        let info: Value = serde_json::from_str(&info.stdout).ok()?;
        info["first_step"].is_number().then_some(())
    };
    wait_for("the flushed chunk", || has_chunk(&other));
    assert_eq!(has_chunk(&file), None, "a chunk without a flush");
}
