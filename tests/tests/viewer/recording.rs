//! Recordings that pages start: their progress, their end however the programs end, their failures, and
//! the pages that show them.

use std::fs;
use std::path::Path;

use integration_tests::{Process, Program, Sandbox, Signal, wait_for};
use serde_json::{Value, json};

use super::page::{Bridge, Page};

fn start_node(sandbox: &Sandbox) -> Process {
    Process::start_ready(Program::SimNode, sandbox, &["run", "curtain"])
}

/// Starts a bridge whose pages record into the folder "runs" of the sandbox.
fn start_bridge(sandbox: &Sandbox) -> Bridge {
    Bridge::start_with(sandbox, &["--recordings", &sandbox.path("runs")])
}

/// Waits for a state of the recording that matches.
fn state(page: &mut Page, matches: impl Fn(&Value) -> bool) -> Value {
    page.text(|text| text["type"] == "recording" && matches(text))
}

fn in_state(page: &mut Page, name: &str) -> Value {
    state(page, |text| text["state"] == name)
}

/// Starts a recording, and waits until it has snapshots and a size. Returns the path of its file.
fn record(page: &mut Page) -> String {
    page.text_with("node", "state", &json!("alive"));
    let answer = page.command(json!({ "kind": "record" }));
    assert_eq!(answer["status"], "applied", "{answer}");
    let number = |text: &Value, field: &str| text[field].as_f64().unwrap();
    let shown =
        state(page, |text| number(text, "snapshots") > 0.0 && number(text, "size_bytes") > 0.0);
    assert!(number(&shown, "seconds") > 0.0 && shown["lost"].is_object(), "{shown}");
    shown["path"].as_str().unwrap().to_owned()
}

/// Checks a recording against its own simulation.
fn verify(sandbox: &Sandbox, path: &str) {
    let verified = Process::run(Program::Recorder, sandbox, &["verify", path]).success();
    assert!(verified.contains("bit-identical"), "{verified}");
}

fn stop_reason(sandbox: &Sandbox, path: &str) -> Value {
    Process::run(Program::Recorder, sandbox, &["info", path, "--json"]).json()["stop_reason"].take()
}

#[test]
fn a_recording_of_a_page_is_shown_to_all_pages_verifies_and_opens_in_a_page_of_its_own() {
    let sandbox = Sandbox::new();
    let _node = start_node(&sandbox);
    let bridge = start_bridge(&sandbox);
    let (mut page, mut other) = (bridge.page(), bridge.page());
    in_state(&mut page, "idle");
    assert_eq!(page.rejected(json!({ "kind": "stop_recording" })), "not_recording");
    let path = record(&mut page);
    in_state(&mut other, "recording");
    assert_eq!(other.rejected(json!({ "kind": "record" })), "already_recording");
    // Any page can end it.
    other.send(&json!({ "kind": "stop_recording" }));
    let ended = in_state(&mut page, "finished");
    assert_eq!((&ended["text"], &ended["path"]), (&json!(""), &json!(path)));
    assert_eq!(ended["size_bytes"], fs::metadata(&path).unwrap().len());
    assert_eq!(Path::new(&path).parent().unwrap(), Path::new(&sandbox.path("runs")));
    verify(&sandbox, &path);

    let socket = format!("/replay/{}/socket", ended["name"].as_str().unwrap());
    let mut replay = bridge.page_at(&socket);
    assert_eq!(replay.hello["mode"], "replay");
    assert_eq!(replay.scene().text.name, "curtain");
    let timeline = bridge.page_at(&socket).text(|text| text["type"] == "timeline");
    replay.frame_after(json!({ "kind": "seek", "step": timeline["last_step"] }), |frame| {
        timeline["last_step"] == frame.head.stamp.step
    });
    assert_eq!(replay.rejected(json!({ "kind": "record" })), "only_live");
    // The live pages go on, and the next recording has another file.
    let shown = page.frame(|_| true).head.stamp.step;
    page.frame(|frame| frame.head.stamp.step > shown);
    let answer = page.command(json!({ "kind": "record" }));
    assert_eq!(answer["status"], "applied");
    let next = state(&mut page, |text| text["snapshots"].as_u64() > Some(0));
    assert_ne!(next["path"], json!(path));
}

#[test]
fn a_recording_is_complete_when_the_bridge_ends_and_when_it_is_killed() {
    for (signal, reason) in
        [(Signal::TERM, "signal"), (Signal::KILL, "reader of the progress gone")]
    {
        let sandbox = Sandbox::new();
        let _node = start_node(&sandbox);
        let bridge = start_bridge(&sandbox);
        let path = record(&mut bridge.page());
        bridge.process.signal(signal);
        let ended = bridge.process.wait();
        if signal == Signal::TERM {
            assert_eq!(ended.code, Some(0), "{}", ended.stderr);
            assert!(Path::new(&path).exists(), "the bridge did not wait: {}", ended.stderr);
        }
        wait_for("the complete recording", || Path::new(&path).exists().then_some(()));
        assert_eq!(stop_reason(&sandbox, &path), reason);
        verify(&sandbox, &path);
    }
}

#[test]
fn ctrl_c_ends_the_recording_once_although_it_reaches_a_whole_group_of_processes() {
    let sandbox = Sandbox::new();
    let _node = start_node(&sandbox);
    let program = Program::ViewerBridge.path().display().to_string();
    let runs = sandbox.path("runs");
    // A terminal sends Ctrl-C to the group of the bridge. A second signal would end the recorder at once.
    let script = r#"set -m; trap 'kill -INT -- -$!' USR1; "$0" --listen 127.0.0.1:0 --recordings "$1" & wait; wait"#;
    let bridge = Process::start(Program::Bash, &sandbox, &["-c", script, &program, &runs]);
    let bridge = Bridge::ready(bridge);
    let path = record(&mut bridge.page());
    bridge.process.signal(Signal::USR1);
    let ended = bridge.process.wait();
    assert!(Path::new(&path).exists(), "{}", ended.stderr);
    assert_eq!(stop_reason(&sandbox, &path), "signal");
    verify(&sandbox, &path);
}

#[test]
fn a_recording_that_is_stopped_at_once_is_complete_with_and_without_a_step() {
    for args in [&["run", "curtain"][..], &["run", "curtain", "--paused"]] {
        let sandbox = Sandbox::new();
        let _node = Process::start_ready(Program::SimNode, &sandbox, args);
        let bridge = start_bridge(&sandbox);
        let mut page = bridge.page();
        page.text_with("node", "state", &json!("alive"));
        page.send(&json!({ "kind": "record" }));
        // The recorder does not handle signals yet.
        page.send(&json!({ "kind": "stop_recording" }));
        in_state(&mut page, "finishing");
        let ended = state(&mut page, |text| text["state"] != "finishing");
        assert_eq!((&ended["state"], &ended["text"]), (&json!("finished"), &json!("")), "{ended}");
        let path = ended["path"].as_str().unwrap();
        assert_eq!(stop_reason(&sandbox, path), "signal");
    }
}

#[test]
fn a_recording_ends_with_its_scene_and_with_its_node_and_says_so() {
    let sandbox = Sandbox::new();
    let node = start_node(&sandbox);
    let bridge = start_bridge(&sandbox);
    let mut page = bridge.page();
    record(&mut page);
    page.send(&json!({ "kind": "load", "scene": "flag" }));
    let ended = in_state(&mut page, "finished");
    assert_eq!(ended["text"], "the recording ended because another scene was loaded");
    // The name comes from the scene that the bridge knows.
    bridge.page().text_with("node", "scene", &json!("flag"));
    let answer = page.command(json!({ "kind": "record" }));
    assert_eq!(answer["status"], "applied", "{answer}");
    let shown = state(&mut page, |text| text["snapshots"].as_u64() > Some(0));
    assert!(shown["path"].as_str().unwrap().contains("/flag_"), "{shown}");
    node.interrupt();
    let ended = in_state(&mut page, "finished");
    assert_eq!(ended["text"], "the recording ended with the node");
    verify(&sandbox, ended["path"].as_str().unwrap());
    // A page of its own: this one may have been told before the end of the recording.
    bridge.page().text_with("node", "state", &json!("lost"));
    assert_eq!(page.rejected(json!({ "kind": "record" })), "no_node");
}

#[test]
fn a_recording_that_fails_names_the_cause_and_the_remedy() {
    let sandbox = Sandbox::new();
    let _node = start_node(&sandbox);
    // A file is in the place of the folder.
    sandbox.write("runs", "");
    let bridge = start_bridge(&sandbox);
    let mut page = bridge.page();
    page.text_with("node", "state", &json!("alive"));
    page.send(&json!({ "kind": "record" }));
    let failed = in_state(&mut page, "failed");
    let text = failed["text"].as_str().unwrap();
    assert!(
        text.starts_with("cannot create the folder ") && text.contains("--recordings DIR"),
        "{text}"
    );
    fs::remove_file(sandbox.path("runs")).unwrap();

    // A limit on the size of files stands for a full disk: the recorder inherits it.
    bridge.process.limit_file_size(200_000);
    page.send(&json!({ "kind": "record" }));
    let failed = in_state(&mut page, "failed");
    let text = failed["text"].as_str().unwrap();
    for part in
        ["what was written before is in ", ".mcap.part", "File too large", "--recordings DIR"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(failed["name"], Value::Null);
}

#[test]
fn a_bridge_without_a_recorder_says_where_it_searched() {
    let sandbox = Sandbox::new();
    let _node = start_node(&sandbox);
    let program = sandbox.path("viewer-bridge");
    fs::copy(Program::ViewerBridge.path(), &program).unwrap();
    let runs = sandbox.path("runs");
    let script = r#"PATH=/nowhere exec "$0" --listen 127.0.0.1:0 --recordings "$1""#;
    let bridge = Process::start(Program::Bash, &sandbox, &["-c", script, &program, &runs]);
    let bridge = Bridge::ready(bridge);
    let mut page = bridge.page();
    page.text_with("node", "state", &json!("alive"));
    page.send(&json!({ "kind": "record" }));
    let failed = in_state(&mut page, "failed");
    let text = failed["text"].as_str().unwrap();
    let folder = Path::new(&program).parent().unwrap().display().to_string();
    for part in ["there is no program `recorder`", &folder, "search path", "cargo build"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn other_machines_record_only_into_a_chosen_folder_and_open_only_its_recordings() {
    let sandbox = Sandbox::new();
    let _node = start_node(&sandbox);
    for (args, state_name) in [(&[][..], "unavailable"), (&["--recordings", "runs"], "idle")] {
        let args = [&["--listen", "0.0.0.0:0"], args].concat();
        let bridge = Bridge::ready(Process::start(Program::ViewerBridge, &sandbox, &args));
        let (_, token) = bridge.host.split_once("#token=").unwrap();
        let mut page = bridge.page_with("/socket", &json!({ "token": token }));
        let shown = in_state(&mut page, state_name);
        if state_name == "unavailable" {
            assert!(shown["text"].as_str().unwrap().contains("--recordings DIR"), "{shown}");
            assert_eq!(page.rejected(json!({ "kind": "record" })), "recording_not_allowed");
        }
        // The token is checked before anything is opened.
        assert_eq!(bridge.refusal_at("/replay/run/socket", &json!({})).0, 4401);
    }
    let bridge = start_bridge(&sandbox);
    sandbox.write("outside.mcap", "not a recording");
    for name in ["none", "..%2Foutside", "%2e%2e%2Foutside", "a.mcap", "%00"] {
        let (code, reason) = bridge.refusal_at(&format!("/replay/{name}/socket"), &json!({}));
        assert_eq!(code, 4404, "{name}: {reason}");
        assert!(!reason.is_empty() && !reason.contains('/'), "{name}: {reason}");
    }
}
