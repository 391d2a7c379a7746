//! No control character of a file or of another process reaches a terminal: every program escapes its
//! whole output.

use integration_tests::{Finished, Process, Program, Sandbox, ctl};
use recording::{Closing, LogOptions, LogReader, LogWriter, Message, RunDescription};

/// ESC, BEL, the one-character CSI, a change of direction, and a line that looks like a report.
const TEXT: &str = "x\u{1b}[2J\u{7}\u{9b}31m\u{202e}\nstopped     forged";
/// The same text in TOML, and in every output.
const TOML: &str = r"x\u001b[2J\u0007\u009b31m\u202e\nstopped     forged";
/// A name that a scene may have: control characters in it are refused.
const REVERSED: &str = "x\u{202e}drawkcab";
const REVERSED_TOML: &str = r"x\u202edrawkcab";

fn assert_printable(output: &str) {
    let is_control = |letter: char| letter != '\n' && letter.is_control();
    let is_direction = |letter| matches!(letter, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    assert!(!output.contains(is_control) && !output.contains(is_direction), "{output:?}");
    let is_forged = output.lines().any(|line| line == "stopped     forged");
    assert!(!is_forged, "{output:?}");
}

/// Runs a program, whose output quotes the text.
fn run(sandbox: &Sandbox, program: Program, args: &[&str]) -> Finished {
    let finished = Process::run(program, sandbox, args);
    let output = format!("{}{}", finished.stdout, finished.stderr);
    assert_printable(&output);
    let is_quoted = [TOML, REVERSED_TOML].iter().any(|text| output.contains(text));
    assert!(is_quoted, "{args:?}: {output}");
    finished
}

/// Writes a recording whose names and texts have control characters.
fn recording(sandbox: &Sandbox) -> String {
    let file = sandbox.path("plain.mcap");
    let args = ["simulate", "pendulum", "--steps", "10", "-o", &file];
    Process::run(Program::Recorder, sandbox, &args).success();
    let mut old = LogReader::open(file.as_ref()).unwrap();
    let run = RunDescription {
        scene_name: TEXT.to_owned(),
        recorder_version: TEXT.to_owned(),
        ..old.run().clone()
    };
    let scene = old.scene().to_vec();
    let mut new = LogWriter::create(Vec::new(), LogOptions::default(), &run, &scene, 0).unwrap();
    while let Some(logged) = old.next_message().unwrap() {
        new.write(&logged.message, 0).unwrap();
        if matches!(&logged.message, Message::Particles { step: 0, .. }) {
            let json = format!(
                r#"{{"step":1,"client_id":0,"sequence":0,"index":0,"kind":"pin","particle":0,"status":"applied","reason":{}}}"#,
                serde_json::to_string(TEXT).unwrap()
            );
            let row = serde_json::from_str(&json).unwrap();
            new.write(&Message::Outcome(row), 0).unwrap();
        }
    }
    let closing = Closing { stop_reason: TEXT.to_owned(), ..Closing::default() };
    let hostile = sandbox.path("hostile.mcap");
    std::fs::write(&hostile, new.finish(&closing).unwrap()).unwrap();
    hostile
}

#[test]
fn a_scene_file_cannot_control_the_terminal() {
    let sandbox = Sandbox::new();
    let named = sandbox.write("named.toml", &format!("version = 1\nname = \"{REVERSED_TOML}\"\n"));
    run(&sandbox, Program::SimNode, &["check", &named]).success();
    run(&sandbox, Program::SimNode, &["check", &named, "--json"]).success();
    let args = ["simulate", &named, "--steps", "1"];
    run(&sandbox, Program::Recorder, &args).success();
    run(&sandbox, Program::Recorder, &[&args[..], &["--json"]].concat()).success();
    let wrong = sandbox.write("wrong.toml", &format!("version = 1\n\"{TOML}\" = 3\n"));
    for (program, args) in [
        (Program::SimNode, vec!["check", &wrong]),
        (Program::SimNode, vec!["run", &wrong]),
        (Program::Recorder, vec!["simulate", &wrong, "--steps", "1"]),
    ] {
        assert_eq!(run(&sandbox, program, &args).code, Some(1));
    }
}

#[test]
fn a_node_cannot_control_the_terminal_of_ctl() {
    let sandbox = Sandbox::new();
    let named = sandbox.write("named.toml", &format!("version = 1\nname = \"{REVERSED_TOML}\"\n"));
    let args = ["run", named.as_str(), "--domain", sandbox.domain()];
    let node = Process::start_ready(Program::SimNode, &sandbox, &args);
    assert_eq!(ctl(&sandbox, &["status"])["scene"], REVERSED);
    run(&sandbox, Program::SimNode, &["ctl", "status"]).success();
    let finished = node.interrupt();
    assert_printable(&(finished.stdout + &finished.stderr));
}

#[test]
fn a_recording_cannot_control_the_terminal() {
    let sandbox = Sandbox::new();
    let file = recording(&sandbox);
    run(&sandbox, Program::Recorder, &["info", &file]).success();
    run(&sandbox, Program::Recorder, &["info", &file, "--json"]).success();
    for args in [["verify", "-v", &file], ["verify", "--json", &file]] {
        let Finished { code, stdout, stderr, .. } =
            Process::run(Program::Recorder, &sandbox, &args);
        assert_eq!(code, Some(3), "{stdout}");
        assert_printable(&(stdout + &stderr));
    }
}

#[test]
fn an_error_that_quotes_a_file_cannot_control_the_terminal() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("foreign.mcap");
    let text =
        |text: &str| [&u32::try_from(text.len()).unwrap().to_le_bytes(), text.as_bytes()].concat();
    let header = [text(""), text(TEXT)].concat();
    let size = (header.len() as u64).to_le_bytes();
    let magic = b"\x89MCAP0\r\n";
    let footer = [&[2][..], &20_u64.to_le_bytes(), &[0; 20]].concat();
    let bytes = [&magic[..], &[1], &size, &header, &footer, magic].concat();
    std::fs::write(&file, bytes).unwrap();
    for (program, args) in [
        (Program::Recorder, vec!["info", &file]),
        (Program::Recorder, vec!["play", &file]),
        (Program::ViewerBridge, vec!["--replay", &file]),
    ] {
        assert_eq!(run(&sandbox, program, &args).code, Some(1));
    }
}
