//! The energy of a state reaches other processes where they ask for it: `ctl status`, recordings and their proof,
//! `recorder info` and a table.

use std::path::Path;

use integration_tests::{Process, Program, Sandbox, ctl};
use recording::{EnergyRow, LogReader, Message};
use serde_json::Value;

/// A particle of 2 kg at rest on a spring of 500 N/m, longer by m g / k, and one of 3 kg that falls.
const SCENE: &str = r#"
version = 1
name = "spring"
[solver]
rate_hz = 240
substeps = 4
[[particle]]
position = [0, 0, 0]
pinned = true
[[particle]]
position = [0, -1.03924, 0]
mass = 2
[[particle]]
position = [5, 0, 0]
mass = 3
[[constraint]]
particles = [0, 1]
rest_length = 1
compliance = 0.002
"#;

/// Asserts the energy of a step against the closed forms.
fn assert_energy(step: u64, EnergyRow { kinetic, potential, elastic }: EnergyRow) {
    let (g, stretch, time_s) = (9.81, 2.0 * 9.81 / 500.0, step as f64 / 240.0);
    let near = |name: &str, expected: f64, actual: f64, tolerance: f64| {
        assert!(
            (expected - actual).abs() <= tolerance,
            "{name}: {actual} for {expected} in {step}"
        );
    };
    let speed = g * time_s;
    // The fall of a step of the length h is h v / 2 longer than the exact one.
    let fall = 0.5 * g * time_s * time_s + speed / (2.0 * 240.0 * 4.0);
    near("elastic", 0.5 * 500.0 * stretch * stretch, elastic, 1e-3);
    near("kinetic", 0.5 * 3.0 * speed * speed, kinetic, 1e-3);
    near("potential", -g * (2.0 * (1.0 + stretch) + 3.0 * fall), potential, 2e-3);
}

/// The recorded energies by step.
fn recorded(file: &str) -> Vec<(u64, Option<EnergyRow>)> {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let mut rows = Vec::new();
    while let Some(logged) = log.next_message().unwrap() {
        if let Message::Step(row) = logged.message {
            rows.push((row.step, row.energy));
        }
    }
    rows
}

fn recorder(sandbox: &Sandbox, args: &[&str]) -> String {
    Process::run(Program::Recorder, sandbox, args).success()
}

#[test]
fn a_status_has_the_energy_of_the_newest_state_if_it_is_asked_for() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("spring.toml", SCENE);
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene, "--paused"]);
    for steps in [0, 120] {
        if steps > 0 {
            ctl(&sandbox, &["step", "120"]);
        }
        let status = ctl(&sandbox, &["status", "--energy"]);
        assert_eq!(status["energy"]["step"], steps);
        assert_energy(steps, serde_json::from_value(status["energy"].clone()).unwrap());
    }
    assert_eq!(ctl(&sandbox, &["status"])["energy"], Value::Null);
    let text = Process::run(Program::SimNode, &sandbox, &["ctl", "status", "--energy"]).success();
    let line = text.lines().find(|line| line.starts_with("energy")).unwrap();
    assert!(line.contains("J in step 120: ") && line.contains(" elastic"), "{line}");
    node.interrupt().success();
}

#[test]
fn a_recording_has_the_energy_of_each_step_and_is_proved_with_it() {
    let sandbox = Sandbox::new();
    let scene = sandbox.write("spring.toml", SCENE);
    let (live, simulated) = (sandbox.path("live.mcap"), sandbox.path("simulated.mcap"));
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", &scene, "--paused"]);
    let args = ["record", "-o", &live, "--energy", "--steps", "60"];
    let recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    ctl(&sandbox, &["step", "60"]);
    recording.wait().success();
    node.interrupt().success();
    let args = ["simulate", &scene, "--steps", "60", "--energy", "-o", &simulated];
    recorder(&sandbox, &args);
    let rows = recorded(&live);
    assert_eq!(rows, recorded(&simulated));
    assert_eq!(rows.len(), 61);
    for (step, energy) in rows {
        assert_energy(step, energy.unwrap());
    }
    for file in [&live, &simulated] {
        let verdict = recorder(&sandbox, &["verify", file]);
        assert!(verdict.contains("bit-identical"), "{verdict}");
    }
}

#[test]
fn the_energy_of_a_recording_without_it_is_measured() {
    let sandbox = Sandbox::new();
    // Commands change what the energy depends on.
    let commands = sandbox.write(
        "commands.jsonl",
        "{\"step\":10,\"kind\":\"set\",\"parameter\":\"gravity\",\"value\":[0,-1.6,0]}\n\
         {\"step\":20,\"kind\":\"cut\",\"constraint\":100}\n\
         {\"step\":30,\"kind\":\"set\",\"parameter\":\"compliance\",\"value\":0.001}\n",
    );
    let (with, without) = (sandbox.path("with.mcap"), sandbox.path("without.mcap"));
    let simulate = ["simulate", "curtain", "--steps", "60", "--commands", &commands, "-o"];
    recorder(&sandbox, &[&simulate[..], &[&with, "--energy"]].concat());
    recorder(&sandbox, &[&simulate[..], &[&without]].concat());
    assert!(recorded(&without).iter().all(|(_, energy)| energy.is_none()));
    let tables =
        [&with, &without].map(|file| recorder(&sandbox, &["export", file, "--energy", "-"]));
    assert_eq!(tables[0], tables[1]);
    let mut lines = tables[0].lines();
    assert_eq!(lines.next(), Some("step,time_s,kinetic,potential,elastic,total"));
    for (line, (step, energy)) in lines.zip(recorded(&with)) {
        let EnergyRow { kinetic, potential, elastic } = energy.unwrap();
        let total = kinetic + potential + elastic;
        let expected = [step as f64, step as f64 / 240.0, kinetic, potential, elastic, total];
        let found: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert_eq!(found, expected);
        assert_eq!(elastic > 0.0, step >= 30, "soft from step 30 on: {line}");
    }
    let reports = [&with, &without]
        .map(|file| recorder(&sandbox, &["info", file, "--energy", "--json"]))
        .map(|text| serde_json::from_str::<Value>(&text).unwrap());
    assert_eq!(reports[0], reports[1]);
    assert_eq!(
        (&reports[0]["first"]["step"], &reports[0]["last"]["step"]),
        (&0.into(), &60.into())
    );
    assert!(reports[0]["total_min"].as_f64() < reports[0]["total_max"].as_f64());
    let text = recorder(&sandbox, &["info", &with, "--energy"]);
    assert!(text.starts_with("in J ") && text.contains("step 60"), "{text}");
}

#[test]
fn the_energy_of_a_recording_of_commands_is_the_recorded_one() {
    let sandbox = Sandbox::new();
    let commands = sandbox.path("commands.mcap");
    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain", "--paused"]);
    let args = ["record", "-o", &commands, "--steps", "30", "--only-commands", "--energy"];
    let recording = Process::start_ready(Program::Recorder, &sandbox, &args);
    ctl(&sandbox, &["step", "30"]);
    recording.wait().success();
    node.interrupt().success();
    let text = recorder(&sandbox, &["info", &commands, "--energy"]);
    assert!(text.contains("step 30"), "{text}");
}
