//! The units of systemd: their command lines work, and systemd accepts them.

use std::path::Path;

use integration_tests::{Process, Program, Sandbox, ctl};

const NODE: &str = include_str!("../../../packaging/systemd/catenary@.service");
const RECORDER: &str = include_str!("../../../packaging/systemd/catenary-recorder.service");

/// Folder of the programs in the units.
const INSTALLED: &str = "/usr/local/bin/";

/// Returns the arguments that a unit gives to a program, for the instance `curtain`.
fn arguments<'a>(unit: &'a str, program: &str) -> Vec<&'a str> {
    let start = format!("ExecStart={INSTALLED}{program} ");
    let line = unit.lines().find_map(|line| line.strip_prefix(&start)).unwrap();
    line.split(' ').map(|word| if word == "%i" { "curtain" } else { word }).collect()
}

#[test]
fn the_command_lines_of_the_units_run_a_node_and_record_it() {
    let sandbox = Sandbox::new();
    let output = sandbox.path("run.mcap");
    let args = [arguments(RECORDER, "recorder"), vec!["-o", &output]].concat();
    // The recorder may start first.
    let mut recorder = Process::start(Program::Recorder, &sandbox, &args);
    let node = Process::start_ready(Program::SimNode, &sandbox, &arguments(NODE, "sim-node"));
    recorder.wait_for_line("recording from step ");
    assert_eq!(ctl(&sandbox, &["status"])["scene"], "curtain");
    node.interrupt().success();
    recorder.interrupt().recorded();
    let verified = ["verify", &sandbox.path("run_0000.mcap")];
    assert!(
        Process::run(Program::Recorder, &sandbox, &verified).success().contains("bit-identical")
    );
    // After a restart, the ring goes on.
    let mut recorder = Process::start(Program::Recorder, &sandbox, &args);
    recorder.wait_for_line("the ring goes on after ");
    let node = Process::start_ready(Program::SimNode, &sandbox, &arguments(NODE, "sim-node"));
    recorder.wait_for_line("recording from step ");
    node.interrupt().success();
    recorder.interrupt().recorded();
    assert!(Path::new(&sandbox.path("run_0001.mcap")).exists());
}

#[test]
#[ignore = "needs systemd-analyze"]
fn systemd_accepts_the_units() {
    let sandbox = Sandbox::new();
    let folder = Program::SimNode.path().parent().unwrap().display().to_string() + "/";
    for (name, unit) in [("catenary@.service", NODE), ("catenary-recorder.service", RECORDER)] {
        // The pages of the manual are not installed.
        let lines = unit.lines().filter(|line| !line.starts_with("Documentation="));
        let unit = lines.collect::<Vec<_>>().join("\n").replace(INSTALLED, &folder);
        let file = sandbox.write(name, &(unit + "\n"));
        let verified = Process::run(Program::SystemdAnalyze, &sandbox, &["verify", &file]);
        assert_eq!((verified.code, verified.stderr.as_str()), (Some(0), ""), "{name}");
    }
}
