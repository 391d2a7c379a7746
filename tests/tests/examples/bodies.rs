//! Bodies of rapier3d, a process of their own, fall on a net of a node, push its curtain aside and come to rest:
//! the example `bodies`. The node's recording repeats them from the commands alone.

use std::path::Path;

use integration_tests::{Process, Program, Sandbox, ctl};
use recording::{LogReader, Message};
use serde_json::Value;

const SCENE: &str = include_str!("../../../examples/bodies/bodies.toml");
/// First particle of the curtain, after those of the net.
const CURTAIN: usize = 29 * 17;

/// Runs the example for a number of steps, recorded into `file`. Returns its report.
fn run(sandbox: &Sandbox, damping: u32, steps: u64, file: &str) -> Value {
    let scene = sandbox.write("scene.toml", &with_damping(damping));
    // The node waits for the bodies before its last step.
    let last = (steps + 1).to_string();
    let args = ["run", &scene, "--paused", "--as-fast-as-possible", "--steps", &last];
    let mut node = Process::start_ready(Program::SimNode, sandbox, &args);
    let record = ["record", "--lockstep", "--forces", "-o", file];
    let recorder = Process::start_ready(Program::Recorder, sandbox, &record);
    let bodies = Process::start_ready(Program::Bodies, sandbox, &["--steps", &steps.to_string()]);
    ctl(sandbox, &["resume"]);
    let report = bodies.wait();
    assert_eq!(report.code, Some(0), "{}", report.stderr);
    node.wait_for_line("done: ");
    let recorded = recorder.wait();
    assert_eq!(recorded.code, Some(0), "{}", recorded.stderr);
    report.json()
}

fn with_damping(damping: u32) -> String {
    assert!(SCENE.contains("damping = 1\n"));
    SCENE.replace("damping = 1\n", &format!("damping = {damping}\n"))
}

fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key}: {report}"))
}

/// Greatest distance from the plane of the curtain that a particle of it has in a recording.
fn curtain_deflection(file: &str) -> f32 {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let mut deflection = 0.0;
    while let Some(logged) = log.next_message().unwrap() {
        if let Message::Particles { particles, .. } = logged.message {
            let distances = particles[CURTAIN..].iter().map(|one| one.position[0].abs());
            deflection = distances.fold(deflection, f32::max);
        }
    }
    deflection
}

#[test]
fn both_processes_keep_momentum_and_energy_and_repeat_every_bit() {
    let sandbox = Sandbox::new();
    let steps = 720;
    let [first, again] = ["first.mcap", "again.mcap"].map(|name| sandbox.path(name));
    let report = run(&sandbox, 0, steps, &first);
    assert_eq!(report["steps"], steps);
    // They fall, hit the net and roll into the curtain. Undamped, all momentum is accounted for.
    assert!(number(&report, "momentum_error_N_s") < 1e-5, "{report}");
    // 2.9 kg fall by 0.4 m and more.
    assert!(number(&report, "energy_rise_J") < 0.1, "{report}");
    assert!(curtain_deflection(&first) > 0.1, "nothing pushed the curtain");
    assert_eq!(run(&sandbox, 0, steps, &again)["state_hash"], report["state_hash"]);
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &first]);
    assert_eq!(verified.code, Some(0), "{}{}", verified.stdout, verified.stderr);
    assert!(verified.stdout.contains("721 steps bit-identical"), "{}", verified.stdout);
}

#[test]
fn the_bodies_come_to_rest_in_the_net() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("rest.mcap");
    let report = run(&sandbox, 1, 4800, &file);
    assert!(number(&report, "energy_rise_J") < 0.1, "{report}");
    assert!(number(&report, "speed_m_per_s") < 0.05, "{report}");
    assert!(number(&report, "height_m") > -0.6, "one has left the net: {report}");
}
