//! `recorder check` and `recorder repair` on damaged and unfinished files: exit codes, names, and that no
//! input is changed.

use std::fs;

use integration_tests::{Finished, Process, Program, Sandbox, record, wait_for};
use rustix::process::Signal;
use serde_json::Value;

/// Opcode of a message index.
const MESSAGE_INDEX: u8 = 7;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Returns the path of a recording with a damaged part in the middle, and its bytes.
fn damaged(sandbox: &Sandbox) -> (String, Vec<u8>) {
    let whole = sandbox.path("whole.mcap");
    recorder(sandbox, &["simulate", "curtain", "--steps", "2400", "-o", &whole]).success();
    let mut bytes = fs::read(&whole).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 5000].fill(0);
    let path = sandbox.path("damaged.mcap");
    fs::write(&path, &bytes).unwrap();
    (path, bytes)
}

#[test]
fn a_damaged_recording_is_found_repaired_and_verified() {
    let sandbox = Sandbox::new();
    let (damaged, bytes) = damaged(&sandbox);
    let repaired = sandbox.path("repaired.mcap");
    let found = recorder(&sandbox, &["check", &damaged]);
    assert_eq!(found.code, Some(3), "{}{}", found.stdout, found.stderr);
    assert!(found.stdout.contains(&format!("cure: recorder repair {damaged} OUT.mcap")));
    let report = recorder(&sandbox, &["repair", &damaged, &repaired, "--json"]);
    assert_eq!(report.code, Some(3), "{}{}", report.stdout, report.stderr);
    let report: Value = serde_json::from_str(&report.stdout).unwrap();
    assert_eq!((&report["is_lossless"], &report["steps"][1]), (&false.into(), &2400.into()));
    assert_eq!(report["lost_steps"].as_array().map(Vec::len), Some(1), "{report}");
    assert_eq!(fs::read(&damaged).unwrap(), bytes, "the input is never changed");
    let checked = recorder(&sandbox, &["check", &repaired]);
    assert!(checked.success().contains("the file declares"));
    let verified: Value =
        serde_json::from_str(&recorder(&sandbox, &["verify", &repaired, "--json"]).stdout).unwrap();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    assert_eq!(verified["lost"]["/particles"], report["lost"]["/particles"]);
    assert_eq!(verified["last_identical_step"], 2400);
    let played = recorder(&sandbox, &["play", &repaired, "--rate", "max"]);
    let lacks = format!("{repaired} lacks {} snapshots between", report["lost"]["/particles"]);
    assert!(played.code == Some(0) && played.stderr.contains(&lacks), "{}", played.stderr);
}

/// Of a record that is not readable, nobody knows what it was.
#[test]
fn a_lost_part_without_a_known_message_is_named() {
    let sandbox = Sandbox::new();
    let path = sandbox.path("whole.mcap");
    recorder(&sandbox, &["simulate", "curtain", "--steps", "480", "-o", &path]).success();
    let mut bytes = fs::read(&path).unwrap();
    // The records are an opcode, a length of 8 bytes, and as many bytes.
    let mut place = 8;
    while bytes[place] != MESSAGE_INDEX {
        let length = u64::from_le_bytes(bytes[place + 1..place + 9].try_into().unwrap());
        place += 9 + usize::try_from(length).unwrap();
    }
    bytes[place] = 0;
    let damaged = sandbox.path("damaged.mcap");
    fs::write(&damaged, bytes).unwrap();
    let repaired = recorder(&sandbox, &["repair", &damaged, &sandbox.path("repaired.mcap")]);
    assert_eq!(repaired.code, Some(3), "{}{}", repaired.stdout, repaired.stderr);
    let end = "\nmissing     the damaged part, whose content is unknown\n";
    assert!(repaired.stdout.ends_with(end), "{}", repaired.stdout);
}

#[test]
fn a_repair_replaces_no_file_and_leaves_no_part_of_one() {
    let sandbox = Sandbox::new();
    let (damaged, bytes) = damaged(&sandbox);
    let taken = sandbox.write("taken.mcap", "mine");
    for (output, word) in [(&taken, "exists"), (&damaged, "this is the input")] {
        let refused = recorder(&sandbox, &["repair", &damaged, output]);
        assert_eq!(refused.code, Some(1), "{}{}", refused.stdout, refused.stderr);
        assert!(refused.stderr.contains(word), "{}", refused.stderr);
    }
    let part = sandbox.path("run.mcap.part");
    fs::rename(&damaged, &part).unwrap();
    let refused = recorder(&sandbox, &["repair", &part, &sandbox.path("run.mcap"), "--overwrite"]);
    assert!(refused.stderr.contains("choose another name"), "{}", refused.stderr);
    assert_eq!(fs::read(&part).unwrap(), bytes);
    let text = sandbox.write("text.mcap", "no recording");
    let output = sandbox.path("new.mcap");
    assert_eq!(recorder(&sandbox, &["repair", &text, &output]).code, Some(1));
    assert!(!fs::exists(format!("{output}.part")).unwrap());
    assert_eq!(recorder(&sandbox, &["repair", &part, &taken, "--overwrite"]).code, Some(3));
    assert_ne!(fs::read(&taken).unwrap(), b"mine");
}

#[test]
fn the_file_of_a_killed_recorder_is_repaired_and_that_of_a_running_one_is_being_written() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let file = sandbox.path("run.mcap");
    let part = format!("{file}.part");
    let recording = record(&sandbox, &file);
    // The header of the file is on the disk after the first flush.
    wait_for("the header of the file", || {
        (recorder(&sandbox, &["info", &part]).code == Some(3)).then_some(())
    });
    let running = recorder(&sandbox, &["info", &part]);
    assert!(running.stderr.contains("is being written by another program"), "{}", running.stderr);
    recording.signal(Signal::KILL);
    recording.wait();
    let killed = recorder(&sandbox, &["info", &part]);
    let command = format!("`recorder repair {part} OUT.mcap`");
    assert!(killed.stderr.contains(&command), "{}", killed.stderr);
    let repaired = sandbox.path("repaired.mcap");
    let report = recorder(&sandbox, &["repair", &part, &repaired]);
    assert!(matches!(report.code, Some(0 | 3)), "{}{}", report.stdout, report.stderr);
    recorder(&sandbox, &["check", &repaired]).success();
}

#[test]
fn programs_that_read_up_to_the_damage_name_what_is_lost_and_where() {
    let sandbox = Sandbox::new();
    let [whole, damaged, output] =
        ["whole", "damaged", "output"].map(|name| sandbox.path(&format!("{name}.mcap")));
    let args = ["simulate", "curtain", "--steps", "1200", "--compression", "none", "-o", &whole];
    recorder(&sandbox, &args).success();
    let mut bytes = fs::read(&whole).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&damaged, &bytes).unwrap();
    let report = recorder(&sandbox, &["repair", &damaged, &output]);
    let missing = report.stdout.lines().filter_map(|line| line.strip_prefix("missing     "));
    let missing: Vec<_> = missing.map(|what| format!("  missing: {what}")).collect();
    assert!(missing[0].starts_with("  missing: steps "), "{}", report.stdout);
    let check = recorder(&sandbox, &["check", &damaged]);
    let place = check.stdout.lines().find(|line| line.starts_with("  byte ")).unwrap().to_owned();
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
    let restored = recorder(&sandbox, &["restore", &damaged]);
    drop(node);
    let overwritten = ["simulate", &damaged, "-o", &output, "--overwrite"];
    let played = ["play", &damaged, "--rate", "max"];
    let ends = [&["diff", &whole, &damaged][..], &overwritten, &played].map(|args| {
        let read = recorder(&sandbox, args);
        assert_eq!(read.code, Some(3), "{args:?} {read:?}");
        read
    });
    for read in [restored].into_iter().chain(ends) {
        for line in missing.iter().chain([&place]) {
            assert!(read.stderr.lines().any(|one| one == line), "{line}: {}", read.stderr);
        }
    }
}

#[test]
fn programs_that_need_the_first_chunk_name_the_repair_of_a_file_that_has_lost_it() {
    let sandbox = Sandbox::new();
    let [whole, damaged, output] =
        ["whole", "damaged", "output"].map(|name| sandbox.path(&format!("{name}.mcap")));
    recorder(&sandbox, &["simulate", "curtain", "--steps", "800", "-o", &whole]).success();
    let mut bytes = fs::read(&whole).unwrap();
    // The chunks begin after the scene.
    bytes[20_000] ^= 1;
    fs::write(&damaged, &bytes).unwrap();
    let cure = format!("`recorder repair {damaged} OUT.mcap` copies what is intact");
    for args in [
        &["play", &damaged][..],
        &["diff", &whole, &damaged],
        &["diff", &damaged, &whole],
        &["simulate", &damaged, "-o", &output],
        &["restore", &damaged],
    ] {
        let node = (args[0] == "restore").then(|| {
            Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"])
        });
        let refused = recorder(&sandbox, args);
        drop(node);
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(3), ""), "{args:?} {refused:?}");
        assert!(refused.stderr.contains(&cure), "{args:?} {}", refused.stderr);
    }
    let args = ["--replay", &damaged, "--listen", "127.0.0.1:0"];
    let refused = Process::run(Program::ViewerBridge, &sandbox, &args);
    // It has no exit code of its own for damage.
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains(&cure), "{}", refused.stderr);
}

/// Damages the first chunk, one in the middle, and a length, behind which no record begins where one should.
#[test]
fn readers_see_of_a_damaged_file_what_its_repair_saves() {
    let sandbox = Sandbox::new();
    let [whole, damaged, repaired] =
        ["whole", "damaged", "repaired"].map(|name| sandbox.path(&format!("{name}.mcap")));
    let cuts = r#"{"step":2,"kind":"cut","constraint":7}"#.to_owned()
        + "\n"
        + r#"{"step":700,"kind":"cut","constraint":99}"#;
    let cuts = sandbox.write("cuts.jsonl", &cuts);
    let args = ["simulate", "curtain", "--steps", "800", "--commands", &cuts, "-o", &whole];
    recorder(&sandbox, &args).success();
    let bytes = fs::read(&whole).unwrap();
    let middle = bytes.len() / 2;
    let index = (middle..bytes.len()).find(|at| is_message_index(&bytes[*at..])).unwrap();
    // The chunks begin after the scene.
    for (place, change) in [(20_000, 1), (middle, 1), (index + 6, 0x80)] {
        let mut bytes = bytes.clone();
        bytes[place] ^= change;
        fs::write(&damaged, &bytes).unwrap();
        assert_reads_what_a_repair_saves(&sandbox, &damaged, &repaired);
    }
}

/// Returns `true` if the record of a message index with a few entries begins here.
fn is_message_index(bytes: &[u8]) -> bool {
    bytes[0] == MESSAGE_INDEX && bytes[2] < 8 && bytes[3..9] == [0; 6]
}

fn assert_reads_what_a_repair_saves(sandbox: &Sandbox, damaged: &str, repaired: &str) {
    recorder(sandbox, &["repair", damaged, repaired, "--overwrite"]);
    let info = |file| -> Value {
        serde_json::from_str(&recorder(sandbox, &["info", file, "--json"]).recorded()).unwrap()
    };
    let (found, expected) = (info(damaged), info(repaired));
    assert_eq!((&expected["last_step"], &found["last_step"]), (&800.into(), &800.into()));
    for key in ["first_step", "lost", "last_state_hash", "messages"] {
        assert!(!expected[key].is_null(), "{key} {expected}");
        assert_eq!(found[key], expected[key], "{key} {found}");
    }
    let end = found["file_end"].as_str().unwrap();
    assert!(end.starts_with("damaged after") || end.starts_with("truncated after"), "{end}");
    let verify = |file| {
        let verified = recorder(sandbox, &["verify", file, "--json"]);
        (verified.code, serde_json::from_str::<Value>(&verified.stdout).unwrap())
    };
    let ((code, found), (_, expected)) = (verify(damaged), verify(repaired));
    assert_eq!((code, &found["file_end"]), (Some(3), &end.into()));
    for key in ["verdict", "first_step", "last_identical_step", "steps_identical", "gaps", "lost"] {
        assert_eq!(found[key], expected[key], "{key} {found}");
    }
    let export = |file: &str| {
        let table = sandbox.path("table.csv");
        let exported = recorder(sandbox, &["export", file, "--csv", &table, "--overwrite"]);
        (exported.code, fs::read_to_string(&table).unwrap())
    };
    assert_eq!(export(damaged), (Some(3), export(repaired).1));
}

#[test]
fn a_damaged_header_is_written_anew() {
    let sandbox = Sandbox::new();
    let [whole, damaged, repaired] =
        ["whole", "damaged", "repaired"].map(|name| sandbox.path(&format!("{name}.mcap")));
    recorder(&sandbox, &["simulate", "curtain", "--steps", "10", "-o", &whole]).success();
    let mut bytes = fs::read(&whole).unwrap();
    let library = bytes.windows(9).position(|text| text == b"recorder/").unwrap();
    bytes[library + 2] ^= 1;
    fs::write(&damaged, &bytes).unwrap();
    let report = recorder(&sandbox, &["repair", &damaged, &repaired]);
    assert!(report.stdout.contains("header: its library is 'rebord"), "{report:?}");
    recorder(&sandbox, &["check", &repaired]).success();
    recorder(&sandbox, &["verify", &repaired]).success();
}

#[test]
fn bytes_after_the_end_are_reported_and_are_a_loss_if_messages_are_in_them() {
    let sandbox = Sandbox::new();
    let [one, two, both, repaired] =
        ["one", "two", "both", "repaired"].map(|name| sandbox.path(&format!("{name}.mcap")));
    recorder(&sandbox, &["simulate", "curtain", "--steps", "20", "-o", &one]).success();
    recorder(&sandbox, &["simulate", "rope", "--steps", "30", "-o", &two]).success();
    let message_count =
        recorder(&sandbox, &["check", "--json", &two]).json()["message_count"].as_u64().unwrap();
    let (first, second) = (fs::read(&one).unwrap(), fs::read(&two).unwrap());
    let files = |count: u64| [&first[..], &second.repeat(usize::try_from(count).unwrap())].concat();
    let noise = [&first[..], &[7; 1000]].concat();
    for (bytes, code, messages) in
        [(files(1), 3, message_count), (files(2), 3, 2 * message_count), (noise, 0, 0)]
    {
        fs::write(&both, &bytes).unwrap();
        let repair = ["repair", &both, &repaired, "--json", "--overwrite"];
        let report = recorder(&sandbox, &repair);
        assert_eq!(report.code, Some(code), "{report:?}");
        let report: Value = serde_json::from_str(&report.stdout).unwrap();
        let after_end = &report["after_end"];
        assert_eq!(after_end["byte"], first.len(), "{report}");
        assert_eq!(after_end["size_bytes"], bytes.len() - first.len(), "{report}");
        assert_eq!(after_end["message_count"], messages, "{report}");
        assert_eq!(report["is_lossless"], messages == 0, "{report}");
        recorder(&sandbox, &["verify", &repaired]).success();
    }
    let text = recorder(&sandbox, &["repair", &both, &repaired, "--overwrite"]).success();
    assert!(text.contains("after end   1000 bytes with 0 messages"), "{text}");
}

#[test]
fn a_check_of_several_files_reports_each_and_ends_with_the_worst() {
    let sandbox = Sandbox::new();
    let (damaged, _) = damaged(&sandbox);
    let (whole, text) = (sandbox.path("whole.mcap"), sandbox.write("text.mcap", "no recording"));
    recorder(&sandbox, &["check", &whole]).success();
    let both = recorder(&sandbox, &["check", "--json", &damaged, &whole]);
    assert_eq!(both.code, Some(3));
    let reports: Vec<Value> =
        both.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(
        reports.iter().map(|one| one["is_sound"] == true).collect::<Vec<_>>(),
        [false, true]
    );
    assert!(reports[0]["findings"][0]["byte"].is_u64(), "{}", reports[0]);
    let all = recorder(&sandbox, &["check", &text, &whole]);
    assert_eq!(all.code, Some(1));
    assert!(
        all.stdout.contains("sound") && all.stderr.contains(&text),
        "{}{}",
        all.stdout,
        all.stderr
    );
}

#[test]
fn a_repaired_simulation_without_its_last_commands_is_verified_up_to_its_end() {
    let sandbox = Sandbox::new();
    let commands = r#"{"step":990,"kind":"cut","constraint":7}"#;
    let (commands, whole) = (sandbox.write("cut.jsonl", commands), sandbox.path("whole.mcap"));
    let args = ["simulate", "curtain", "--steps", "1000", "--commands", &commands, "-o", &whole];
    recorder(&sandbox, &args).success();
    let mut bytes = fs::read(&whole).unwrap();
    // The metadata at the end follow the last chunk and its message indexes.
    let end = bytes.windows(11).rposition(|text| text == b"stop_reason").unwrap();
    bytes[end - 25_000] ^= 1;
    let (damaged, repaired) = (sandbox.path("damaged.mcap"), sandbox.path("repaired.mcap"));
    fs::write(&damaged, &bytes).unwrap();
    let report = recorder(&sandbox, &["repair", &damaged, &repaired, "--json"]);
    let report: Value = serde_json::from_str(&report.stdout).unwrap();
    assert_eq!(report["lost"]["/outcomes"], 1, "{report}");
    let verified = recorder(&sandbox, &["verify", &repaired]).success();
    assert!(verified.contains("steps bit-identical (0..="), "{verified}");
    assert!(verified.contains("missing: /outcomes 1"), "{verified}");
}

#[test]
fn a_lost_first_chunk_costs_its_messages_but_not_the_constraints() {
    let sandbox = Sandbox::new();
    // Some constraints tear in the first chunk, and others at all later times.
    let cuts: Vec<_> = (0_u64..40)
        .map(|cut| {
            let (step, constraint) = (3 + cut * 20, cut * 11);
            format!(r#"{{"step":{step},"kind":"cut","constraint":{constraint}}}"#)
        })
        .collect();
    let commands = sandbox.write("cuts.jsonl", &cuts.join("\n"));
    let [whole, damaged, repaired] =
        ["whole", "damaged", "repaired"].map(|name| sandbox.path(&format!("{name}.mcap")));
    let args = ["simulate", "curtain", "--steps", "800", "--commands", &commands, "-o", &whole];
    recorder(&sandbox, &args).success();
    let mut bytes = fs::read(&whole).unwrap();
    // The chunks begin after the scene.
    bytes[20_000] ^= 1;
    fs::write(&damaged, &bytes).unwrap();
    let report = recorder(&sandbox, &["repair", &damaged, &repaired, "--json"]);
    assert_eq!(report.code, Some(3), "{}{}", report.stdout, report.stderr);
    let report: Value = serde_json::from_str(&report.stdout).unwrap();
    assert_eq!(report["restored"][0], "/topology", "{report}");
    assert!(report["lost"]["/topology"].is_null() && report["lost"]["/outcomes"].is_u64());
    // The hash of each snapshot has the torn constraints, and the simulation compares the first list.
    recorder(&sandbox, &["check", &repaired]).success();
    let verified = recorder(&sandbox, &["verify", &repaired, "--json"]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    assert_eq!(verified["last_identical_step"], 800, "{verified}");
    let info = recorder(&sandbox, &["info", &repaired, "--json"]).recorded();
    let info: Value = serde_json::from_str(&info).unwrap();
    assert_eq!(info["torn_count_first"], report["lost"]["/tears"], "{info}");
    // It plays, which needs the constraints and triangles.
    recorder(&sandbox, &["play", &repaired, "--rate", "100"]).recorded();
}
