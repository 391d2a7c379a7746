//! The recorder refuses bad input: files that are not recordings, missing nodes, invalid options.

use integration_tests::{Finished, Process, Program, Sandbox};

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

fn assert_refused(finished: &Finished, words: &[&str]) {
    assert_eq!(finished.code, Some(1), "{}{}", finished.stdout, finished.stderr);
    for word in words {
        assert!(finished.stderr.contains(word), "no \"{word}\" in: {}", finished.stderr);
    }
}

fn make_pipe(path: &str) {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
}

#[test]
fn a_file_that_is_not_a_recording_is_named() {
    let sandbox = Sandbox::new();
    let text = sandbox.write("text.mcap", "this is not a recording, but long enough to be read");
    let empty = sandbox.write("empty.mcap", "");
    let missing = sandbox.path("missing.mcap");
    for verb in ["info", "play", "verify"] {
        for file in [&text, &empty, &missing] {
            assert_refused(&recorder(&sandbox, &[verb, file]), &[file]);
        }
    }
}

#[test]
fn an_unfinished_recording_is_named_by_its_part_file() {
    let sandbox = Sandbox::new();
    let (file, part) = (sandbox.path("run.mcap"), sandbox.write("run.mcap.part", "half"));
    let pictures = sandbox.path("pictures");
    for args in [
        &["info", &file][..],
        &["verify", &file],
        &["play", &file],
        &["scene", &file],
        &["export", &file, "--png", &pictures],
    ] {
        let expected = format!("{file}: no such file, but {part} exists");
        assert_refused(&recorder(&sandbox, args), &[&expected]);
    }
}

#[test]
fn a_truncated_recording_is_read_to_its_end_and_reported_as_truncated() {
    let sandbox = Sandbox::new();
    let whole = sandbox.path("whole.mcap");
    recorder(&sandbox, &["simulate", "curtain", "--steps", "2400", "-o", &whole]).success();
    let bytes = std::fs::read(&whole).unwrap();
    let cut = sandbox.path("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 6 / 10]).unwrap();
    for verb in ["info", "verify"] {
        let finished = recorder(&sandbox, &[verb, &cut]);
        assert_eq!(finished.code, Some(3), "{verb}: {}{}", finished.stdout, finished.stderr);
        let output = finished.stdout + &finished.stderr;
        assert!(output.contains("truncated"), "{verb}: {output}");
    }
    let played = recorder(&sandbox, &["play", &cut, "--rate", "50"]);
    assert_eq!(played.code, Some(3), "{}", played.stderr);
    assert!(played.stderr.contains("truncated"), "{}", played.stderr);
}

#[test]
fn export_names_a_file_that_it_cannot_draw_and_draws_a_truncated_one() {
    let sandbox = Sandbox::new();
    let pictures = sandbox.path("pictures");
    let text = sandbox.write("text.mcap", "this is not a recording, but long enough to be read");
    assert_refused(&recorder(&sandbox, &["export", &text, "--png", &pictures]), &[&text]);
    assert!(!std::path::Path::new(&pictures).exists());

    let whole = sandbox.path("whole.mcap");
    recorder(&sandbox, &["simulate", "rope", "--steps", "2400", "-o", &whole]).success();
    let late = recorder(&sandbox, &["export", &whole, "--png", &pictures, "--at", "20s"]);
    assert_refused(&late, &[&whole, "--at 20s", "10.000 s"]);
    let bytes = std::fs::read(&whole).unwrap();
    let cut = sandbox.path("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let args = ["export", &cut, "--svg", &pictures, "--frames", "2"];
    let drawn = recorder(&sandbox, &args);
    assert_eq!(drawn.code, Some(3), "{}", drawn.stderr);
    assert!(drawn.stderr.contains("truncated"), "{}", drawn.stderr);
    let files: Vec<_> = drawn.stdout.lines().collect();
    assert_eq!(files.len(), 2, "{}", drawn.stdout);
    assert!(files[0].ends_with("/rope_00000000.svg"), "{}", drawn.stdout);
    assert!(std::fs::read_to_string(files[1]).unwrap().starts_with("<svg"));

    assert_refused(&recorder(&sandbox, &args), &[files[0], "exists", "--overwrite"]);
    let again: Vec<_> = args.into_iter().chain(["--overwrite", "--json"]).collect();
    let again = recorder(&sandbox, &again);
    assert_eq!(again.code, Some(3), "{}", again.stderr);
    assert!(again.stdout.starts_with("[{\"file\":"), "{}", again.stdout);
    assert!(again.stdout.contains("\"step\":0,\"time_s\":0.0}"), "{}", again.stdout);
}

#[test]
fn export_never_replaces_its_recording_and_refuses_an_empty_range() {
    let sandbox = Sandbox::new();
    let run = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "rope", "--steps", "24", "-o", &run]).success();
    let before = std::fs::read(&run).unwrap();
    for option in ["--npz", "--csv", "--pc2", "--usda", "--vtk", "--png"] {
        let refused = recorder(&sandbox, &["export", &run, option, &run, "--overwrite"]);
        assert_refused(&refused, &[&run, "this is the input", "choose another name"]);
    }
    assert_eq!(std::fs::read(&run).unwrap(), before);
    // A bag is named after the scene.
    let (folder, bag) = (sandbox.path("bags"), sandbox.path("bags/rope.mcap"));
    std::fs::create_dir(&folder).unwrap();
    std::fs::copy(&run, &bag).unwrap();
    let refused = recorder(&sandbox, &["export", &bag, "--ros2", &folder, "--overwrite"]);
    assert_refused(&refused, &[&bag, "this is the input", "choose another name"]);
    assert_eq!(std::fs::read(&bag).unwrap(), before);
    let table = sandbox.path("run.csv");
    let refused = recorder(&sandbox, &["export", &run, "--csv", &table, "--from", "1h"]);
    assert_refused(&refused, &[&run, "select no snapshot", "0 (0 s) to 24 (0.100 s)"]);
    assert!(!std::path::Path::new(&table).exists());
    let args = ["export", &run, "--csv", &table, "--from", "50ms", "--to", "13", "--json"];
    let written = recorder(&sandbox, &args).success();
    assert!(
        written.contains("\"snapshot_count\":2,\"first_step\":12,\"last_step\":13"),
        "{written}"
    );
    let rows = std::fs::read_to_string(&table).unwrap();
    assert!(rows.lines().skip(1).all(|row| row.starts_with("12,") || row.starts_with("13,")));
    assert_refused(&recorder(&sandbox, &args), &[&table, "exists", "--overwrite"]);
}

#[test]
fn a_truncated_recording_is_exported_as_far_as_it_goes() {
    let sandbox = Sandbox::new();
    let (whole, cut) = (sandbox.path("whole.mcap"), sandbox.path("cut.mcap"));
    recorder(&sandbox, &["simulate", "rope", "--steps", "2400", "-o", &whole]).success();
    let bytes = std::fs::read(&whole).unwrap();
    std::fs::write(&cut, &bytes[..bytes.len() * 6 / 10]).unwrap();
    let table = sandbox.path("cut.csv");
    let exported = recorder(&sandbox, &["export", &cut, "--csv", &table, "--every", "1s"]);
    assert_eq!(exported.code, Some(3), "{exported:?}");
    assert!(exported.stderr.contains("exported as far as it goes"), "{exported:?}");
    let text = std::fs::read_to_string(&table).unwrap();
    let steps: std::collections::BTreeSet<_> =
        text.lines().skip(1).map(|row| row.split(',').next().unwrap()).collect();
    assert!(steps.contains("0") && steps.contains("240"), "{steps:?}");
    assert!(!steps.contains("2400"), "{steps:?}");
}

#[test]
fn a_start_after_the_end_is_refused_with_the_time_of_the_last_snapshot() {
    let sandbox = Sandbox::new();
    let run = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "pendulum", "--steps", "240", "-o", &run]).success();
    let info = recorder(&sandbox, &["info", &run]).success();
    let last = info.lines().find_map(|line| line.strip_prefix("steps ")?.rsplit(", ").next());
    let last = last.unwrap();
    let expected =
        format!("error: {run}: --start 1h is after its last snapshot, which is at {last}\n");
    let refused = recorder(&sandbox, &["play", &run, "--start", "1h"]);
    assert_eq!((refused.code, refused.stderr), (Some(1), expected));
    assert!(info.contains(": 2 particles, 1 constraint, "), "{info}");
}

#[test]
fn a_missing_node_is_reported_with_its_domain_and_how_to_start_one() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let finished = recorder(&sandbox, &["record", "-o", &file]);
    assert_refused(&finished, &["no node runs as 'sim'", sandbox.domain(), "sim-node run"]);
    assert!(!std::path::Path::new(&file).exists());
    assert!(!std::path::Path::new(&format!("{file}.part")).exists());
}

#[test]
fn an_existing_file_is_overwritten_only_on_request() {
    let sandbox = Sandbox::new();
    let file = sandbox.write("run.mcap", "precious");
    let args = ["simulate", "curtain", "--steps", "3", "-o", &file];
    assert_refused(&recorder(&sandbox, &args), &["exists", "--overwrite"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "precious");
    let args: Vec<_> = args.into_iter().chain(["--overwrite"]).collect();
    recorder(&sandbox, &args).success();
    recorder(&sandbox, &["info", &file]).success();
}

#[test]
fn an_output_that_is_not_a_file_is_refused_at_the_start_even_with_overwrite() {
    let sandbox = Sandbox::new();
    let run = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "rope", "--steps", "3", "-o", &run]).success();
    let (folder, pipe) = (sandbox.path("folder"), sandbox.path("pipe"));
    std::fs::create_dir(&folder).unwrap();
    make_pipe(&pipe);
    let pictures = sandbox.path("pictures");
    std::fs::create_dir(&pictures).unwrap();
    let picture = format!("{pictures}/rope_00000003.png");
    make_pipe(&picture);
    for (args, problem) in [
        (
            vec!["simulate", "rope", "--steps", "3", "-o", &folder],
            format!("{folder} is a directory"),
        ),
        (
            vec!["simulate", "rope", "--steps", "3", "-o", &pipe],
            format!("{pipe} is a named pipe (FIFO)"),
        ),
        (vec!["scene", &run, "-o", &folder], format!("{folder} is a directory")),
        (vec!["scene", &run, "-o", &pipe], format!("{pipe} is a named pipe (FIFO)")),
        (vec!["export", &run, "--png", &pictures], format!("{picture} is a named pipe (FIFO)")),
        (vec!["export", &run, "--npz", &folder], format!("{folder} is a directory")),
        (vec!["export", &run, "--usda", &pipe], format!("{pipe} is a named pipe (FIFO)")),
    ] {
        for overwrite in [&[][..], &["--overwrite"]] {
            let refused = recorder(&sandbox, &[&args, overwrite].concat());
            assert_eq!(refused.code, Some(1), "{}", refused.stdout);
            assert_eq!(refused.stderr, format!("error: {problem}; name a file\n"));
        }
    }
    assert_eq!(std::fs::read_dir(&pictures).unwrap().count(), 1, "no picture was drawn");
    for (option, not_a_folder) in [("--png", &pipe), ("--obj", &pipe), ("--vtk", &picture)] {
        let refused = recorder(&sandbox, &["export", &run, option, not_a_folder, "--overwrite"]);
        let problem = format!("{not_a_folder} is not a folder; name a folder for the files");
        assert_eq!((refused.code, refused.stderr), (Some(1), format!("error: {problem}\n")));
    }
    for part in [folder + ".part", pipe + ".part"] {
        assert!(!std::path::Path::new(&part).exists(), "{part}");
    }
}

#[test]
fn an_invalid_command_file_is_refused_with_line_and_field_and_nothing_is_written() {
    let sandbox = Sandbox::new();
    let lines = "{\"step\":1,\"kind\":\"reset\"}\n{\"step\":2,\"kind\":\"pin\"}\n";
    let commands = sandbox.write("bad.jsonl", lines);
    let file = sandbox.path("out.mcap");
    let args = ["simulate", "curtain", "--steps", "3", "--commands", &commands, "-o", &file];
    let finished = recorder(&sandbox, &args);
    let expected = format!("error: {commands}:2: particle: ");
    assert_refused(&finished, &[]);
    assert!(finished.stderr.starts_with(&expected), "{}", finished.stderr);
    assert!(!std::path::Path::new(&file).exists());
}

#[test]
fn invalid_options_exit_with_2() {
    let sandbox = Sandbox::new();
    for args in
        [&["simulate", "curtain"][..], &["play"], &["play", "x.mcap", "--rate", "-1"], &["dance"]]
    {
        assert_eq!(recorder(&sandbox, args).code, Some(2), "{args:?}");
    }
}

#[test]
fn commands_after_the_last_step_are_a_warning_that_names_their_file() {
    let sandbox = Sandbox::new();
    let commands = sandbox.write("late.jsonl", "{\"step\":100,\"kind\":\"pause\"}\n");
    let output = sandbox.path("out.mcap");
    let args = ["simulate", "rope", "--steps", "50", "--commands", &commands, "-o", &output];
    let finished = recorder(&sandbox, &args);
    assert_eq!(finished.code, Some(0), "{}", finished.stderr);
    for words in [&*commands, "after 50", "--steps 100 or more"] {
        assert!(finished.stderr.contains(words), "no \"{words}\" in: {}", finished.stderr);
    }
    assert!(std::path::Path::new(&output).exists());
}

#[test]
fn a_fifo_is_refused_without_waiting_for_a_writer() {
    let sandbox = Sandbox::new();
    for (name, make) in [
        ("pipe.toml", ["simulate", "--steps", "1"].as_slice()),
        ("pipe.jsonl", ["simulate", "rope", "--steps", "1", "--commands"].as_slice()),
        ("pipe.mcap", ["info"].as_slice()),
    ] {
        let pipe = sandbox.path(name);
        make_pipe(&pipe);
        let args: Vec<_> = make.iter().copied().chain([pipe.as_str()]).collect();
        assert_refused(&recorder(&sandbox, &args), &[&pipe, "FIFO"]);
    }
}

#[test]
fn the_scene_of_a_recording_simulates_to_the_same_states() {
    let sandbox = Sandbox::new();
    let run = sandbox.path("run.mcap");
    let args = ["simulate", "curtain", "--steps", "60", "-o", &run, "--json"];
    let first = recorder(&sandbox, &args).success();
    let scene = recorder(&sandbox, &["scene", &run]).success();
    let scene = sandbox.write("scene.toml", &scene);
    let again = recorder(&sandbox, &["simulate", &scene, "--steps", "60", "--json"]).success();
    let hash = |stdout: &str| {
        let summary: serde_json::Value = serde_json::from_str(stdout).unwrap();
        summary["state_hash"].as_str().unwrap().to_owned()
    };
    assert_eq!(hash(&again), hash(&first));
}

#[test]
fn wrong_option_values_state_what_is_expected() {
    let sandbox = Sandbox::new();
    for (args, words) in [
        (["simulate", "rope", "--steps", "-1"].as_slice(), "it must be a whole number from 0"),
        (&["record", "--duration", "-5s"], "it must be a time with its unit"),
        (&["play", "run.mcap", "--rate", "-1"], "it must be a number from 0.01 to 100"),
        (
            &["info", "run.mcap", "--jsn"],
            "unexpected argument '--jsn' found\n\n  tip: a similar argument exists: '--json'",
        ),
        (
            &["export", "run.mcap", "--fbx", "a.fbx"],
            "unexpected argument '--fbx' found\n\nUsage: recorder export <--png <DIR>|--svg <DIR>|",
        ),
    ] {
        let refused = recorder(&sandbox, args);
        assert_eq!(refused.code, Some(2), "{}", refused.stderr);
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
}
