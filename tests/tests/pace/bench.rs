//! `sim-node bench`: its report, its end, and the processes that it starts. No test compares a time with a
//! limit.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use integration_tests::{Process, Program, Sandbox, Signal, Stream, Streams, wait_for};
use serde_json::Value;
use sim_contract::{Client, Endpoint, NAME_DEFAULT};

use crate::pace::real_time::{SCHED_OTHER, thread_state};

const REFERENCE: &str = include_str!("../../../sim-node/contract/README.md");

/// Process ids of the clients of a bench: they are given its domain.
fn clients(bench: &str) -> Vec<String> {
    let processes = fs::read_dir("/proc").unwrap().flatten();
    let ids = processes.filter_map(|process| process.file_name().into_string().ok());
    let is_client = |id: &String| {
        let line = fs::read_to_string(format!("/proc/{id}/cmdline")).unwrap_or_default();
        line.contains("bench-client") && line.contains(bench)
    };
    ids.filter(is_client).collect()
}

/// Files of the domain of a bench.
fn files(bench: &str) -> Vec<PathBuf> {
    let entries = ["/dev/shm", "/tmp"].map(|folder| fs::read_dir(folder).unwrap().flatten());
    let paths = entries.into_iter().flatten().map(|entry| entry.path());
    paths.filter(|path| path.to_string_lossy().contains(bench)).collect()
}

/// Start of the name of a bench's domain.
fn domain(bench: &Process) -> String {
    format!("bench-{}-", bench.id())
}

/// Checks percentiles with at least `count_min` samples.
fn check_percentiles(row: &Value, count_min: u64) {
    let number = |key: &str| row[key].as_u64().ok_or_else(|| format!("{key} in {row}")).unwrap();
    assert!(number("count") >= count_min, "{row}");
    assert!(number("p50_ns") > 0 && number("p50_ns") <= number("p99_ns"), "{row}");
    assert!(
        number("p99_ns") <= number("p999_ns") && number("p999_ns") <= number("max_ns"),
        "{row}"
    );
}

/// All keys of an object and of the objects in it.
fn keys(value: &Value, found: &mut Vec<String>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                found.push(key.clone());
                keys(value, found);
            }
        }
        Value::Array(array) => array.iter().for_each(|value| keys(value, found)),
        _ => {}
    }
}

#[test]
fn the_report_has_plausible_values_in_documented_fields_and_nothing_remains() {
    let sandbox = Sandbox::new();
    let args =
        ["bench", "rope", "--rate", "500", "--duration", "500ms", "--readers", "0,2,0", "--json"];
    let bench = Process::start(Program::SimNode, &sandbox, &args);
    let domain = domain(&bench);
    let report = bench.wait().json();
    assert_eq!((clients(&domain), files(&domain)), (vec![], vec![]));

    assert_eq!((&report["scene"], &report["rate_hz"]), (&"rope".into(), &500.into()));
    assert!(report["machine"]["core_count"].as_u64().unwrap() > 0);
    assert_eq!(report["real_time"]["fifo_priority"], Value::Null);
    check_percentiles(&report["bare_loop"], 2);
    let loops = report["loops"].as_array().unwrap();
    let reader_counts: Vec<_> = loops.iter().map(|row| row["reader_count"].clone()).collect();
    assert_eq!(reader_counts, [0, 2]);
    for row in loops {
        check_percentiles(&row["wake_late"], 2);
        assert!(row["wake_late_ratio_p50"].as_f64().unwrap() > 0.0, "{row}");
        for (_, phase) in row["phases"].as_object().unwrap() {
            check_percentiles(phase, 2);
        }
    }
    let latencies = report["latencies"].as_array().unwrap();
    // A reader that polls needs a core of its own, and this machine may have fewer than three.
    assert_eq!(
        (&latencies[0]["reader_count"], &latencies[0]["wait"]),
        (&2.into(), &"event".into())
    );
    for row in latencies {
        check_percentiles(&row["latency"], 2);
        assert!(row["missed_count"].is_u64(), "{row}");
    }
    let commands = report["commands"].as_array().unwrap();
    let nodes: Vec<_> = commands.iter().map(|row| row["node"].clone()).collect();
    assert_eq!(nodes, ["as_fast_as_possible", "paused", "paced"]);
    for row in commands {
        check_percentiles(&row["round_trip"], 1);
    }
    check_percentiles(&report["lockstep"]["round_trip"], 1);
    assert!(report["lockstep"]["steps_per_s"].as_f64().unwrap() > 0.0);

    let mut found = Vec::new();
    keys(&report, &mut found);
    for key in found {
        assert!(REFERENCE.contains(&format!("`{key}`")), "{key} is not documented");
    }
}

#[test]
fn the_text_of_the_report_has_a_table_for_each_measurement() {
    let sandbox = Sandbox::new();
    let args = ["bench", "--duration", "100ms", "--readers", "1"];
    let text = Process::run(Program::SimNode, &sandbox, &args).success();
    for line in [
        "scene curtain, 168 particles, ",
        "wake-up lateness of the loop, in µs",
        "bare ",
        "node, 1 reader ",
        "times of a step, in µs",
        "from publication to reception, in µs",
        "from a command to its outcome, in µs",
        "while paused ",
        "lockstep with one member, as fast as possible, in µs",
    ] {
        assert!(text.lines().any(|found| found.trim_start().starts_with(line)), "{line}: {text}");
    }
}

#[test]
fn ctrl_c_ends_a_bench_and_its_clients_and_removes_its_files() {
    let sandbox = Sandbox::new();
    let args = ["bench", "--realtime", "--duration", "10min", "--readers", "2"];
    // The first measurement, the bare loop, would last for ten minutes as well.
    let mut bench = Process::start(Program::SimNode, &sandbox, &args);
    let domain = domain(&bench);
    bench.wait_until_it_handles(Signal::INT);
    let finished = bench.interrupt();
    assert_eq!((finished.code, finished.stdout.as_str()), (Some(1), ""));
    let expected = "error: interrupted before the end of the measurement\n";
    assert!(finished.stderr.ends_with(expected), "{}", finished.stderr);
    assert_eq!((clients(&domain), files(&domain)), (vec![], vec![]));
}

/// A bench whose node runs with two readers, and one of these.
fn bench_with_client(sandbox: &Sandbox, options: &[&str]) -> (Process, String) {
    let args = ["bench", "--duration", "10s", "--readers", "2"];
    let args: Vec<_> = args.iter().chain(options).copied().collect();
    // The clients inherit the standard error, so the harness would wait for their end to read it.
    let streams = Streams { stderr: Stream::Full, ..Streams::default() };
    let mut bench = Process::start_with(streams, Program::SimNode, sandbox, &args);
    let name = format!("{}0", domain(&bench));
    let endpoint = Endpoint::new(Some(&name), NAME_DEFAULT).unwrap();
    // The node makes steps once all clients are connected.
    wait_for("a step of the bench", || {
        assert!(bench.is_running());
        let mut client = Client::attach(&endpoint).ok()?;
        client.next_snapshot(Duration::from_secs(1)).ok()?
    });
    let client = clients(&name).pop();
    (bench, client.unwrap())
}

#[test]
fn a_client_has_ordinary_scheduling_and_ends_with_ctrl_c() {
    let sandbox = Sandbox::new();
    let (bench, client) = bench_with_client(&sandbox, &["--realtime"]);
    let state = thread_state(Path::new(&format!("/proc/{client}/task/{client}"))).unwrap();
    assert_eq!(state.policy, SCHED_OTHER);
    let domain = domain(&bench);
    let finished = bench.interrupt();
    assert_eq!((finished.code, finished.stdout.as_str()), (Some(1), ""));
    assert_eq!((clients(&domain), files(&domain)), (vec![], vec![]));
}

#[test]
fn the_clients_of_a_killed_bench_end() {
    let sandbox = Sandbox::new();
    let (bench, _) = bench_with_client(&sandbox, &[]);
    let domain = domain(&bench);
    bench.signal(Signal::KILL);
    assert_eq!(bench.wait().signal, Some(9));
    wait_for("the end of all clients", || clients(&domain).is_empty().then_some(()));
    // Nobody is left to remove the domain.
    for file in files(&domain) {
        let _removed = fs::remove_file(&file).or_else(|_| fs::remove_dir_all(&file));
    }
    assert_eq!(files(&domain), Vec::<PathBuf>::new());
}

#[test]
fn invalid_options_are_refused() {
    let sandbox = Sandbox::new();
    for (options, expected) in [
        ("--readers 17", "it must be a whole number from 0 to 16"),
        ("--readers 1,,2", "it must be a whole number from 0 to 16"),
        ("--readers many", "it must be a whole number from 0 to 16"),
        ("--duration 1ms", "it must be a time from 100ms to 10min"),
        ("--duration 1h", "it must be a time from 100ms to 10min"),
        ("--duration 3", "it must be a time with its unit"),
        ("--rate 0", "it must be a whole number from 1 to 100000"),
        ("--realtime=100", "it must be a priority from 1 to 99"),
        ("--steps 3", "unexpected argument '--steps' found"),
    ] {
        let args: Vec<_> = ["bench"].into_iter().chain(options.split(' ')).collect();
        let refused = Process::run(Program::SimNode, &sandbox, &args);
        assert_eq!((refused.code, refused.stdout.as_str()), (Some(2), ""), "{options}");
        assert!(refused.stderr.contains(expected), "{options}: {}", refused.stderr);
    }
    let unknown = Process::run(Program::SimNode, &sandbox, &["bench", "nowhere"]);
    assert_eq!((unknown.code, unknown.stdout.as_str()), (Some(1), ""));
    assert!(unknown.stderr.starts_with("error: "), "{}", unknown.stderr);
}
