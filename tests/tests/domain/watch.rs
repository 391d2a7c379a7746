//! `sim-node ctl watch` prints the state of a node over time, through ends, kills and stops of the node.

use integration_tests::{Process, Program, Sandbox, Signal, Stream, Streams, ctl};
use serde_json::Value;

fn node(sandbox: &Sandbox) -> Process {
    Process::start_ready(Program::SimNode, sandbox, &["run", "rope"])
}

fn watch(sandbox: &Sandbox, args: &[&str]) -> Process {
    let args = [&["ctl", "watch", "--period", "100ms"], args].concat();
    Process::start(Program::SimNode, sandbox, &args)
}

fn parse(lines: &[String]) -> Vec<Value> {
    lines.iter().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn lines_appear_one_by_one_and_have_the_fields_of_the_status() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox);
    let mut watching = watch(&sandbox, &["--json"]);
    let rows = parse(&watching.wait_for_output(3));
    let status = ctl(&sandbox, &["status"]);
    let fields = |row: &Value| row.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
    assert!(rows.iter().all(|row| fields(row) == fields(&status)), "{rows:?}");
    let steps: Vec<_> = rows.iter().map(|row| row["step"].as_u64().unwrap()).collect();
    assert!(steps.is_sorted() && steps[0] < steps[steps.len() - 1], "{steps:?}");
    for signal in [Signal::INT, Signal::TERM] {
        watching.signal(signal);
        let ended = watching.wait();
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""), "{signal:?}");
        watching = watch(&sandbox, &[]);
        watching.wait_for_output(1);
    }
}

#[test]
fn it_ends_after_the_last_line_or_with_its_reader() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox);
    let counted = watch(&sandbox, &["--count", "3"]).wait().success();
    let lines: Vec<_> = counted.lines().collect();
    assert_eq!(lines.len(), 4, "{counted}");
    assert!(lines[0].trim_start().starts_with("step "), "{counted}");
    assert!(lines[1..].iter().all(|line| line.ends_with("rope")), "{counted}");
    let streams = Streams { stdout: Stream::ClosedPipe, ..Streams::default() };
    for args in [&["ctl", "watch"][..], &["ctl", "watch", "--json"]] {
        let ended = Process::start_with(streams, Program::SimNode, &sandbox, args).wait();
        assert_eq!((ended.code, ended.stderr.as_str()), (Some(0), ""));
    }
    let full = Streams { stdout: Stream::Full, ..Streams::default() };
    let lost = Process::start_with(full, Program::SimNode, &sandbox, &["ctl", "watch"]).wait();
    assert_eq!(lost.code, Some(1));
    assert!(lost.stderr.contains("cannot write to stdout"), "{}", lost.stderr);
}

#[test]
fn it_goes_on_with_the_next_node_after_one_was_killed_or_has_ended() {
    let sandbox = Sandbox::new();
    let mut first = node(&sandbox);
    let mut watching = watch(&sandbox, &["--json"]);
    watching.wait_for_output(1);
    let killed = format!("note: {} was killed; waiting", sandbox.endpoint());
    let ended = format!("note: {} has ended; waiting", sandbox.endpoint());
    for (is_killed, note) in [(true, killed), (false, ended)] {
        if is_killed {
            first.signal(Signal::KILL);
            first.wait();
        } else {
            assert_eq!(first.interrupt().code, Some(0));
        }
        watching.wait_for_line(&note);
        first = node(&sandbox);
        let run_id = ctl(&sandbox, &["status"])["run_id"].clone();
        watching.wait_for_line(&format!("note: a new run: {}", run_id.as_str().unwrap()));
        let before = watching.wait_for_output(1).len();
        let rows = parse(&watching.wait_for_output(before + 1));
        assert_eq!(rows[before]["run_id"], run_id);
    }
    assert_eq!(watching.interrupt().code, Some(0));
    // A signal ends the wait for a node, too.
    let mut waiting = watch(&sandbox, &[]);
    waiting.wait_for_output(1);
    assert_eq!(first.interrupt().code, Some(0));
    waiting.wait_for_line("note: ");
    assert_eq!(waiting.interrupt().code, Some(0));
}

#[test]
fn it_says_that_a_node_is_stopped_and_goes_on_after_it() {
    let sandbox = Sandbox::new();
    let stopped = node(&sandbox);
    let mut watching = watch(&sandbox, &["--json"]);
    watching.wait_for_output(1);
    stopped.signal(Signal::STOP);
    let note = watching.wait_for_line("note: ");
    assert!(note.ends_with("has published no status (is it stopped, or busy with a long step?)"));
    let before = watching.wait_for_output(1).len();
    stopped.signal(Signal::CONT);
    watching.wait_for_output(before + 2);
    assert_eq!(watching.interrupt().stderr, format!("{note}\n"));
}

#[test]
fn it_needs_a_node_at_the_start_and_plausible_options() {
    let sandbox = Sandbox::new();
    let without = watch(&sandbox, &[]).wait();
    let status = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]);
    assert_eq!((without.code, without.stderr), (Some(1), status.stderr));
    for (option, value, allowed) in [
        ("--period", "99ms", "a time from 100ms to 1h"),
        ("--period", "0s", "a time from 100ms to 1h"),
        ("--period", "2h", "a time from 100ms to 1h"),
        ("--period", "1", "a time with its unit"),
        ("--count", "0", "a whole number from 1"),
        ("--count", "-1", "a whole number from 1"),
    ] {
        let refused = Process::run(Program::SimNode, &sandbox, &["ctl", "watch", option, value]);
        assert_eq!(refused.code, Some(2), "{option} {value}");
        assert!(refused.stderr.contains(allowed), "{}", refused.stderr);
    }
}
