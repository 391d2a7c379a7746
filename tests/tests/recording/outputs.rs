//! Output files: two programs never write the same one, and a limit on their size ends with a message.

use std::path::Path;

use integration_tests::{
    Finished, Process, Program, Sandbox, Stream, Streams, ctl, record, wait_for,
};
use recording::{LogEnd, LogReader};

/// Limit on the size of files: several chunks, and less than any of the recordings here.
const SIZE_LIMIT_BYTES: u64 = 4_000_000;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

#[test]
fn a_second_writer_of_a_file_is_refused_and_the_first_one_finishes() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let part = format!("{file}.part");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope", "--paused"]);
    let first = record(&sandbox, &file);
    ctl(&sandbox, &["step", "20"]);
    for args in [
        &["record", "-o", &file][..],
        &["record", "-o", &file, "--overwrite"],
        &["simulate", "rope", "--steps", "5", "-o", &file, "--overwrite"],
    ] {
        let refused = recorder(&sandbox, args);
        assert_eq!(refused.code, Some(1), "{}", refused.stderr);
        let expected = format!("error: {part} is being written by ");
        assert!(refused.stderr.contains(&expected), "no \"{expected}\" in: {}", refused.stderr);
    }
    ctl(&sandbox, &["step", "20"]);
    assert_eq!(first.interrupt().code, Some(0));
    let verified = recorder(&sandbox, &["verify", &file]).success();
    assert!(verified.contains("40 steps bit-identical"), "{verified}");
}

#[test]
fn a_recording_whose_name_is_taken_meanwhile_is_complete_under_its_unfinished_name() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope", "--paused"]);
    let file = sandbox.path("run.mcap");
    let args = ["record", "-o", &file, "--steps", "5"];
    let recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    std::fs::write(&file, "other").unwrap();
    ctl(&sandbox, &["step", "20"]);
    let finished = recording.wait();
    let complete = format!("; the complete file is {file}.part\n");
    assert_eq!(finished.code, Some(1), "{finished:?}");
    assert!(finished.stderr.ends_with(&complete), "{finished:?}");
    assert!(!finished.stderr.contains("except for its end"), "{finished:?}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "other");
    recorder(&sandbox, &["info", &format!("{file}.part")]).success();
}

#[test]
fn a_recorder_that_waits_for_a_node_refuses_an_unusable_output_first() {
    let sandbox = Sandbox::new();
    let (taken, cut) = (sandbox.write("taken.mcap", "mine"), sandbox.path("cut.mcap"));
    let part = sandbox.write("cut.mcap.part", "of a killed recorder");
    let missing = sandbox.path("missing/run.mcap");
    for (output, problem) in [
        (&taken, format!("{taken} exists (use --overwrite to replace it)")),
        (&cut, format!("{part} exists: the program that wrote it was killed")),
        (&missing, format!("cannot write {missing}.part: ")),
        (&sandbox.path(""), "name a file".to_owned()),
    ] {
        // Without the check, the recorder would wait for as long as that.
        let args = ["record", "--wait", "--duration", "1s", "-o", output];
        let refused = recorder(&sandbox, &args);
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.stderr.contains(&problem), "no \"{problem}\" in: {}", refused.stderr);
        assert!(!refused.stderr.contains("waiting for a node"), "{}", refused.stderr);
    }
    let waiting =
        recorder(&sandbox, &["record", "--wait", "--duration", "100ms", "--overwrite", "-o", &cut]);
    assert!(waiting.stderr.contains("no node has come up"), "{}", waiting.stderr);
    assert_eq!(std::fs::read_to_string(&part).unwrap(), "of a killed recorder", "it may be needed");
}

#[test]
fn times_in_exported_data_are_those_of_the_run() {
    let sandbox = Sandbox::new();
    let (file, table) = (sandbox.path("late.mcap"), sandbox.path("late.csv"));
    let args = ["run", "rope", "--rate", "200", "--paused"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    ctl(&sandbox, &["step", "30"]);
    let recording = record(&sandbox, &file);
    ctl(&sandbox, &["step", "10"]);
    recording.interrupt().success();
    recorder(&sandbox, &["export", &file, "--csv", &table]).success();
    let text = std::fs::read_to_string(&table).unwrap();
    assert!(text.lines().nth(1).unwrap().starts_with("30,0.15,0,"), "{}", &text[..200]);
    assert!(text.lines().last().unwrap().starts_with("40,0.2,"));
}

#[test]
fn an_export_to_stdout_prints_its_result_on_stderr() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "rope", "--steps", "10", "-o", &file]).success();
    for option in ["--apng", "--npz", "--csv", "--usda", "--foxglove"] {
        let output = sandbox.path(option);
        let size = if option == "--apng" { &["--size", "32x32"][..] } else { &[] };
        let export = |target| {
            let args = ["export", &file, option, target, "--every", "20ms"];
            recorder(&sandbox, &[&args[..], size].concat())
        };
        export(&output).success();
        let piped = export("-");
        let expected = std::fs::read(output).unwrap();
        assert_eq!(piped.code, Some(0), "{option}: {}", piped.stderr);
        assert!(piped.stdout == String::from_utf8_lossy(&expected), "{option}");
        assert!(piped.stderr.contains("-: 3 snapshots (steps 0..=10)"), "{}", piped.stderr);
    }
    let refused = recorder(&sandbox, &["export", &file, "--pc2", "-"]);
    assert_eq!((refused.code, refused.stdout.as_str()), (Some(1), ""), "{refused:?}");
}

#[test]
fn an_export_to_stdout_ends_quietly_with_its_reader_and_fails_on_a_full_disk() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "rope", "--steps", "200", "-o", &file]).success();
    for option in ["--npz", "--csv", "--usda", "--foxglove"] {
        let export = |stdout| {
            let streams = Streams { stdout, ..Streams::default() };
            let args = ["export", &file, option, "-"];
            Process::start_with(streams, Program::Recorder, &sandbox, &args).wait()
        };
        let without_reader = export(Stream::ClosedPipe);
        assert_eq!(without_reader.code, Some(0), "{option}: {without_reader:?}");
        assert!(!without_reader.stderr.contains("error"), "{option}: {without_reader:?}");
        let full = export(Stream::Full);
        assert_eq!(full.code, Some(1), "{option}: {full:?}");
        assert!(full.stderr.contains("No space left on device"), "{option}: {full:?}");
    }
}

#[test]
fn a_limit_on_the_size_of_files_ends_an_export_with_the_name_of_the_output() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "curtain", "--steps", "200", "-o", &file]).success();
    for format in ["npz", "csv", "usda", "foxglove", "apng", "pc2", "obj", "ros2"] {
        let (option, output) = (format!("--{format}"), sandbox.path(&format!("{format}.mcap")));
        let args = ["export", &file, &option, &output];
        // 4 KiB, in blocks of half of that or less.
        let export = Process::start_limited(("-f", 4), Program::Recorder, &sandbox, &args);
        let finished = export.wait();
        assert_eq!(finished.code, Some(1), "{finished:?}");
        let error = finished.stderr.lines().last().unwrap_or_default();
        let expected = format!("error: cannot write {output}");
        assert!(error.starts_with(&expected), "no \"{expected}\" in: {}", finished.stderr);
        assert!(error.contains("File too large"), "{error}");
        assert!(!Path::new(&output).is_file() && !Path::new(&format!("{output}.part")).exists());
    }
    let simulate = ["simulate", "curtain", "--steps", "9", "-o", &sandbox.path("empty.mcap")];
    let simulation = Process::start_limited(("-f", 0), Program::Recorder, &sandbox, &simulate);
    let finished = simulation.wait();
    assert!(finished.stderr.contains("; nothing of it was written: "), "{finished:?}");
}

#[test]
fn a_scene_beyond_the_memory_of_the_process_is_refused_with_a_sentence() {
    let sandbox = Sandbox::new();
    let text = "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 1900\nrows = 1900\nspacing = 0.01\n";
    let scene = sandbox.write("large.toml", text);
    // 600 MiB of addresses for each.
    let limit = ("-v", 600 << 10);
    let simulation = ["simulate", &scene, "--steps", "1"];
    for (program, args) in [
        (Program::Recorder, &simulation[..]),
        (Program::SimNode, &["run", &scene, "--name", "large"]),
    ] {
        let finished = Process::start_limited(limit, program, &sandbox, args).wait();
        assert_eq!(finished.code, Some(1), "{finished:?}");
        let error = finished.stderr.lines().last().unwrap_or_default();
        let (start, needed) = error.split_once("takes about ").unwrap();
        assert!(start.starts_with("error: ") && start.contains("not enough memory"), "{error}");
        let needed: u64 = needed.split(' ').next().unwrap().parse().unwrap();
        assert!((2000..3500).contains(&needed), "{error}");
    }
}

/// From too little memory for the text to enough for the run, a program works or says what is missing, and never aborts.
#[test]
fn at_every_limit_of_memory_a_scene_is_simulated_or_refused_with_a_sentence() {
    let sandbox = Sandbox::new();
    let sheet = "[[generate]]\nshape = \"cloth\"\ncolumns = 250\nrows = 250\nspacing = 0.01\n";
    let contact = "[contact]\nmode = \"surfaces\"\n";
    let doll = "[[generate]]\nshape = \"ragdoll\"\nheight = 1\norigin = [@, 0, 0]\n";
    let dolls: String = (0..2000).map(|at| doll.replace('@', &at.to_string())).collect();
    let out = sandbox.path("out.mcap");
    for (text, limits_mib) in [
        (sheet, &[40, 56, 60, 64, 400][..]),
        (&format!("{contact}{sheet}"), &[40, 90, 140, 700]),
        (&dolls, &[40, 44, 48, 56, 300]),
    ] {
        let scene = sandbox.write("scene.toml", &format!("version = 1\n{text}"));
        let plain = ["simulate", &scene, "--steps", "0"];
        let recorded = [&plain[..], &["-o", &out, "--overwrite", "--threads", "2"]].concat();
        for args in [&plain[..], &recorded] {
            let code = |limit_mib: &u64| {
                let limit = ("-v", limit_mib << 10);
                let finished =
                    Process::start_limited(limit, Program::Recorder, &sandbox, args).wait();
                let is_refused = finished.stderr.contains("not enough memory: ");
                assert_eq!(finished.code, Some(i32::from(is_refused)), "{limit_mib}: {finished:?}");
                is_refused
            };
            let are_refused: Vec<_> = limits_mib.iter().map(code).collect();
            let ([first, ..], [.., last]) = (&are_refused[..], &are_refused[..]) else { panic!() };
            assert!(*first && !*last, "{are_refused:?}");
        }
    }
}

#[test]
fn a_node_with_little_memory_refuses_the_scenes_beyond_it_and_goes_on() {
    let sandbox = Sandbox::new();
    let limit = ("-v", 600 << 10);
    let args = ["run", "rope", "--history", "0", "--paused"];
    let mut node = Process::start_limited(limit, Program::SimNode, &sandbox, &args);
    node.wait_until_ready();
    let load = |size: u32, contact: &str| {
        let text = format!(
            "version = 1\n[contact]\nmode = \"{contact}\"\n[[generate]]\nshape = \"cloth\"\ncolumns = {size}\n\
             rows = {size}\nspacing = 0.01\n"
        );
        let scene = sandbox.write("sheet.toml", &text);
        ctl(&sandbox, &["load", &scene, "--timeout", "60s"])
    };
    for contact in ["off", "surfaces"] {
        assert_eq!(load(60, contact)["status"], "applied");
        for size in [200, 300, 450, 2000] {
            load(size, contact);
            // Answered by the node, which is alive.
            assert_eq!(ctl(&sandbox, &["step"])["status"], "applied", "{contact}, {size}");
        }
        assert_eq!(load(2000, contact)["status"], "rejected");
    }
    let stopped = node.interrupt();
    assert_eq!(stopped.code, Some(0), "{}", stopped.stderr);
}

/// Asserts that a program failed at the limit, and left the readable part of its recording.
fn assert_ended_at_the_limit(finished: &Finished, file: &str) {
    assert_eq!(finished.code, Some(1), "{}", finished.stderr);
    let part = format!("{file}.part");
    for words in [&part, "File too large", "ulimit -f"] {
        assert!(finished.stderr.contains(words), "no \"{words}\" in: {}", finished.stderr);
    }
    assert!(finished.stderr.contains(&format!("`recorder check {part}`")), "{}", finished.stderr);
    assert!(!Path::new(file).exists());
    assert!(std::fs::metadata(&part).unwrap().len() <= SIZE_LIMIT_BYTES);
    let mut log = LogReader::open(Path::new(&part)).unwrap();
    let messages = std::iter::from_fn(|| log.next_message().unwrap()).count();
    assert!(messages > 0);
    assert!(matches!(log.end(), Some(LogEnd::Truncated { .. })), "{:?}", log.end());
}

#[test]
fn a_limit_on_the_size_of_files_ends_a_recording_with_a_message() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let args = ["record", "-o", &file, "--compression", "none"];
    let mut recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    recording.limit_file_size(SIZE_LIMIT_BYTES);
    wait_for("the end of the recording", || (!recording.is_running()).then_some(()));
    assert_ended_at_the_limit(&recording.wait(), &file);
}

#[test]
fn a_limit_on_the_size_of_files_ends_a_simulation_with_a_message() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let args = ["simulate", "curtain", "--steps", "100000000", "-o", &file];
    let simulation = Process::start(Program::Recorder, &sandbox, &args);
    simulation.limit_file_size(SIZE_LIMIT_BYTES);
    assert_ended_at_the_limit(&simulation.wait(), &file);
}
