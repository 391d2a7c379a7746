//! Forces reach other processes: a hanging rope pulls its pin with its weight, in Rust, in `ctl forces`, in a
//! recording and in its replay. A node computes them only while a program reads them, with the same bits.

use std::path::Path;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, ctl, wait_for};
use recording::{ForcesRow, LogReader, Message};
use sim_contract::{Action, Client, ForceKind, Forces};

const RATE_HZ: u32 = 240;
/// 20 free masses below a pin, and a floor that they do not reach.
const WEIGHT: f64 = 20.0 * 0.02 * 9.81;
const ROPE: &str = r#"
version = 1
name = "hanging"
[solver]
rate_hz = 240
substeps = 4
damping = 2
[[collider]]
shape = "plane"
normal = [0, 1, 0]
offset = 0
[[generate]]
shape = "rope"
count = 21
mass = 0.02
from = [0, 2, 0]
to = [0, 1, 0]
"#;
/// Steps after which the rope hangs still.
const SETTLED: u64 = 20 * RATE_HZ as u64;

fn node(sandbox: &Sandbox, extra: &[&str]) -> Process {
    let scene = sandbox.write("hanging.toml", ROPE);
    let args: Vec<_> = ["run", &scene].iter().chain(extra).copied().collect();
    Process::start_ready(Program::SimNode, sandbox, &args)
}

fn pull(forces: &Forces) -> [f64; 3] {
    forces.force(forces.row(ForceKind::Particle, 0).unwrap())
}

fn assert_pulls_with_its_weight(force: [f64; 3]) {
    let [x, y, z] = force;
    assert!((y + WEIGHT).abs() <= 1e-3 * WEIGHT, "{y} N of {}", -WEIGHT);
    assert!(x.abs() + z.abs() <= 1e-3 * WEIGHT, "{x} {z}");
}

fn rows(file: &str) -> Vec<ForcesRow> {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let mut rows = Vec::new();
    while let Some(logged) = log.next_message().unwrap() {
        if let Message::Forces(row) = logged.message {
            rows.push(row);
        }
    }
    rows
}

#[test]
fn a_hanging_rope_pulls_its_pin_with_its_weight_in_each_step_of_the_lockstep() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["--paused", "--as-fast-as-possible"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    assert_eq!(client.forces(Duration::ZERO).unwrap(), None, "it is paused");
    client.join_lockstep(DEADLINE).unwrap();
    ctl(&sandbox, &["resume"]);
    let mut steps = Vec::new();
    while steps.len() < 100 {
        let snapshot = client.next_turn(DEADLINE).unwrap().unwrap();
        let header = *snapshot.header();
        if header.step >= SETTLED {
            let forces = client.forces_of(&header, DEADLINE).unwrap().unwrap();
            assert_eq!((forces.header.step, forces.header.rate_hz), (header.step, RATE_HZ));
            assert_pulls_with_its_weight(pull(&forces));
            let floor = forces.row(ForceKind::Collider, 0).unwrap();
            assert_eq!((floor.impulse, floor.contacts), ([0.0; 3], 0));
            assert_eq!(forces.rows.len(), 2);
            steps.push(header.step);
        }
        client.ready().unwrap();
    }
    assert!(steps.windows(2).all(|pair| pair[1] == pair[0] + 1), "{steps:?}");
}

#[test]
fn ctl_prints_the_forces_of_a_node_and_says_why_there_are_none() {
    let sandbox = Sandbox::new();
    let node = node(&sandbox, &["--as-fast-as-possible"]);
    wait_for("a rope at rest", || {
        (ctl(&sandbox, &["status"])["step"].as_u64() >= Some(SETTLED)).then_some(())
    });
    let forces = ctl(&sandbox, &["forces"]);
    let pin = &forces["particles"][0];
    assert_eq!((&pin["index"], &pin["flags"]), (&0.into(), &serde_json::json!(["pinned"])));
    let force = [0, 1, 2].map(|axis: usize| pin["force"][axis].as_f64().unwrap());
    assert_pulls_with_its_weight(force);
    assert_eq!(forces["colliders"][0]["shape"], "plane");
    assert_eq!(forces["rate_hz"], RATE_HZ);
    let text = Process::run(Program::SimNode, &sandbox, &["ctl", "forces"]).success();
    assert!(
        text.contains("particle 0") && text.contains("-3.92") && text.contains("pinned"),
        "{text}"
    );

    // A particle that is pinned later needs another row.
    ctl(&sandbox, &["pin", "20"]);
    assert_eq!(ctl(&sandbox, &["forces"])["particles"].as_array().unwrap().len(), 2);

    ctl(&sandbox, &["pause"]);
    let paused = Process::run(Program::SimNode, &sandbox, &["ctl", "forces", "--timeout", "200ms"]);
    assert_eq!(paused.code, Some(1));
    assert!(
        paused.stderr.contains("it is paused") && paused.stderr.contains("ctl step"),
        "{paused:?}"
    );
    drop(node);
    let none = Process::run(Program::SimNode, &sandbox, &["ctl", "forces"]);
    assert_eq!(none.code, Some(1));
    assert!(none.stderr.contains("no node runs as"), "{none:?}");
}

#[test]
fn recorded_forces_are_proved_simulated_again_and_played() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("live.mcap");
    let node = node(&sandbox, &["--paused", "--as-fast-as-possible"]);
    let args = ["record", "-o", &file, "--forces", "--lockstep"];
    let recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    ctl(&sandbox, &["step", "300"]);
    wait_for("300 steps", || (ctl(&sandbox, &["status"])["step"] == 300).then_some(()));
    recording.signal(Signal::TERM);
    recording.wait().recorded();
    drop(node);
    let recorded = rows(&file);
    let steps: Vec<_> = recorded.iter().map(|row| row.step).collect();
    assert_eq!(steps, (1..=300).collect::<Vec<_>>());
    assert!(recorded.iter().all(|row| row.particles == [0] && row.colliders.len() == 1));
    let recorder = |args: &[&str]| Process::run(Program::Recorder, &sandbox, args);
    recorder(&["verify", &file]).success();
    recorder(&["check", &file]).success();
    let info: serde_json::Value = recorder(&["info", &file, "--json"]).json();
    assert_eq!(info["messages"]["/forces"], 300);

    let (again, complete) = (sandbox.path("again.mcap"), sandbox.path("complete.mcap"));
    let scene = sandbox.path("hanging.toml");
    recorder(&["simulate", &scene, "--steps", "300", "--forces", "-o", &again]).success();
    assert_eq!(rows(&again), recorded);
    recorder(&["simulate", &file, "-o", &complete]).success();
    assert_eq!(rows(&complete), recorded);
    let plain = sandbox.path("plain.mcap");
    recorder(&["simulate", &scene, "--steps", "300", "-o", &plain]).success();
    assert_eq!(rows(&plain), []);
    let refused = recorder(&["simulate", &file, "--forces"]);
    assert!(refused.code == Some(2) && refused.stderr.contains("--steps"), "{refused:?}");

    let played = sandbox.path("played.mcap");
    let play = ["play", &again, "--rate", "max", "--wait-for-readers", "1"];
    let player = Process::start_ready(Program::Recorder, &sandbox, &play);
    let args = ["record", "-o", &played, "--forces", "--lockstep"];
    Process::run(Program::Recorder, &sandbox, &args).recorded();
    player.wait().success();
    assert_eq!(rows(&played), recorded);
}

#[test]
fn a_paused_replay_with_forces_names_its_pause() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let recorder = |args: &[&str]| Process::run(Program::Recorder, &sandbox, args);
    recorder(&["simulate", "rope", "--steps", "240", "--forces", "-o", &file]).success();
    let args = ["play", &file, "--loop"];
    let _player = Process::start_ready(Program::Recorder, &sandbox, &args);
    ctl(&sandbox, &["pause"]);
    let forces = Process::run(Program::SimNode, &sandbox, &["ctl", "forces", "--timeout", "200ms"]);
    assert_eq!(forces.code, Some(1));
    assert!(forces.stderr.contains("the replay is paused"), "{forces:?}");
    ctl(&sandbox, &["resume"]);
    assert_eq!(ctl(&sandbox, &["forces"])["particles"].as_array().unwrap().len(), 1);
}

#[test]
fn a_node_computes_no_forces_for_a_killed_reader() {
    for is_killed in [false, true] {
        let sandbox = Sandbox::new();
        let _node = node(&sandbox, &[]);
        let file = sandbox.path("live.mcap");
        let args = ["record", "-o", &file, "--forces"];
        let mut recording = Process::start_ready(Program::Recorder, &sandbox, &args);
        recording.wait_for_line("recording from step ");
        // A program that attaches later would free the place of the killed one.
        let mut client = Client::attach(&sandbox.endpoint()).unwrap();
        if is_killed {
            recording.signal(Signal::KILL);
        }
        // The node looks for living readers once a second.
        let first = client.status(DEADLINE).unwrap().unwrap().step;
        while client.status(DEADLINE).unwrap().unwrap().step < first + 3 * u64::from(RATE_HZ) {}
        assert!(client.request(Action::Pause, DEADLINE).unwrap().is_applied());
        let latched = client.forces(Duration::from_millis(200)).unwrap();
        assert_eq!(latched.is_none(), is_killed, "{latched:?}");
        assert!(client.request(Action::Resume, DEADLINE).unwrap().is_applied());
        let step = latched.map_or(0, |forces| forces.header.step);
        while client.forces(DEADLINE).unwrap().unwrap().header.step <= step {}
    }
}

#[test]
fn a_live_body_stands_without_a_command_and_the_status_counts_it() {
    let sandbox = Sandbox::new();
    let scene = "version = 1\n[[collider]]\nshape = \"sphere\"\ncenter = [0, 0, 0]\nradius = 0.1\n\
                 body = { mass = 1, inertia = [0.004, 0.004, 0.004] }\n\
                 [[collider]]\nshape = \"sphere\"\ncenter = [1, 0, 0]\nradius = 0.1\n";
    let scene = sandbox.write("ball.toml", scene);
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene]);
    assert_eq!(ctl(&sandbox, &["status"])["standing_body_steps"], 0);
    let drive = ["drive-body", "0", "0", "2", "0", "--velocity", "2.4", "0", "0"];
    assert_eq!(ctl(&sandbox, &drive)["status"], "applied");
    let counted = wait_for("steps in which it stands", || {
        let counted = ctl(&sandbox, &["status"])["standing_body_steps"].as_u64().unwrap();
        (counted > 20).then_some(counted)
    });
    let step = ctl(&sandbox, &["hash"])["step"].as_u64().unwrap();
    assert!(counted < step, "{counted} of {step} steps");
    // It fell and moved for one step of 1/240 s, and has stood there since.
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let ball = client.colliders(DEADLINE).unwrap().colliders[0];
    assert!((ball.center[0] - 0.01).abs() < 1e-6, "{:?}", ball.center);
    assert!((ball.center[1] - 2.0).abs() < 2e-4, "{:?}", ball.center);
    assert_eq!(ball.velocity, [0.0; 3]);
    let status = Process::run(Program::SimNode, &sandbox, &["ctl", "status"]).stdout;
    assert!(status.contains("bodies         stood in "), "{status}");
    for (collider, problem) in [
        ("1", "the collider is no body; the scene makes it one with body = { mass, inertia }"),
        ("2", "allowed: 0 to 1"),
    ] {
        let line = ["ctl", "drive-body", collider, "0", "0", "0"];
        let done = Process::run(Program::SimNode, &sandbox, &line);
        assert_eq!(done.code, Some(4), "{}", done.stderr);
        assert!(done.stdout.contains(problem), "{}", done.stdout);
    }
}
