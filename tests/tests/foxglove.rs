//! The Foxglove server, end to end: clients receive the bits that the node publishes, and their commands
//! show in the snapshots of the node. The tests with the official client need the packages that
//! `.ci/run` installs.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, wait_for};
use recording::{FrameReader, LogReader};
use serde_json::{Value, json};
use sim_contract::{Client as Reader, ParticleFlags, ParticleState};

use crate::foxglove_client::Client;

/// A paused node with the curtain scene, and a bridge that serves it. They end in the order of the fields: a bridge
/// that outlives its domain would make it again.
struct Setup {
    url: String,
    node: Reader,
    _bridge: Process,
    _node: Process,
    sandbox: Sandbox,
}

impl Setup {
    fn start(options: &[&str]) -> Self {
        let sandbox = Sandbox::new();
        let args = ["run", "curtain", "--paused"];
        let process = Process::start_ready(Program::SimNode, &sandbox, &args);
        let args = [&["--listen", "127.0.0.1:0", "--foxglove", "127.0.0.1:0"], options].concat();
        let mut bridge = Process::start(Program::ViewerBridge, &sandbox, &args);
        let url = bridge.wait_for_line("foxglove ws://").replace("foxglove ", "");
        let node = Reader::attach(&sandbox.endpoint()).unwrap();
        Self { url, node, _bridge: bridge, _node: process, sandbox }
    }

    /// Returns the newest state.
    fn particles(&self) -> Vec<ParticleState> {
        // A new reader, because a reader receives each state only once.
        let mut node = Reader::attach(&self.sandbox.endpoint()).unwrap();
        node.latest_snapshot(DEADLINE).unwrap().unwrap().particles().to_vec()
    }

    /// Waits for a state in which a condition holds for a particle.
    fn wait_for_particle(&mut self, particle: usize, is_so: impl Fn(&ParticleState) -> bool) {
        wait_for("a state of a particle", || {
            let snapshot = self.node.latest_snapshot(Duration::from_millis(100)).unwrap()?;
            is_so(&snapshot.particles()[particle]).then_some(())
        });
    }

    /// Runs the official client in `tests/node`, and returns its report.
    fn run_client(&self, what: &str) -> Value {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("node/foxglove.js");
        let args = [script.to_str().unwrap(), &self.url, what];
        Process::run(Program::Node, &self.sandbox, &args).json()
    }
}

/// Parses an array of numbers. JavaScript writes whole numbers without a decimal point.
fn numbers(array: &Value) -> Vec<f64> {
    serde_json::from_value(array.clone()).unwrap_or_else(|error| panic!("{error} in {array}"))
}

/// Returns one value of every particle.
fn column(particles: &[ParticleState], value: impl Fn(&ParticleState) -> f32) -> Vec<f64> {
    particles.iter().map(|particle| f64::from(value(particle))).collect()
}

#[test]
fn a_client_receives_the_bits_of_the_snapshot() {
    let setup = Setup::start(&[]);
    let (mut client, _) = Client::start(&setup.url);
    client.subscribe(1, "/particles");
    let (_, message) = client.message(1);
    client.subscribe(2, "/steps");
    let particles = setup.particles();
    assert_eq!(particles.len(), 168);
    assert!(message.ends_with(bytemuck::cast_slice::<_, u8>(&particles)));
    assert_eq!(client.json(2)["step"], 0);
}

#[test]
fn a_client_receives_constraints_triangles_and_colliders_whenever_it_subscribes() {
    let mut setup = Setup::start(&["--allow-commands"]);
    let (mut client, _) = Client::start(&setup.url);
    let topology = setup.node.topology(DEADLINE).unwrap().unwrap();
    client.subscribe(1, "/topology");
    let row = client.json(1);
    let column = |name: &str| serde_json::from_value::<Vec<f64>>(row[name].clone()).unwrap();
    let ends: Vec<_> = topology.constraints.iter().map(|one| f64::from(one.b)).collect();
    let lengths: Vec<_> =
        topology.constraints.iter().map(|one| f64::from(one.rest_length)).collect();
    assert_eq!((column("b"), row["revision"].as_u64()), (ends, Some(0)));
    assert!(column("rest_length").iter().zip(&lengths).all(|(a, b)| (a - b).abs() < 1e-7));
    client.subscribe(2, "/surface");
    assert_eq!(client.json(2)["triangles"].as_array().unwrap().len(), 3 * 13 * 11 * 2);
    // Another scene is sent to the subscribers.
    client.advertise(1, "/commands");
    client.subscribe(3, "/colliders");
    client.publish(1, &json!({ "kind": "load", "scene": "ragdoll" }));
    let row = client.json(1);
    assert_eq!(row["a"].as_array().unwrap().len(), 20, "{row}");
    assert_eq!(client.json(2)["triangles"], json!([]));
    while client.json(3)["colliders"].as_array().is_none_or(Vec::is_empty) {}
}

#[test]
fn a_client_may_advertise_any_topic_but_publish_only_commands() {
    let setup = Setup::start(&["--allow-commands"]);
    let first_error = |topic: &str| {
        let (mut client, _) = Client::start(&setup.url);
        client.advertise(1, "/move_base_simple/goal");
        client.advertise(2, "/commands");
        client.publish(if topic == "/commands" { 2 } else { 1 }, &json!({ "kind": "jump" }));
        client.text("status")["message"].as_str().unwrap().to_owned()
    };
    let error = first_error("/commands");
    assert!(error.contains("jump"), "{error}");
    let error = first_error("/move_base_simple/goal");
    assert_eq!(error, "this server only accepts /commands, not /move_base_simple/goal");
}

#[test]
fn a_push_of_a_client_moves_the_particles_in_its_sphere() {
    let mut setup = Setup::start(&["--allow-commands"]);
    let (mut client, _) = Client::start(&setup.url);
    client.advertise(1, "/commands");
    let [x, y, z] = setup.particles()[90].position;
    let push =
        json!({ "kind": "push", "center": [x, y, z], "radius": 0.05, "delta": [0, 0, 0.05] });
    client.publish(1, &push);
    client.publish(1, &json!({ "kind": "step", "count": 1 }));
    setup.wait_for_particle(90, |particle| particle.position[2] > z + 0.02);
}

#[test]
fn a_particle_follows_the_grab_of_a_client_and_is_released_when_the_client_disconnects() {
    let mut setup = Setup::start(&["--allow-commands"]);
    let (mut client, _) = Client::start(&setup.url);
    client.advertise(1, "/commands");
    let grab = json!({ "kind": "grab", "particle": 90, "target": [0.2, 0.5, 0.5], "over_s": 0.01 });
    client.publish(1, &json!({ "kind": "resume" }));
    client.publish(1, &grab);
    let is_grabbed = |particle: &ParticleState| particle.flags & ParticleFlags::GRABBED != 0;
    setup.wait_for_particle(90, |particle| {
        is_grabbed(particle) && particle.position == [0.2, 0.5, 0.5]
    });
    drop(client);
    setup.wait_for_particle(90, |particle| !is_grabbed(particle));
}

#[test]
fn a_client_can_seek_in_a_recording() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let args = ["simulate", "curtain", "--steps", "480", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let args = ["--listen", "127.0.0.1:0", "--foxglove", "127.0.0.1:0", "--replay", &file];
    let mut bridge = Process::start(Program::ViewerBridge, &sandbox, &args);
    let url = bridge.wait_for_line("foxglove ws://").replace("foxglove ", "");
    let (mut client, server) = Client::start(&url);
    assert!(server["capabilities"].as_array().unwrap().contains(&json!("playbackControl")));
    client.subscribe(1, "/particles");
    client.subscribe(2, "/steps");
    let mut frames = FrameReader::new(LogReader::open(Path::new(&file)).unwrap());
    let run = frames.log().run().clone();
    let mut states = BTreeMap::new();
    while let Some(frame) = frames.next_frame().unwrap() {
        states.insert(frame.row.step, frame.particles.unwrap());
    }
    for step in [300, 1, 480, 299] {
        let time_ns = run.time_of_step_ns(step);
        client.play(1, 1.0, Some(time_ns), &format!("to step {step}"));
        // The header of the step comes first.
        while client.json(2)["step"] != step {}
        let (at_ns, payload) = client.message(1);
        assert_eq!(at_ns, time_ns);
        assert!(payload.ends_with(bytemuck::cast_slice::<_, u8>(&states[&step])), "step {step}");
    }
}

#[test]
fn a_recording_plays_again_and_again_for_viewers_that_cannot_control_it() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let args = ["simulate", "curtain", "--steps", "60", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let args = ["--listen", "127.0.0.1:0", "--foxglove", "127.0.0.1:0", "--replay", &file];
    let args = [&args[..], &["--play"]].concat();
    let mut bridge = Process::start(Program::ViewerBridge, &sandbox, &args);
    let url = bridge.wait_for_line("foxglove ws://").replace("foxglove ", "");
    let (mut client, _) = Client::start(&url);
    client.subscribe(1, "/steps");
    let mut next_step = || client.json(1)["step"].as_u64().unwrap();
    let (mut newest, mut round_count) = (next_step(), 0);
    while round_count < 3 {
        let step = next_step();
        round_count += u32::from(step < newest);
        newest = step;
    }
}

#[test]
fn invalid_options_are_refused_with_the_reason() {
    let sandbox = Sandbox::new();
    for (options, reason) in [
        (&["--foxglove", "0.0.0.0:8765"][..], "ssh -L"),
        (&["--foxglove", "here"], "127.0.0.1:8765"),
        (&["--allow-commands"], "--foxglove"),
        (&["--play"], "--replay"),
        (&["--foxglove-origin", "https://viewer.example"], "--foxglove"),
    ] {
        let ended = Process::run(Program::ViewerBridge, &sandbox, options);
        assert_eq!(ended.code, Some(2), "{options:?}");
        assert!(ended.stderr.contains(reason), "{}", ended.stderr);
    }
}

#[test]
#[ignore = "needs Node"]
fn the_official_client_decodes_the_published_state() {
    let setup = Setup::start(&[]);
    let report = setup.run_client("read");
    let particles = setup.particles();
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        assert_eq!(numbers(&report[name]), column(&particles, |one| one.position[axis]), "{name}");
        let name = format!("v{name}");
        assert_eq!(numbers(&report[&name]), column(&particles, |one| one.velocity[axis]), "{name}");
    }
    assert_eq!(numbers(&report["inverse_mass"]), column(&particles, |one| one.inverse_mass));
    let flags: Value = particles.iter().map(|particle| particle.flags).collect();
    assert_eq!(report["flags"], flags);
    assert_eq!((&report["frame"], &report["step"]), (&json!("world"), &json!(0)));
    assert_eq!(report["is_same_again"], true);
    assert_eq!(report["sticks"], json!([596]));
    let ends: Vec<[f64; 3]> = serde_json::from_value(report["ends"][0].clone()).unwrap();
    assert_eq!(ends, particles.iter().map(|one| one.position.map(f64::from)).collect::<Vec<_>>());
    assert_eq!(report["triangles"], json!([286]));
    let transform = &report["transform"];
    assert_eq!(
        (&transform["parent_frame_id"], &transform["child_frame_id"]),
        (&json!("map"), &json!("world"))
    );
    assert_eq!(numbers(&report["parameters"]["gravity"]), [0.0, -9.81, 0.0]);
    assert_eq!(report["capabilities"], json!(["parameters", "parametersSubscribe"]));
    let rotation = &transform["rotation"];
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert_eq!((&rotation["x"], &rotation["w"]), (&json!(half), &json!(half)), "y becomes z");
    let topics =
        "/colliders /outcomes /particles /scene /status /steps /surface /tears /tf /topology"
            .split(' ');
    let topics: Vec<_> = topics.map(Value::from).collect();
    assert_eq!(report["topics"], json!(topics));
}

#[test]
#[ignore = "needs Node"]
fn the_official_client_commands_the_node_if_allowed() {
    let mut setup = Setup::start(&["--allow-commands"]);
    let report = setup.run_client("command");
    assert_eq!(report["services"], json!(["pause", "reset", "resume", "step"]));
    assert_eq!(
        (&report["step"]["status"], &report["step"]["step"]),
        (&json!("applied"), &json!(1))
    );
    assert!(report["nonsense"]["failure"].as_str().unwrap().contains("1 to 10000"), "{report}");
    for service in ["resume", "pause", "reset"] {
        assert_eq!(report[service]["status"], "applied", "{report}");
    }
    assert_eq!(numbers(&report["gravity"]), [0.0, -1.5, 0.0]);
    assert_eq!(
        (&report["pin"]["status"], &report["pin"]["particle"]),
        (&json!("applied"), &json!(100))
    );
    setup.wait_for_particle(100, |particle| particle.flags & ParticleFlags::PINNED != 0);
    let reset = report["reset"]["step"].as_u64().unwrap();
    assert!(reset > 3, "{report}");
}

#[test]
#[ignore = "needs Node"]
fn the_official_client_changes_nothing_if_not_allowed() {
    let setup = Setup::start(&[]);
    let before = setup.particles();
    let report = setup.run_client("command");
    assert_eq!(report["services"], json!([]));
    for service in ["step", "resume", "pause", "reset"] {
        assert!(report[service]["failure"].is_string(), "{report}");
    }
    assert_eq!(numbers(&report["gravity"]), [0.0, -9.81, 0.0]);
    assert_eq!(report["pin"], Value::Null);
    let status = integration_tests::ctl(&setup.sandbox, &["status"]);
    assert_eq!((&status["step"], &status["paused"]), (&json!(0), &json!(true)), "{status}");
    assert!(setup.particles() == before);
}
