//! The examples of the contract work against a running node, and report errors as text.

use integration_tests::{Process, Program, Sandbox};

#[test]
fn watch_prints_the_requested_number_of_snapshots() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let printed = Process::run(Program::Watch, &sandbox, &["25"]).success();
    let steps = printed.lines().map(|line| {
        assert!(line.contains(": 168 particles, lowest "), "{line}");
        line.split([' ', ':']).nth(1).unwrap().parse::<u64>().unwrap()
    });
    let steps: Vec<_> = steps.collect();
    assert_eq!(steps.len(), 25);
    assert!(steps.is_sorted_by(|one, next| one < next), "{steps:?}");
}

#[test]
fn grab_moves_and_releases_a_particle() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let printed = Process::run(Program::Grab, &sandbox, &["90"]).success();
    assert!(printed.starts_with("released at step "), "{printed}");
    let status = Process::run(Program::SimNode, &sandbox, &["ctl", "status", "--json"]).json();
    // One grab, 120 moves and one release, all applied.
    assert_eq!(
        (status["outcomes"].as_u64(), status["rejected_commands"].as_u64()),
        (Some(122), Some(0))
    );
}

#[test]
fn hold_brings_a_pendulum_to_rest() {
    let sandbox = Sandbox::new();
    let args = ["run", "pendulum", "--as-fast-as-possible"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let printed = Process::run(Program::Hold, &sandbox, &["4800"]).success();
    let speed = printed.strip_prefix("the mass moves at ").and_then(|rest| rest.split(' ').next());
    // It swings at 3 m/s without control.
    assert!(speed.unwrap().parse::<f32>().unwrap() < 0.001, "{printed}");
}

#[test]
fn watch_prints_its_usage() {
    let printed = Process::run(Program::Watch, &Sandbox::new(), &["--help"]).success();
    assert!(printed.starts_with("Usage: watch "), "{printed}");
}

#[test]
fn the_examples_name_the_allowed_particles_and_the_scene_that_they_need() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let grab = Process::run(Program::Grab, &sandbox, &["9000"]);
    assert_eq!(grab.stderr, "error: no such particle (allowed: 0 to 167)\n");
    let hold = Process::run(Program::Hold, &sandbox, &[]);
    assert_eq!(
        hold.stderr,
        "error: the scene is no pendulum: `sim-node ctl load pendulum` loads one\n"
    );
}

#[test]
fn the_examples_stay_short() {
    for source in [
        include_str!("../../../sim-node/contract/examples/watch.rs"),
        include_str!("../../../sim-node/contract/examples/grab.rs"),
        include_str!("../../../sim-node/contract/examples/hold.rs"),
    ] {
        assert!(source.lines().count() <= 50);
    }
}

#[test]
fn the_examples_end_with_the_text_of_an_error() {
    let sandbox = Sandbox::new();
    for program in [Program::Watch, Program::Grab, Program::Hold] {
        let finished = Process::run(program, &sandbox, &[]);
        assert_eq!(finished.code, Some(1));
        assert!(finished.stderr.starts_with("error: "), "{}", finished.stderr);
        assert!(!finished.stderr.contains(['"', '{']), "{}", finished.stderr);
    }
}
