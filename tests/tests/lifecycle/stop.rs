//! Requests to stop are seen within a step or a load, however long it takes.

use std::fs;
use std::path::Path;

use integration_tests::{Process, Program, Sandbox, Signal, wait_for};
use sim_contract::{Action, Client, Text};

/// A scene whose step is near the limit of work, one constraint after the other: ten seconds or more
/// on one core.
const HEAVY: &str = "version = 1\n[solver]\nsubsteps = 1000\niterations = 100\norder = \"listed\"\n\
    [[generate]]\nshape = \"rope\"\ncount = 10000\nfrom = [0, 0, 0]\nto = [9, 0, 0]\n";

#[test]
fn a_node_gives_up_a_long_step_and_publishes_nothing_of_it() {
    for signal in [Signal::TERM, Signal::INT] {
        let sandbox = Sandbox::new();
        let scene = sandbox.write("heavy.toml", HEAVY);
        let node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene]);
        node.signal(signal);
        let finished = node.wait();
        assert_eq!(finished.code, Some(0), "{}", finished.stderr);
        assert!(finished.stderr.contains("done: 0 steps"), "{}", finished.stderr);
    }
}

/// Takes seconds to read and build.
const LARGE: &str = "version = 1\n[solver]\nrate_hz = 240\n[[generate]]\nshape = \"cloth\"\n\
    columns = 1000\nrows = 1000\nspacing = 0.01\n";

#[test]
fn a_node_that_loads_a_large_scene_ends_without_finishing_it() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("large.toml", LARGE);
    let mut node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--json"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.send(Action::Load { scene: Text::new(&scene).unwrap() }).unwrap();
    node.wait_for_thread("load");
    node.signal(Signal::TERM);
    let finished = node.wait();
    assert_eq!(finished.code, Some(0), "{}", finished.stderr);
    assert_eq!(finished.json()["scene"], "curtain");
}

#[test]
fn simulate_gives_up_a_long_step_and_finishes_its_file() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("heavy.toml", HEAVY);
    let file = sandbox.path("heavy.mcap");
    let args = ["simulate", &scene, "--steps", "100", "-o", &file, "--json"];
    let simulation = Process::start(Program::Recorder, &sandbox, &args);
    wait_for("the beginning of the file", || {
        Path::new(&format!("{file}.part")).exists().then_some(())
    });
    simulation.signal(Signal::TERM);
    let finished = simulation.wait();
    assert_eq!(finished.code, Some(3), "{}", finished.stderr);
    let summary: serde_json::Value = serde_json::from_str(&finished.stdout).unwrap();
    assert_eq!(summary["steps"], 0);
    let info = Process::run(Program::Recorder, &sandbox, &["info", &file, "--json"]);
    assert_eq!(info.code, Some(0), "{}", info.stderr);
}

#[test]
fn a_hangup_ends_every_program_as_sigterm_does() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let start = |program, args: &[&str]| Process::start_ready(program, &sandbox, args);
    let node = start(Program::SimNode, &["run", "curtain"]);
    let bridge = start(Program::ViewerBridge, &["--listen", "127.0.0.1:0"]);
    let recorder = start(Program::Recorder, &["record", "-o", &file]);
    wait_for("a recording", || {
        let part = fs::metadata(format!("{file}.part")).ok()?;
        (part.len() > 50_000).then_some(())
    });
    for process in [recorder, bridge, node] {
        // A closed terminal sends it twice: from the shell, and from the kernel.
        process.signal(Signal::HUP);
        process.signal(Signal::HUP);
        let finished = process.wait();
        assert_eq!(finished.code, Some(0), "{}", finished.stderr);
    }
    Process::run(Program::Recorder, &sandbox, &["info", &file]).success();
}
