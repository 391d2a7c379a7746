//! Other programs can open what we write and serve: every schema follows the rules of viewers of the
//! Foxglove protocol, and every row follows its schema.

mod rules;
mod validation;

use std::collections::BTreeMap;
use std::fmt::Write;

use integration_tests::{Process, Program, Sandbox, ctl, record};
use recording::{LogReader, MessageEncoder, Topic, TopicFormat};
use serde_json::{Value, json};
use sim_contract::Action;

use crate::foxglove_client::Client;
use rules::broken_rules;
use validation::violations;

/// A scene with colliders, one of which moves, and a particle that freezes.
const SCENE: &str = "
    version = 1
    [solver]
    max_speed = 3e38
    tear_stretch = 1.5
    [[particle]]
    position = [0, 9, 0]
    [[particle]]
    position = [1, 9, 0]
    [[constraint]]
    particles = [0, 1]
    rest_length = 1e30
    [[generate]]
    shape = 'cloth'
    columns = 4
    rows = 4
    spacing = 0.1
    [[anchor]]
    particles = [2]
    path = [{ time = 0, translation = [0, 0, 0] }]
    [[collider]]
    shape = 'plane'
    normal = [0, 1, 0]
    offset = -3
    [[collider]]
    shape = 'box'
    center = [0, -1, 0]
    half_extents = [1, 0.1, 1]
    angular_velocity = [0, 1, 0]
    [[collider]]
    shape = 'sphere'
    center = [0, -2, 0]
    radius = 0.2
    velocity = [0.1, 0, 0]
    [[collider]]
    shape = 'capsule'
    a = [0, -1, 0]
    b = [1, -1, 0]
    radius = 0.1
    [[collider]]
    shape = 'mesh'
    vertices = [[0, -3, 0], [1, -3, 0], [0, -3, 1]]
    faces = [[0, 1, 2]]
    angular_velocity = [0, 1, 0]";

/// Returns the schema of each topic with JSON rows.
fn row_schemas() -> BTreeMap<Topic, Value> {
    let formats = Topic::ALL.map(|topic| (topic, TopicFormat::for_topic(topic)));
    let rows = formats.into_iter().filter(|(_, format)| format.encoding == "json");
    rows.map(|(topic, format)| (topic, serde_json::from_slice(&format.schema.data).unwrap()))
        .collect()
}

/// Validates every row of a recording. Returns the number of rows by topic.
fn validate_rows(file: &str) -> BTreeMap<Topic, u64> {
    let (schemas, mut encoder) = (row_schemas(), MessageEncoder::default());
    let mut log = LogReader::open(file.as_ref()).unwrap();
    let mut counts = BTreeMap::new();
    while let Some(logged) = log.next_message().unwrap() {
        let Some(schema) = schemas.get(&logged.message.topic()) else { continue };
        let row = encoder.encode(&logged.message, 0).unwrap();
        let row = serde_json::from_slice(row).unwrap();
        assert_eq!(violations(schema, &row), [""; 0], "{row}");
        *counts.entry(logged.message.topic()).or_default() += 1;
    }
    counts
}

/// Returns every command as a line of a command file, and some with numbers that are not finite.
fn commands() -> String {
    let mut lines = String::new();
    for action in Action::samples() {
        let mut line = serde_json::to_value(action).unwrap();
        let kind = line["kind"].as_str().unwrap().to_owned();
        // A simulation has no past states and no other scenes, and a file has no unknown commands.
        if ["load", "rewind", "restore", "unknown"].contains(&kind.as_str()) {
            continue;
        }
        line["step"] = json!(2);
        writeln!(lines, "{line}").unwrap();
    }
    for line in [
        r#"{"step":3,"kind":"grab","particle":3,"target":["nan","inf",0],"over_s":"nan"}"#,
        r#"{"step":3,"kind":"push","center":[0,0,"-inf"],"radius":"inf","delta":[0,0,0],"limit":"nan"}"#,
        r#"{"step":3,"kind":"set","parameter":"damping","value":"inf"}"#,
        r#"{"step":3,"kind":"set","parameter":"gravity","value":[0,"nan",0]}"#,
        r#"{"step":4,"kind":"set","parameter":"tear_force","value":20}"#,
        r#"{"step":5,"kind":"set","parameter":"tear_force","value":null}"#,
    ] {
        writeln!(lines, "{line}").unwrap();
    }
    lines
}

#[test]
fn viewers_accept_every_schema_of_a_recording() {
    let schemas = row_schemas();
    for (topic, schema) in &schemas {
        assert_eq!(broken_rules(schema), [""; 0], "{}: {schema}", topic.name());
    }
    assert_eq!(schemas.len(), 10);
    for topic in Topic::ALL.iter().filter(|topic| !schemas.contains_key(topic)) {
        let format = TopicFormat::for_topic(*topic);
        assert_eq!((format.encoding, format.schema.encoding), ("protobuf", "protobuf"));
    }
}

#[test]
fn every_row_of_a_simulation_follows_its_schema() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("all.mcap");
    let scene = sandbox.write("all.toml", SCENE);
    let commands = sandbox.write("all.jsonl", &commands());
    let args =
        ["simulate", &scene, "--commands", &commands, "--steps", "240", "--forces", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    let counts = validate_rows(&file);
    for topic in row_schemas().into_keys().filter(|topic| *topic != Topic::Status) {
        assert!(counts.contains_key(&topic), "{}: {counts:?}", topic.name());
    }
    // It has stiffnesses instead of compliances, and bounds.
    let file = sandbox.path("box.mcap");
    let args = ["simulate", "drop-box", "--steps", "10", "-o", &file];
    Process::run(Program::Recorder, &sandbox, &args).success();
    assert_eq!(validate_rows(&file)[&Topic::Colliders], 1);
}

#[test]
fn every_row_of_a_node_follows_its_schema() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "carried-cloth"]);
    let recording = record(&sandbox, &file);
    ctl(&sandbox, &["pin", "3"]);
    ctl(&sandbox, &["set", "tear_force", "20"]);
    ctl(&sandbox, &["cut", "40"]);
    ctl(&sandbox, &["reset"]);
    assert_eq!(recording.interrupt().code, Some(0));
    let counts = validate_rows(&file);
    for topic in [Topic::Status, Topic::Outcomes, Topic::Parameters, Topic::Colliders, Topic::Tears]
    {
        assert!(counts.contains_key(&topic), "{}: {counts:?}", topic.name());
    }
}

#[test]
fn viewers_accept_every_schema_that_the_bridge_advertises() {
    let sandbox = Sandbox::new();
    let args = ["run", "carried-cloth", "--paused"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let args = ["--listen", "127.0.0.1:0", "--foxglove", "127.0.0.1:0", "--allow-commands"];
    let mut bridge = Process::start(Program::ViewerBridge, &sandbox, &args);
    let url = bridge.wait_for_line("foxglove ws://").replace("foxglove ", "");
    let (mut client, _) = Client::start(&url);
    let topics: Vec<_> = client.topics().into_iter().map(ToOwned::to_owned).collect();
    assert_eq!(topics.len(), 10);
    let schema = |text: &Value| serde_json::from_str::<Value>(text.as_str().unwrap()).unwrap();
    for topic in &topics {
        let channel = client.channel(topic);
        if channel["encoding"] == "json" {
            assert_eq!(broken_rules(&schema(&channel["schema"])), [""; 0], "{topic}");
        } else {
            assert_eq!(channel["encoding"], "protobuf", "{topic}");
        }
    }
    let services = client.text("advertiseServices")["services"].take();
    let services = services.as_array().unwrap();
    assert_eq!(services.len(), 4);
    for service in services {
        for part in ["request", "response"] {
            let schema = schema(&service[part]["schema"]);
            assert_eq!(broken_rules(&schema), [""; 0], "{part} of {service}");
        }
    }
    // A node that runs rejects `step`.
    for (call, name) in (1..).zip(["pause", "step", "reset", "resume"]) {
        let service = services.iter().find(|service| service["name"] == name).unwrap();
        let request = if name == "step" { json!({ "count": 2 }) } else { json!({}) };
        assert_eq!(violations(&schema(&service["request"]["schema"]), &request), [""; 0]);
        let id = service["id"].as_u64().unwrap();
        client.call(u32::try_from(id).unwrap(), call, &request);
        let answer = client.response(call);
        let response = schema(&service["response"]["schema"]);
        assert_eq!(violations(&response, &answer), [""; 0], "{name}: {answer}");
    }
    client.subscribe(1, "/colliders");
    let row = client.json(1);
    assert_eq!(violations(&row_schemas()[&Topic::Colliders], &row), [""; 0]);
    assert_eq!(row["colliders"].as_array().unwrap().len(), 2);
}
