//! `sim-node doctor` finds what killed processes have left, and `--fix` removes that and nothing else.

use std::collections::BTreeSet;
use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use integration_tests::{Finished, Process, Program, Sandbox, Signal, ctl, wait_for};
use rustix::fs::{AtFlags, CWD, Timespec, Timestamps, utimensat};
use serde_json::Value;

fn node(sandbox: &Sandbox, name: &str) -> Process {
    Process::start_ready(Program::SimNode, sandbox, &["run", "rope", "--name", name])
}

fn doctor(sandbox: &Sandbox, args: &[&str]) -> Finished {
    Process::run(Program::SimNode, sandbox, &[&["doctor", "rope"], args].concat())
}

/// Returns the only finding of a check. The exit code must agree with all findings.
fn finding(finished: &Finished, check: &str) -> Value {
    let report: Value = serde_json::from_str(&finished.stdout).unwrap();
    let is_problem = |one: &&Value| one["level"] == "problem";
    let problem_count = report["findings"].as_array().unwrap().iter().filter(is_problem).count();
    assert_eq!(report["problems"], problem_count, "{report}");
    assert_eq!(finished.code, Some(i32::from(problem_count > 0)), "{report}");
    let findings = report["findings"].as_array().unwrap().iter();
    let found: Vec<_> = findings.filter(|one| one["check"] == check).collect();
    assert_eq!(found.len(), 1, "{report}");
    found[0].clone()
}

fn level(finished: &Finished, check: &str) -> String {
    finding(finished, check)["level"].as_str().unwrap().to_owned()
}

/// Returns the files of a domain, except the counter of nodes, which iceoryx2 never removes.
fn files(sandbox: &Sandbox) -> BTreeSet<PathBuf> {
    let mut files = segments(sandbox);
    let mut folders = vec![sandbox.root()];
    while let Some(folder) = folders.pop() {
        for path in fs::read_dir(folder).into_iter().flatten().map(|entry| entry.unwrap().path()) {
            if path.is_dir() {
                folders.push(path.clone());
            }
            files.insert(path);
        }
    }
    files
}

/// Returns the shared memory of a domain, except the counter.
fn segments(sandbox: &Sandbox) -> BTreeSet<PathBuf> {
    let prefix = format!("{}_", sandbox.domain());
    let is_own = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_str().unwrap();
        name.starts_with(&prefix) && !name.ends_with(".global_mgmt")
    };
    let all = fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
    all.filter(is_own).collect()
}

fn kill(process: Process) {
    process.signal(Signal::KILL);
    process.wait();
}

/// Kills a node and its client, and leaves their files.
fn kill_a_node_and_a_client(sandbox: &Sandbox) {
    let node = node(sandbox, "killed");
    let args = ["--name", "killed", "7", "3"];
    let client = Process::start_ready(Program::Grabber, sandbox, &args);
    kill(node);
    kill(client);
}

#[test]
fn fix_removes_the_files_of_a_killed_node_and_client_and_touches_no_living_process() {
    let (sandbox, other) = (Sandbox::new(), Sandbox::new());
    let living = node(&sandbox, "living");
    let mut reader = Process::start_ready(Program::StubbornReader, &sandbox, &["--name", "living"]);
    let stopped = node(&sandbox, "stopped");
    stopped.signal(Signal::STOP);
    let elsewhere = node(&other, "living");
    kill_a_node_and_a_client(&other);
    let (of_living, of_other) = (files(&sandbox), files(&other));
    kill_a_node_and_a_client(&sandbox);
    assert!(files(&sandbox).len() > of_living.len() + 30);

    let found = doctor(&sandbox, &["--json"]);
    assert_eq!(found.code, Some(1), "{}", found.stdout);
    let leftovers = finding(&found, "leftovers");
    assert_eq!(leftovers["level"], "problem");
    let fix = format!("sim-node doctor --domain {} --fix", sandbox.domain());
    assert_eq!(leftovers["cure"], fix);
    assert!(leftovers["text"].as_str().unwrap().contains("the files of 2 processes ("));

    let fixed = doctor(&sandbox, &["--fix", "--json"]);
    assert_eq!(level(&fixed, "leftovers"), "ok", "{}", fixed.stdout);
    assert_eq!(files(&sandbox), of_living);
    assert_eq!(files(&other), of_other);
    assert_eq!(ctl(&sandbox, &["status", "--name", "living"])["readers"], 1);
    assert!(reader.is_running());
    stopped.signal(Signal::CONT);
    assert_eq!(ctl(&sandbox, &["status", "--name", "stopped"])["scene"], "rope");
    for node in [living, stopped, elsewhere] {
        assert_eq!(node.interrupt().code, Some(0));
    }
}

/// Makes files look as if they had been created long ago. By name, because some must not be opened.
fn make_old(files: &BTreeSet<PathBuf>) {
    let start = Timespec { tv_sec: 0, tv_nsec: 0 };
    let times = Timestamps { last_access: start, last_modification: start };
    for file in files {
        utimensat(CWD, file, &times, AtFlags::empty()).unwrap();
    }
}

#[test]
fn fix_removes_what_a_node_leaves_that_is_killed_in_any_phase_of_its_start() {
    let sandbox = Sandbox::new();
    let services = sandbox.root().join("services");
    let service_count = || fs::read_dir(&services).into_iter().flatten().count();
    for phase in 0..=13 {
        let args = ["run", "rope"];
        let mut killed = Process::start(Program::SimNode, &sandbox, &args);
        wait_for("the services", || {
            (service_count() >= phase || !killed.is_running()).then_some(())
        });
        kill(killed);
        make_old(&files(&sandbox));
        doctor(&sandbox, &["--fix", "--json"]);
        let found = doctor(&sandbox, &["--json"]);
        assert_eq!(level(&found, "leftovers"), "ok", "phase {phase}: {}", found.stdout);
        let mut left = files(&sandbox);
        left.retain(|path| !path.is_dir());
        assert_eq!(left, BTreeSet::new(), "phase {phase}");
    }
}

#[test]
fn fix_frees_shared_memory_that_no_file_in_the_root_names() {
    let sandbox = Sandbox::new();
    let node = node(&sandbox, "sim");
    let root = fs::read_dir(sandbox.root()).unwrap().map(|entry| entry.unwrap().path());
    for path in root {
        fs::remove_dir_all(&path).or_else(|_| fs::remove_file(&path)).unwrap();
    }
    make_old(&segments(&sandbox));
    let living = segments(&sandbox);
    let fixed = doctor(&sandbox, &["--fix", "--json"]);
    assert_eq!(level(&fixed, "leftovers"), "ok");
    assert_eq!(segments(&sandbox), living);
    kill(node);
    let found = doctor(&sandbox, &["--json"]);
    let text = finding(&found, "leftovers")["text"].to_string();
    assert!(text.contains("1 lock, 27 segments"), "{text}");
    doctor(&sandbox, &["--fix", "--json"]);
    assert_eq!(segments(&sandbox), BTreeSet::new());
}

#[test]
fn fix_keeps_the_services_of_a_killed_node_that_a_living_client_has_open() {
    let sandbox = Sandbox::new();
    let killed = node(&sandbox, "sim");
    let mut reader = Process::start_ready(Program::StubbornReader, &sandbox, &[]);
    kill(killed);
    make_old(&segments(&sandbox));
    let of_services = |files: BTreeSet<PathBuf>| -> BTreeSet<PathBuf> {
        let is_of_service = |path: &PathBuf| {
            path.extension().is_some_and(|kind| kind == "service" || kind == "dynamic")
        };
        files.into_iter().filter(is_of_service).collect()
    };
    let before = of_services(files(&sandbox));
    assert_eq!(before.len(), 32, "two for each service");
    assert_eq!(level(&doctor(&sandbox, &["--fix", "--json"]), "leftovers"), "ok");
    assert_eq!(of_services(files(&sandbox)), before);
    let next = node(&sandbox, "sim");
    assert!(reader.is_running());
    kill(reader);
    assert_eq!(next.interrupt().code, Some(0));
}

#[test]
fn an_unsafe_root_and_a_low_limit_are_problems() {
    let sandbox = Sandbox::new();
    assert_eq!(level(&doctor(&sandbox, &["--json"]), "root"), "ok");
    assert!(!sandbox.root().exists());
    fs::create_dir(sandbox.root()).unwrap();
    fs::set_permissions(sandbox.root(), Permissions::from_mode(0o777)).unwrap();
    let open = doctor(&sandbox, &["--json"]);
    assert_eq!((open.code, level(&open, "root").as_str()), (Some(1), "problem"));
    fs::set_permissions(sandbox.root(), Permissions::from_mode(0o700)).unwrap();
    let args = ["doctor", "rope", "--json"];
    let limited = Process::start_limited(("-n", 100), Program::SimNode, &sandbox, &args).wait();
    assert_eq!((limited.code, level(&limited, "open files").as_str()), (Some(1), "problem"));
    let text = doctor(&sandbox, &[]).stdout;
    assert!(text.contains("ok") && text.contains("clock source"), "{text}");
}

#[test]
fn the_printed_configuration_names_the_domain_and_excludes_other_options() {
    let sandbox = Sandbox::new();
    let args = ["doctor", "--iox2-config"];
    let printed = Process::run(Program::SimNode, &sandbox, &args).success();
    assert!(printed.contains(&format!("prefix = \"{}_\"", sandbox.domain())), "{printed}");
    assert!(
        printed.contains(&format!("root-path = \"{}\"", sandbox.root().display())),
        "{printed}"
    );
    assert!(!Path::new(&sandbox.root()).exists());
    for other in ["--fix", "--json", "rope"] {
        let args = ["doctor", "--iox2-config", other];
        assert_eq!(Process::run(Program::SimNode, &sandbox, &args).code, Some(2), "{other}");
    }
    let unknown = Process::run(Program::SimNode, &sandbox, &["doctor", "./none.toml"]);
    assert_eq!((unknown.code, unknown.stdout.as_str()), (Some(1), ""));
    assert!(unknown.stderr.contains("none.toml"), "{}", unknown.stderr);
}
