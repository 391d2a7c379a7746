//! Black boxes: recorders that keep the last seconds in memory, and write them after an event.

use std::path::Path;

use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, Signal, ctl, wait_for};
use serde_json::{Value, json};
use sim_contract::Client;

use super::{assert_verifies, node, numbered, outcomes, recorder, steps};

/// Starts a black box, and waits until it keeps a state.
fn black_box(sandbox: &Sandbox, args: &[&str]) -> Process {
    let output = sandbox.path("run.mcap");
    let args: Vec<_> = ["record", "--json", "--black-box", "30s", "-o", &output]
        .into_iter()
        .chain(args.iter().copied())
        .collect();
    Process::start_ready(Program::Recorder, sandbox, &args)
}

fn wait_for_file(path: &str) {
    wait_for(path, || Path::new(path).exists().then_some(()));
}

/// Waits until the node has made this number of further steps.
fn wait_for_steps(client: &mut Client, count: u64) {
    let step = |client: &mut Client| {
        client.latest_snapshot(DEADLINE).unwrap().map(|snapshot| snapshot.header().step)
    };
    let first = wait_for("a step", || step(client));
    wait_for("the steps", || step(client).filter(|now| *now >= first + count));
}

fn stop_reason(sandbox: &Sandbox, file: &str) -> String {
    recorder(sandbox, &["info", "--json", file]).json()["stop_reason"].as_str().unwrap().to_owned()
}

fn finish(recording: Process) -> Value {
    serde_json::from_str(&recording.interrupt().recorded()).unwrap()
}

#[test]
fn each_event_writes_what_came_before_it_into_a_file_of_its_own() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    let recording = black_box(&sandbox, &[]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    wait_for_steps(&mut client, 300);
    let mark = ctl(&sandbox, &["mark", "the sleeve slips"]);
    wait_for_file(&numbered(&sandbox, 0));
    wait_for_steps(&mut client, 300);
    let tear = ctl(&sandbox, &["cut", "17"]);
    wait_for_file(&numbered(&sandbox, 1));
    wait_for_steps(&mut client, 300);
    recording.signal(Signal::USR1);
    wait_for_file(&numbered(&sandbox, 2));
    let report = finish(recording);
    assert_eq!(report["files"], json!(3), "{report}");

    let files: Vec<_> = (0..3).map(|number| numbered(&sandbox, number)).collect();
    for file in &files {
        assert_verifies(&sandbox, file);
        recorder(&sandbox, &["check", file]).success();
    }
    // The kept time is long enough for all, so the files follow each other. What a busy machine has lost is
    // declared.
    let all: Vec<_> = files.iter().flat_map(|file| steps(file)).collect();
    assert!(all.is_sorted_by(|one, next| one < next));
    let span = all[all.len() - 1] - all[0] + 1;
    let lost = report["lost"]["/steps"].as_u64().unwrap_or(0);
    assert_eq!(all.len() as u64 + lost, span, "{report}");
    let contains = |file: &String, step: &Value| steps(file).contains(&step.as_u64().unwrap());
    assert!(contains(&files[0], &mark["step"]) && contains(&files[1], &tear["step"]));
    assert_eq!(outcomes(&files[0]).len(), 1);
    let reasons: Vec<_> = files.iter().map(|file| stop_reason(&sandbox, file)).collect();
    let expected = [
        format!("mark 'the sleeve slips' at step {}", mark["step"]),
        format!("tear at step {}", tear["step"]),
        "SIGUSR1".to_owned(),
    ];
    assert_eq!(reasons, expected);
}

#[test]
fn a_black_box_of_a_paused_node_is_written_at_once_and_goes_on_after_the_pause() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let recording = black_box(&sandbox, &[]);
    ctl(&sandbox, &["step", "10"]);
    for (number, count) in [(0, "7"), (1, "9")] {
        ctl(&sandbox, &["mark", "now"]);
        wait_for_file(&numbered(&sandbox, number));
        ctl(&sandbox, &["pin", "3"]);
        ctl(&sandbox, &["step", count]);
    }
    let report = finish(recording);
    assert_eq!((&report["files"], &report["lost"]), (&json!(2), &json!({})), "{report}");
    let files = [numbered(&sandbox, 0), numbered(&sandbox, 1)];
    for file in &files {
        assert_verifies(&sandbox, file);
        recorder(&sandbox, &["check", file]).success();
    }
    assert_eq!(steps(&files[1]), (11..=17).collect::<Vec<_>>());
    assert_eq!(steps(&files[0]).last(), Some(&10));
}

#[test]
fn a_load_ends_a_file_and_without_an_event_drops_what_was_before_it() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "rope", "--paused"]);
    let recording = black_box(&sandbox, &[]);
    ctl(&sandbox, &["step", "10"]);
    // A load ends what can be in one file. Without an event, what came before it is dropped.
    ctl(&sandbox, &["load", "pendulum"]);
    ctl(&sandbox, &["step", "10"]);
    ctl(&sandbox, &["mark", "before the load"]);
    ctl(&sandbox, &["load", "rope"]);
    ctl(&sandbox, &["step", "10"]);
    wait_for_file(&numbered(&sandbox, 0));
    let report = finish(recording);
    assert_eq!((&report["files"], &report["lost"]), (&json!(1), &json!({})), "{report}");
    assert_verifies(&sandbox, &numbered(&sandbox, 0));
    assert_eq!(steps(&numbered(&sandbox, 0)).first(), Some(&11));
}

#[test]
fn the_time_of_a_black_box_has_a_unit_as_every_time() {
    let sandbox = Sandbox::new();
    for option in ["--black-box", "--duration", "--split-duration", "--flush-interval"] {
        let args = ["record", option, "30"];
        let refused = Process::run(Program::Recorder, &sandbox, &args);
        assert_eq!(refused.code, Some(2), "{refused:?}");
        let cure = "it must be a time with its unit, such as 2s or 500ms";
        assert!(refused.stderr.contains(cure), "{refused:?}");
    }
}

#[test]
fn a_black_box_without_an_event_writes_nothing() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    let recording = black_box(&sandbox, &[]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    wait_for_steps(&mut client, 300);
    let report = finish(recording);
    assert_eq!((&report["files"], &report["output"]), (&json!(0), &json!(null)), "{report}");
    let folder = std::fs::read_dir(Path::new(&sandbox.path("run.mcap")).parent().unwrap()).unwrap();
    let left: Vec<_> = folder.map(|entry| entry.unwrap().file_name()).collect();
    assert!(!left.iter().any(|name| name.to_string_lossy().starts_with("run")), "{left:?}");
}

#[test]
fn a_killed_black_box_leaves_a_file_that_can_be_repaired() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--as-fast-as-possible"]);
    for round in 0..4 {
        let mut recording = black_box(&sandbox, &["--overwrite", "--compression", "none"]);
        let mut client = Client::attach(&sandbox.endpoint()).unwrap();
        wait_for_steps(&mut client, 5000);
        recording.signal(Signal::USR1);
        let part = numbered(&sandbox, 0) + ".part";
        let whole = numbered(&sandbox, 0);
        // Each round kills it a chunk of 1 MiB later, and at least one is whole.
        let least = (2 + round) << 20;
        wait_for("the begin of the file", || {
            let size = std::fs::metadata(&part).map_or(0, |file| file.len());
            (size >= least || Path::new(&whole).exists()).then_some(())
        });
        if recording.is_running() {
            recording.signal(Signal::KILL);
        }
        recording.wait();
        let left = if Path::new(&part).exists() { part } else { whole };
        let repaired = sandbox.path("repaired.mcap");
        let finished: Finished = recorder(&sandbox, &["repair", &left, &repaired, "--overwrite"]);
        assert!(matches!(finished.code, Some(0 | 3)), "{finished:?}");
        let checked = recorder(&sandbox, &["check", &repaired]);
        assert!(matches!(checked.code, Some(0 | 3)), "{checked:?}");
        assert!(!steps(&repaired).is_empty());
        assert_verifies(&sandbox, &repaired);
        std::fs::remove_file(&left).unwrap();
    }
}

#[test]
fn a_full_black_box_keeps_what_comes_before_an_event_and_ends_the_file_early() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    // About 190 steps.
    let recording = black_box(&sandbox, &["--queue-bytes", "1048576"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    wait_for_steps(&mut client, 600);
    for number in 0..3 {
        let mark = ctl(&sandbox, &["mark", "now"])["step"].as_u64().unwrap();
        let file = numbered(&sandbox, number);
        wait_for_file(&file);
        let steps = steps(&file);
        assert!(steps[0] < mark && steps.contains(&mark), "{mark} in {}..", steps[0]);
        assert_eq!(outcomes(&file).len(), 1);
        wait_for_steps(&mut client, 300);
    }
    finish(recording);
}

#[test]
fn a_black_box_numbers_its_files_after_those_of_an_earlier_one() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    for number in 0..2 {
        let recording = black_box(&sandbox, &[]);
        ctl(&sandbox, &["step", "3"]);
        ctl(&sandbox, &["mark", "now"]);
        wait_for_file(&numbered(&sandbox, number));
        recording.signal(Signal::KILL);
        recording.wait();
    }
}
