//! `--realtime` and `--cpu`, as the system shows them in `/proc`: the policy of each thread, its CPUs, and
//! the locked memory. Tests with privileges end early where this process has none.

use std::fs;
use std::path::{Path, PathBuf};

use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, ctl, wait_for};
use serde_json::Value;
use sim_contract::{Action, Client, Text};

/// Policy of ordinary threads.
pub(crate) const SCHED_OTHER: u32 = 0;
const SCHED_FIFO: u32 = 1;

/// Scheduling of a thread as `/proc` shows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ThreadState {
    pub(crate) policy: u32,
    priority: u32,
    /// CPUs that it may use, such as "0-3".
    cpus: String,
}

/// Number of a node's process.
fn process_id(sandbox: &Sandbox) -> u64 {
    ctl(sandbox, &["status"])["process_id"].as_u64().unwrap()
}

/// Returns a field of a status in `/proc`.
fn field(status: &str, name: &str) -> String {
    let line = status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'));
    line.unwrap().trim().to_owned()
}

/// Returns the state of a thread; `None` if it has ended.
pub(crate) fn thread_state(thread: &Path) -> Option<ThreadState> {
    let stat = fs::read_to_string(thread.join("stat")).ok()?;
    let status = fs::read_to_string(thread.join("status")).ok()?;
    // Behind the name in parentheses, the fields begin with the third one; see proc_pid_stat(5).
    let fields: Vec<_> = stat.rsplit_once(") ")?.1.split(' ').collect();
    let number = |index: usize| fields[index - 3].parse().unwrap();
    let cpus = field(&status, "Cpus_allowed_list");
    Some(ThreadState { priority: number(40), policy: number(41), cpus })
}

/// Returns the threads of a process with a name.
fn threads(process_id: u64, name: &str) -> Vec<PathBuf> {
    let tasks = fs::read_dir(format!("/proc/{process_id}/task")).unwrap();
    let threads = tasks.map(|task| task.unwrap().path());
    let is_named = |thread: &PathBuf| {
        fs::read_to_string(thread.join("comm")).is_ok_and(|found| found.trim_end() == name)
    };
    threads.filter(is_named).collect()
}

/// Returns the state of the loop's thread.
fn loop_state(process_id: u64) -> ThreadState {
    thread_state(Path::new(&format!("/proc/{process_id}/task/{process_id}"))).unwrap()
}

/// CPUs that this process may use.
fn allowed_cpus() -> Vec<usize> {
    let text = field(&fs::read_to_string("/proc/self/status").unwrap(), "Cpus_allowed_list");
    let numbers = text.split(',').flat_map(|range| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        first.parse::<usize>().unwrap()..=last.parse().unwrap()
    });
    numbers.collect()
}

/// Returns `true` if a node gets everything here, as a process with two capabilities does.
fn has_privileges() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let capabilities = u64::from_str_radix(&field(&status, "CapEff"), 16).unwrap();
    let (ipc_lock, sys_nice) = (1 << 14, 1 << 23);
    capabilities & (ipc_lock | sys_nice) == ipc_lock | sys_nice
}

#[test]
fn a_privileged_node_gets_fifo_a_cpu_and_locked_memory() {
    if !has_privileges() {
        return;
    }
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--realtime=37,require", "--threads", "3", "--json"];
    let mut node = Process::start(Program::SimNode, &sandbox, &args);
    node.wait_until_ready();
    let id = process_id(&sandbox);
    let cpus = allowed_cpus();
    let last = cpus.last().unwrap();
    let main = loop_state(id);
    let expected = ThreadState { policy: SCHED_FIFO, priority: 37, cpus: last.to_string() };
    assert_eq!(main, expected);
    for name in ["solver-1", "solver-2"] {
        let [thread] = threads(id, name).try_into().unwrap();
        let state = thread_state(&thread).unwrap();
        assert_eq!((state.policy, state.priority), (SCHED_FIFO, 37), "{name}");
        // They leave the CPU of the loop to it, unless there is no other.
        assert!(cpus.len() == 1 || state.cpus != last.to_string(), "{name}: {state:?}");
    }
    let [other] = threads(id, "bus-error").try_into().unwrap();
    assert_eq!(thread_state(&other).unwrap().policy, SCHED_OTHER);
    let locked = field(&fs::read_to_string(format!("/proc/{id}/status")).unwrap(), "VmLck");
    assert_ne!(locked, "0 kB");
    let finished = node.interrupt();
    for line in ["SCHED_FIFO, priority 37", "the loop runs on CPU", "memory is locked"] {
        assert!(finished.stderr.contains(&format!("real time: {line}")), "{}", finished.stderr);
    }
    let expected = serde_json::json!({"fifo_priority": 37, "cpu": last, "is_memory_locked": true});
    assert_eq!(finished.json()["real_time"], expected);
}

#[test]
fn a_loaded_scene_is_built_with_ordinary_scheduling_and_stepped_with_fifo() {
    if !has_privileges() {
        return;
    }
    let sandbox = Sandbox::new();
    // The pinned loop does not lend its CPU to the threads that a load starts, unless it has no other.
    let cpus = allowed_cpus();
    let args = ["run", "curtain", "--rate", "100", "--realtime", "--threads", "2"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let id = process_id(&sandbox);
    let large = "version = 1\n[[generate]]\nshape = \"cloth\"\ncolumns = 1000\nrows = 700\n\
                 spacing = 0.01\npinned = \"top\"\n";
    let scene = sandbox.write("large.toml", large);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.send(Action::Load { scene: Text::new(&scene).unwrap() }).unwrap();
    wait_for("a thread that builds the scene with ordinary scheduling", || {
        let state = thread_state(threads(id, "load").first()?)?;
        let is_apart = cpus.len() == 1 || state.cpus != cpus.last().unwrap().to_string();
        (state.policy == SCHED_OTHER && is_apart).then_some(())
    });
    assert!(client.next_outcome(DEADLINE).unwrap().is_some());
    // The old solver ends beside the loop, with its threads.
    let solver = wait_for("the thread of the new solver alone", || {
        let [solver] = threads(id, "solver-1").try_into().ok()?;
        Some(solver)
    });
    let state = thread_state(&solver).unwrap();
    assert_eq!((state.policy, state.priority), (SCHED_FIFO, 20));
    assert!(cpus.len() == 1 || state.cpus != cpus.last().unwrap().to_string(), "{state:?}");
    let main = loop_state(id);
    assert_eq!((main.policy, main.cpus), (SCHED_FIFO, cpus.last().unwrap().to_string()));
}

/// Starts a node that has no capability, and the limits of an ordinary user.
fn start_unprivileged(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_without_privileges(Program::SimNode, sandbox, args)
}

#[test]
fn an_unprivileged_node_runs_and_names_the_cure_of_each_refusal() {
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--realtime", "--json"];
    let mut node = start_unprivileged(&sandbox, &args);
    node.wait_until_ready();
    let id = process_id(&sandbox);
    let main = loop_state(id);
    let last = *allowed_cpus().last().unwrap();
    let expected = ThreadState { policy: SCHED_OTHER, priority: 0, cpus: last.to_string() };
    assert_eq!(main, expected);
    let locked = field(&fs::read_to_string(format!("/proc/{id}/status")).unwrap(), "VmLck");
    assert_eq!(locked, "0 kB");
    let finished = node.interrupt();
    for text in [
        "warning: real time: no SCHED_FIFO: ",
        "`ulimit -r 20`",
        "cap_sys_nice,cap_ipc_lock+ep",
        "`--cap-add SYS_NICE --ulimit rtprio=99`",
        "warning: real time: no locked memory: this process may lock 64 KiB only",
        "`ulimit -l unlimited`",
    ] {
        assert!(finished.stderr.contains(text), "{text} is not in: {}", finished.stderr);
    }
    let expected =
        serde_json::json!({"fifo_priority": null, "cpu": last, "is_memory_locked": false});
    assert_eq!(finished.json()["real_time"], expected);
}

#[test]
fn a_required_property_that_is_refused_ends_the_run_before_it_is_ready() {
    let sandbox = Sandbox::new();
    for value in ["--realtime=require", "--realtime=50,require"] {
        let finished = start_unprivileged(&sandbox, &["run", "rope", value]).wait();
        assert_eq!((finished.code, finished.stdout.as_str()), (Some(1), ""), "{value}");
        let start = "error: --realtime=require: no SCHED_FIFO: ";
        assert!(finished.stderr.contains(start), "{}", finished.stderr);
        assert!(!finished.stderr.contains("ready"), "{}", finished.stderr);
    }
}

#[test]
fn the_loop_runs_on_the_given_cpu_without_further_wishes() {
    let sandbox = Sandbox::new();
    let cpus = allowed_cpus();
    let first = cpus[0].to_string();
    let args = ["run", "curtain", "--cpu", &first, "--json"];
    let node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let id = process_id(&sandbox);
    let main = loop_state(id);
    assert_eq!((main.policy, main.cpus), (SCHED_OTHER, first));
    let summary: Value = node.interrupt().json();
    let expected =
        serde_json::json!({"fifo_priority": null, "cpu": cpus[0], "is_memory_locked": false});
    assert_eq!(summary["real_time"], expected);
}

#[test]
fn a_cpu_that_is_not_allowed_is_refused_with_the_allowed_ones() {
    let sandbox = Sandbox::new();
    let cpus = allowed_cpus();
    let beyond = (cpus.last().unwrap() + 1).to_string();
    for cpu in [beyond.as_str(), "1024", "99999999999999999999", "-1", "one"] {
        let finished = Process::run(Program::SimNode, &sandbox, &["run", "--cpu", cpu]);
        assert_eq!((finished.code, finished.stdout.as_str()), (Some(2), ""), "{cpu}");
        let allowed = format!("this process may not use it (allowed: {}", cpus[0]);
        assert!(finished.stderr.contains(&allowed), "{cpu}: {}", finished.stderr);
    }
}

#[test]
fn an_overloaded_node_with_fifo_leaves_time_to_ordinary_threads_of_its_cpu() {
    if !has_privileges() {
        return;
    }
    let sandbox = Sandbox::new();
    let cpus = allowed_cpus();
    let cpu = cpus[0].to_string();
    let args = ["run", "curtain", "--rate", "100000", "--realtime=10,require", "--cpu", &cpu];
    let node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let id = process_id(&sandbox);
    // Each voluntary switch is a sleep. A loop that never sleeps makes none.
    let sleeps = || {
        let status = fs::read_to_string(format!("/proc/{id}/task/{id}/status")).unwrap();
        field(&status, "voluntary_ctxt_switches").parse::<u64>().unwrap()
    };
    let before = sleeps();
    wait_for("rests of the loop", || (sleeps() > before + 5).then_some(()));
    assert!(ctl(&sandbox, &["status"])["skipped_periods"].as_u64().unwrap() > 0);
    node.signal(Signal::INT);
    assert_eq!(node.wait().code, Some(0));
}
