//! `sim-node ps` lists every living owner of a name, whatever state it is in, and no dead one.

use integration_tests::{Process, Program, Sandbox, Signal, ctl, wait_for};
use serde_json::{Value, json};

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, &[&["run", "rope"], args].concat())
}

/// Returns the rows of `ps --json`, by name.
fn rows(sandbox: &Sandbox) -> Vec<Value> {
    let listed = Process::run(Program::SimNode, sandbox, &["ps", "--json"]).json();
    listed.as_array().unwrap().clone()
}

fn names(rows: &[Value]) -> Vec<&str> {
    rows.iter().map(|row| row["name"].as_str().unwrap()).collect()
}

#[test]
fn an_empty_domain_says_so_and_stays_empty() {
    let sandbox = Sandbox::new();
    for args in [&["ps"][..], &["ps", "--json"]] {
        let empty = Process::run(Program::SimNode, &sandbox, args);
        let expected = format!("no node runs in domain '{}'\n", sandbox.domain());
        assert_eq!(empty.stderr, expected);
        let stdout = if args.len() > 1 { "[]\n" } else { "" };
        assert_eq!((empty.code, empty.stdout.as_str()), (Some(0), stdout));
    }
    assert!(!sandbox.root().exists());
}

#[test]
fn nodes_and_replays_are_listed_with_the_fields_of_their_status() {
    let (sandbox, other) = (Sandbox::new(), Sandbox::new());
    let _elsewhere = node(&other, &["--name", "elsewhere"]);
    let _paused = node(&sandbox, &["--name", "paused", "--paused"]);
    let _running = node(&sandbox, &["--name", "a.running"]);
    let file = sandbox.path("run.mcap");
    let args = ["simulate", "rope", "--steps", "2", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let args = ["play", &file, "--name", "replay", "--paused"];
    let _replay = Process::start_ready(Program::Recorder, &sandbox, &args);

    let rows = rows(&sandbox);
    assert_eq!(names(&rows), ["a.running", "paused", "replay"]);
    let states = rows.iter().map(|row| row["state"].clone()).collect::<Vec<_>>();
    assert_eq!(states, ["running", "paused", "paused"]);
    let replays = rows.iter().map(|row| row["replay"].clone()).collect::<Vec<_>>();
    assert_eq!(replays, [false, false, true]);
    // The paused node has the same status at both times.
    let status = ctl(&sandbox, &["status", "--name", "paused"]);
    let paused = rows[1].as_object().unwrap();
    let of_ps = ["name", "state", "contract_version", "problem"];
    for (field, value) in paused.iter().filter(|(field, _)| !of_ps.contains(&field.as_str())) {
        assert_eq!(value, &status[field.as_str()], "{field}");
    }
    assert_eq!((&paused["scene"], &paused["step"]), (&json!("rope"), &json!(0)));

    let table = Process::run(Program::SimNode, &sandbox, &["ps"]).success();
    let rows: Vec<_> = table.lines().skip(1).collect();
    for (row, state) in rows.iter().zip(["  running  ", "  paused  ", "  replay, paused  "]) {
        assert!(row.contains(state), "{table}");
    }
}

#[test]
fn a_stopped_node_is_listed_as_silent_beside_those_that_answer_and_a_killed_one_is_not() {
    let sandbox = Sandbox::new();
    let stopped = node(&sandbox, &["--name", "stopped"]);
    let killed = node(&sandbox, &["--name", "killed"]);
    let _running = node(&sandbox, &["--name", "zeta"]);
    let process_id = ctl(&sandbox, &["status", "--name", "stopped"])["process_id"].clone();
    let file = format!("/proc/{process_id}/stat");
    stopped.signal(Signal::STOP);
    wait_for("the stopped process", || {
        std::fs::read_to_string(&file).unwrap().contains(") T ").then_some(())
    });
    killed.signal(Signal::KILL);
    killed.wait();

    let rows = rows(&sandbox);
    assert_eq!(names(&rows), ["stopped", "zeta"]);
    assert_eq!((&rows[0]["state"], &rows[0]["process_id"]), (&json!("silent"), &process_id));
    assert!(rows[0]["step"].is_null(), "{}", rows[0]);
    assert_eq!(rows[1]["state"], "running");
    let table = Process::run(Program::SimNode, &sandbox, &["ps", "--timeout", "100ms"]);
    let expected = "note: 'stopped': it has not answered within 100ms (is it stopped, or busy with a \
                    long step?)\n";
    assert_eq!((table.code, table.stderr.as_str()), (Some(0), expected));
    stopped.signal(Signal::CONT);
    assert_eq!(stopped.interrupt().code, Some(0));
}

#[test]
fn a_node_whose_files_a_cleaner_has_removed_is_listed_as_unreachable_with_the_cure() {
    let sandbox = Sandbox::new();
    let node = node(&sandbox, &[]);
    let process_id = ctl(&sandbox, &["status"])["process_id"].clone();
    for entry in std::fs::read_dir(sandbox.root()).unwrap().flatten() {
        let _ =
            std::fs::remove_dir_all(entry.path()).or_else(|_| std::fs::remove_file(entry.path()));
    }
    let [row] = rows(&sandbox).try_into().unwrap();
    assert_eq!((&row["name"], &row["state"]), (&json!("sim"), &json!("unreachable")));
    assert_eq!(row["process_id"], process_id);
    assert!(row["problem"].as_str().unwrap().ends_with("restart it"), "{row}");
    assert_eq!(node.interrupt().code, Some(0));
}
