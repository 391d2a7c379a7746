//! `recorder info` on a live and on a simulated recording: its numbers follow from the recorded rows.
#![allow(clippy::unwrap_used, reason = "a panic is how a test fails")]

use std::path::Path;

use integration_tests::{Finished, Process, Program, Sandbox, ctl, record};
use recorder::{LogReader, LoggedMessage, Message, StepRow};
use serde_json::{Value, json};

/// Steps of the live recording.
const STEPS: u64 = 240;

fn recorder(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::Recorder, sandbox, args)
}

/// Records a running rope from its first step to its last.
fn live(sandbox: &Sandbox) -> String {
    let file = sandbox.path("live.mcap");
    let args = ["run", "rope", "--rate", "480", "--steps", &STEPS.to_string(), "--paused"];
    let node = Process::start_ready(Program::SimNode, sandbox, &args);
    let recording = record(sandbox, &file);
    ctl(sandbox, &["cut", "2"]);
    ctl(sandbox, &["resume"]);
    node.wait().success();
    assert_eq!(recording.wait().code, Some(0));
    file
}

fn messages(file: &str) -> Vec<LoggedMessage> {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    std::iter::from_fn(|| log.next_message().unwrap()).collect()
}

fn rows(messages: &[LoggedMessage]) -> Vec<StepRow> {
    let rows = messages.iter().filter_map(|logged| match &logged.message {
        Message::Step(row) => Some(*row),
        _ => None,
    });
    rows.collect()
}

/// Asserts that a distribution is that of these times, in ns.
fn assert_distribution(summary: &Value, mut times_ns: Vec<u64>) {
    times_ns.sort_unstable();
    let count = times_ns.len();
    for (key, rank) in [("p50_us", count.div_ceil(2)), ("p99_us", (count * 99).div_ceil(100))] {
        let (stated, expected) = (summary[key].as_f64().unwrap(), times_ns[rank - 1] as f64 / 1e3);
        assert!((stated - expected).abs() <= expected * 2e-3, "{key}: {stated}, not {expected}");
    }
    assert_eq!(summary["max_us"], json!(times_ns[count - 1] as f64 / 1e3));
    let mut binned = 0;
    for bin in summary["bins"].as_array().unwrap() {
        let from_ns = bin["from_us"].as_u64().unwrap() * 1000;
        let to_ns = bin["to_us"].as_u64().map_or(u64::MAX, |to_us| to_us * 1000);
        let within = times_ns.iter().filter(|time_ns| (from_ns..to_ns).contains(time_ns)).count();
        assert_eq!(bin["count"], within as u64, "{bin}");
        binned += within;
    }
    assert_eq!(binned, count, "{summary}");
}

#[test]
fn the_page_of_a_live_recording_agrees_with_its_rows() {
    let sandbox = Sandbox::new();
    let file = live(&sandbox);
    let messages = messages(&file);
    let rows = rows(&messages);
    let info = recorder(&sandbox, &["info", "--json", &file]).json();

    let measured: Vec<_> = rows.iter().filter(|row| row.solve_ns > 0).collect();
    let timing = &info["timing"];
    assert_eq!(measured.len() as u64, STEPS, "every step but the first state is measured");
    assert_eq!(timing["measured_steps"], STEPS);
    let late = measured.iter().filter(|row| row.wake_late_ns > 1_000_000_000 / 480).count();
    assert_eq!(timing["late_steps"], late as u64);
    assert_distribution(
        &timing["wake_late"],
        measured.iter().map(|row| row.wake_late_ns).collect(),
    );
    assert_distribution(&timing["solve"], measured.iter().map(|row| row.solve_ns).collect());

    let [first, last] = [&rows[0], &rows[rows.len() - 1]];
    assert_eq!(info["last_state_hash"], format!("{:016x}", last.state_hash));
    let torn = [&info["torn_count_first"], &info["torn_count_last"]];
    assert_eq!(torn, [&json!(first.torn_count), &json!(last.torn_count)]);
    assert!(last.torn_count > first.torn_count, "a constraint was cut");
    let received_ns = |index: usize| messages[index].log_time_ns;
    let wall_clock_s = (received_ns(messages.len() - 1) - received_ns(0)) as f64 / 1e9;
    assert_eq!(info["wall_clock_s"], json!(wall_clock_s));
    assert_eq!(info["messages_per_s"]["/steps"], 480.0);

    let page = recorder(&sandbox, &["info", &file]).success();
    for line in [
        format!("last hash   {:016x}", last.state_hash),
        format!("torn        {} in the first snapshot, 1 in the last one", first.torn_count),
        format!("late        {late} of {STEPS} measured steps woke up more than a period"),
    ] {
        assert!(page.contains(&line), "no \"{line}\" in: {page}");
    }
    assert!(page.contains("#\n"), "no bar in: {page}");
}

#[test]
fn the_page_of_a_simulated_recording_says_that_no_time_was_measured() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "rope", "--steps", "60", "-o", &file]).success();
    let info = recorder(&sandbox, &["info", "--json", &file]).json();
    assert_eq!((&info["timing"], &info["wall_clock_s"]), (&Value::Null, &Value::Null));
    assert_eq!((&info["simulated"], &info["duration_s"]), (&json!(true), &json!(0.25)));
    let last = rows(&messages(&file))[60];
    assert_eq!(info["last_state_hash"], format!("{:016x}", last.state_hash));
    let page = recorder(&sandbox, &["info", &file]).success();
    assert!(page.contains("timing      none (simulated, so no time was measured)"), "{page}");
}
