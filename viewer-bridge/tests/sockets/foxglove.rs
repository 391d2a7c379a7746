//! The Foxglove server over real sockets: delivery, permissions, and clients that violate the protocol.
//! There is no node: the tests publish to the sink, and answer commands.

use std::collections::BTreeSet;
use std::time::Duration;

use bytemuck::cast_slice;
use serde_json::{Value, json};
use sim_contract::{
    Action, Parameter, ParameterValues, ParticleState, Reason, TearCause, TornConstraint,
};
use tokio::runtime::Runtime;
use viewer_bridge::limits::{CLIENTS_MAX, VISITORS_MAX};
use viewer_bridge::message::{Command, CommandKind, OutcomeText, ParametersText, Playback, Status};
use viewer_bridge::request::{ClientId, RequestKind, Requests, requests};
use viewer_bridge::sink::{Demand, Update};
use viewer_bridge::source::shown_state::ShownState;
use viewer_bridge::wire::Scene;
use viewer_bridge::{
    FoxgloveOptions, FoxglovePermission, FoxgloveServer, FoxgloveServerError, RecordingTimes,
    Shutdown, Sinks,
};

use crate::sockets::foxglove_client::{Binary, Client, connect};
use crate::sockets::support::{allow_many_open_files, state, wait_for};

/// A running Foxglove server. Dropping it ends the server.
pub(crate) struct FoxgloveSite {
    sinks: Sinks,
    shutdown: Shutdown,
    pub(crate) requests: Requests,
    pub(crate) url: String,
    shown: ShownState,
    _runtime: Runtime,
}

pub(crate) fn options() -> FoxgloveOptions {
    FoxgloveOptions {
        listen: "127.0.0.1:0".parse().unwrap(),
        origins: vec!["https://viewer.example".to_owned()],
        permission: FoxglovePermission::Commands,
        recording: None,
    }
}

impl FoxgloveSite {
    pub(crate) fn start(options: FoxgloveOptions) -> Self {
        allow_many_open_files();
        let runtime = Runtime::new().unwrap();
        let (sender, requests) = requests();
        let server = runtime.block_on(FoxgloveServer::start(options, sender)).unwrap();
        let (url, shutdown) = (server.url(), Shutdown::default());
        let mut sinks = Sinks::new(shutdown.clone());
        sinks.add(server.sink());
        runtime.spawn(server.serve(shutdown.clone()));
        let shown = ShownState::default();
        Self { sinks, shutdown, requests, url, shown, _runtime: runtime }
    }

    /// Shows a scene with `count` particles, connected in a row.
    pub(crate) fn begin(&mut self, count: u32) {
        let positions = (0..count).map(|_| [0.0; 3]).collect();
        let ends = (1..count).map(|particle| [particle - 1, particle]).collect();
        let scene = Scene { positions, ends, rate_hz: 240, ..Scene::default() };
        self.shown.begin_load(&self.sinks, scene);
    }

    pub(crate) fn show(&mut self, step: u64, particles: &[ParticleState]) {
        self.shown.show(&self.sinks, state(step, particles));
    }

    /// Connects a client that subscribes to `/particles`.
    pub(crate) fn subscriber(&self) -> Client {
        let (mut client, _) = Client::start(&self.url);
        client.subscribe(1, "/particles");
        self.wait_for_subscription();
        client
    }

    /// Waits until a subscription has reached the source.
    fn wait_for_subscription(&self) {
        wait_for("a subscription", || {
            let request = self.requests.next(Duration::ZERO)?;
            (request.kind == RequestKind::State).then_some(())
        });
    }

    /// Waits for the next command, and returns it with its client and id. Skips subscriptions.
    fn command(&self) -> (ClientId, Option<u32>, CommandKind) {
        wait_for("a command", || match self.requests.next(Duration::ZERO)? {
            request if request.kind == RequestKind::State => None,
            request => match request.kind {
                RequestKind::Command(Command { id, kind, .. }) => Some((request.client, id, kind)),
                other => panic!("no command: {other:?}"),
            },
        })
    }

    /// Answers that a command was applied at step 8.
    fn apply(&self, client: ClientId, id: Option<u32>, kind: &'static str) {
        let outcome = OutcomeText {
            id,
            kind,
            status: Status::Applied,
            step: Some(8),
            state_step: None,
            applied: 1,
            rejected: 0,
            reason: None,
            text: String::new(),
        };
        self.sinks.publish(&Update::Answer { client, outcome: &outcome });
    }

    /// Answers that a command was rejected.
    fn reject(&self, client: ClientId, id: Option<u32>, kind: &'static str, reason: Reason) {
        let outcome = OutcomeText::refused(id, kind, reason.into());
        self.sinks.publish(&Update::Answer { client, outcome: &outcome });
    }

    fn set_parameters(&self, values: ParameterValues) {
        let text = ParametersText {
            is_complete: true,
            values: Some(values),
            initial: None,
            initial_colliders: Vec::new(),
        };
        self.sinks.publish(&Update::Parameters(&text));
    }

    fn has_demand(&self) -> bool {
        self.sinks.has_demand(Demand::State)
    }
}

impl Drop for FoxgloveSite {
    fn drop(&mut self) {
        self.shutdown.begin();
    }
}

/// Particles, the first of them at `x`.
fn particles(count: usize, x: f32) -> Vec<ParticleState> {
    let mut particles = vec![ParticleState::default(); count];
    particles[0].position[0] = x;
    particles
}

/// Returns true if a message on `/particles` ends with the bits of these particles, its last field.
fn has_bits(message: &[u8], particles: &[ParticleState]) -> bool {
    message.ends_with(cast_slice::<_, u8>(particles))
}

fn parameter(values: &Value, name: &str) -> Value {
    let values = values["parameters"].as_array().unwrap();
    values.iter().find(|one| one["name"] == name).unwrap()["value"].clone()
}

#[test]
fn a_client_receives_only_the_topics_that_it_subscribed_to() {
    let mut site = FoxgloveSite::start(options());
    let (mut client, server) = Client::start(&site.url);
    assert_eq!(server["name"], "catenary");
    let topics = [
        "/tf",
        "/topology",
        "/surface",
        "/colliders",
        "/tears",
        "/outcomes",
        "/status",
        "/steps",
        "/particles",
        "/scene",
    ]
    .map(Some);
    let mut advertised: Vec<_> = client.topics().into_iter().map(Some).collect();
    advertised.sort_by_key(|topic| topics.iter().position(|one| one == topic));
    assert_eq!(advertised, topics);
    assert_eq!(client.channel("/particles")["schemaName"], "foxglove.PointCloud");
    assert_eq!(client.channel("/scene")["schemaName"], "foxglove.SceneUpdate");
    assert_eq!(client.channel("/tf")["schemaName"], "foxglove.FrameTransform");
    assert_eq!(client.channel("/tears")["schemaEncoding"], "jsonschema");
    site.begin(4);
    client.subscribe(1, "/particles");
    site.wait_for_subscription();
    let state = particles(4, 0.5);
    site.show(7, &state);
    assert!(has_bits(&client.message(1).1, &state));
    client.subscribe(2, "/tears");
    client.subscribe(3, "/tf");
    client.subscribe(4, "/scene");
    (0..3).for_each(|_| site.wait_for_subscription());
    let torn = [(2, TearCause::Force), (0, TearCause::Cut)]
        .map(|(constraint, cause)| TornConstraint::new(constraint, Some(cause)));
    site.shown.set_torn(&site.sinks, 8, &torn);
    site.show(8, &state);
    let tears = json!({ "step": 8, "constraints": [2, 0], "causes": ["force", "cut"] });
    assert_eq!(client.json(2), tears);
    // The order of these two is not specified.
    let mut others = BTreeSet::new();
    while others.len() < 2 {
        others.insert(client.binary(|binary| match binary {
            Binary::Message { subscription, .. } => (subscription > 2).then_some(subscription),
            _ => None,
        }));
    }
}

#[test]
fn there_is_no_demand_after_the_last_client_unsubscribed() {
    let mut site = FoxgloveSite::start(options());
    assert!(!site.has_demand());
    let (mut client, _) = Client::start(&site.url);
    let (mut other, _) = Client::start(&site.url);
    client.subscribe(1, "/scene");
    other.subscribe(1, "/particles");
    wait_for("a demand", || site.has_demand().then_some(()));
    (0..2).for_each(|_| site.wait_for_subscription());
    client.unsubscribe(1);
    drop(other);
    // The initial messages that were due to the clients are dropped as well.
    site.begin(1);
    site.show(0, &particles(1, 0.0));
    wait_for("no demand", || (!site.has_demand()).then_some(()));
}

#[test]
fn a_service_call_becomes_a_command_and_returns_the_outcome() {
    let site = FoxgloveSite::start(options());
    let (mut client, server) = Client::start(&site.url);
    let capabilities: Vec<String> = serde_json::from_value(server["capabilities"].clone()).unwrap();
    assert!(capabilities.iter().any(|one| one == "services"), "{capabilities:?}");
    let services = client.text("advertiseServices")["services"].take();
    let services: Vec<Value> = serde_json::from_value(services).unwrap();
    assert_eq!(services.len(), 4);
    let number = |name: &str| {
        let service = services.iter().find(|service| service["name"] == name).unwrap();
        u32::try_from(service["id"].as_u64().unwrap()).unwrap()
    };
    let step = number("step");
    client.call(step, 1, &json!({ "count": 3 }));
    let (sender, id, command) = site.command();
    assert_eq!(command, Action::Step { count: 3 }.into());
    site.apply(sender, id, "step");
    let answer = client.response(1);
    assert_eq!((&answer["status"], &answer["step"]), (&json!("applied"), &json!(8)));
    for (name, command) in
        [("pause", Action::Pause), ("resume", Action::Resume), ("reset", Action::Reset)]
    {
        client.call(number(name), 2, &json!({}));
        let (sender, id, asked) = site.command();
        assert_eq!(asked, command.into());
        site.reject(sender, id, name, Reason::NoEffectHere);
        let failure = client.text("serviceCallFailure");
        assert_eq!(failure["callId"], 2);
        assert!(failure["message"].as_str().unwrap().contains("no effect"), "{failure}");
    }
    for request in
        [json!({ "count": 0 }), json!({ "count": "2" }), json!({ "colour": 1 }), json!(7)]
    {
        client.call(step, 3, &request);
        assert_eq!(client.text("serviceCallFailure")["callId"], 3, "{request}");
    }
    assert_eq!(site.requests.next(Duration::ZERO), None);
}

#[test]
fn a_client_cannot_change_anything_without_permission() {
    let site = FoxgloveSite::start(FoxgloveOptions {
        permission: FoxglovePermission::ReadOnly,
        ..options()
    });
    site.set_parameters(ParameterValues::default());
    let (mut client, server) = Client::start(&site.url);
    for capability in server["capabilities"].as_array().unwrap() {
        assert!(capability != "clientPublish" && capability != "services", "{server}");
    }
    client.call(1, 1, &json!({}));
    assert_eq!(client.text("serviceCallFailure")["callId"], 1);
    client.advertise(1, "/commands");
    assert!(client.text("status")["message"].as_str().unwrap().contains("clientPublish"));
    client.publish(1, &json!({ "kind": "pause" }));
    assert_eq!(client.text("status")["level"], 2);
    let set = json!([{ "name": "damping", "value": 3.5 }]);
    client.send(&json!({ "op": "setParameters", "parameters": set, "id": "set" }));
    assert!(client.text("status")["message"].as_str().unwrap().contains("--allow-commands"));
    let values = client.text("parameterValues");
    assert_eq!((&values["id"], parameter(&values, "damping")), (&json!("set"), json!(0.0)));
    client.send(&json!({ "op": "getParameters", "parameterNames": [], "id": "get" }));
    assert_eq!(parameter(&client.text("parameterValues"), "substeps"), json!(4));
    assert_eq!(site.requests.next(Duration::ZERO), None);
}

#[test]
fn a_client_can_read_set_and_subscribe_to_parameters() {
    let site = FoxgloveSite::start(options());
    site.set_parameters(ParameterValues::default());
    let (mut client, _) = Client::start(&site.url);
    let (mut other, _) = Client::start(&site.url);
    other.send(&json!({ "op": "subscribeParameterUpdates", "parameterNames": ["damping"] }));
    other.send(&json!({ "op": "getParameters", "parameterNames": ["damping"], "id": "get" }));
    assert_eq!(other.text("parameterValues")["parameters"].as_array().unwrap().len(), 1);
    let set = json!([{ "name": "damping", "value": 3.5 }, { "name": "dance", "value": 1 }]);
    client.send(&json!({ "op": "setParameters", "parameters": set, "id": "set" }));
    let (sender, id, command) = site.command();
    assert_eq!(command, Action::set("damping", 3.5).into());
    site.apply(sender, id, "set");
    assert!(client.text("status")["message"].as_str().unwrap().contains("dance"));
    assert_eq!(parameter(&client.text("parameterValues"), "damping"), json!(3.5));
    site.set_parameters(ParameterValues::default().with(Parameter::Damping, 3.5));
    assert_eq!(parameter(&other.text("parameterValues"), "damping"), json!(3.5));
}

#[test]
fn published_commands_reach_the_source_and_grabs_end_with_the_client() {
    let site = FoxgloveSite::start(options());
    let grab = json!({ "kind": "grab", "particle": 3, "target": [0, 1, 2], "over_s": 0.1 });
    let (mut client, _) = Client::start(&site.url);
    client.advertise(5, "/commands");
    client.publish(5, &grab);
    let (holder, id, command) = site.command();
    let expected = Action::Grab { particle: 3, target: [0.0, 1.0, 2.0], over_s: 0.1 };
    assert_eq!(command, expected.into());
    site.reject(holder, id, "grab", Reason::GrabbedByOther);
    let status = client.text("status");
    assert!(status["message"].as_str().unwrap().contains("another client"), "{status}");
    let leaves = |holder: ClientId| {
        wait_for("the client to leave", || {
            let request = site.requests.next(Duration::ZERO)?;
            (request.kind == RequestKind::Left && request.client == holder).then_some(())
        });
    };
    client.unadvertise(5);
    leaves(holder);
    let (mut other, _) = Client::start(&site.url);
    other.advertise(1, "/commands");
    other.publish(1, &grab);
    let (other_holder, _, _) = site.command();
    assert_ne!(other_holder, holder);
    // The connection breaks without a close message.
    drop(other);
    leaves(other_holder);
}

#[test]
fn an_invalid_command_is_refused_and_does_not_reach_the_source() {
    let site = FoxgloveSite::start(options());
    for wrong in [
        json!("pause"),
        json!({ "kind": "dance" }),
        json!({ "kind": "grab", "particle": 1, "target": [1e9, 0, 0] }),
        json!({ "kind": "cut_radius", "center": ["nan", 0, 0], "radius": 1 }),
        json!({ "kind": "push", "center": [0, 0, 0], "radius": -1, "delta": [0, 0, 0] }),
        json!({ "kind": "rewind", "to_step": 3 }),
    ] {
        let (mut client, _) = Client::start(&site.url);
        client.advertise(1, "/commands");
        client.publish(1, &wrong);
        assert_eq!(client.text("status")["level"], 2, "{wrong}");
    }
    let (mut client, _) = Client::start(&site.url);
    client.advertise(1, "/other");
    client.publish(1, &json!({ "kind": "pause" }));
    assert!(client.text("status")["message"].as_str().unwrap().contains("/commands"));
    client.advertise(2, "/commands");
    client.publish(2, &json!({ "kind": "resume" }));
    let command = wait_for("a command", || match site.requests.next(Duration::ZERO)?.kind {
        RequestKind::Command(command) => Some(command.kind),
        RequestKind::Left | RequestKind::State | RequestKind::Credit => None,
    });
    assert_eq!(command, Action::Resume.into());
}

#[test]
fn other_pages_and_other_protocols_are_refused() {
    let site = FoxgloveSite::start(options());
    assert!(connect(&site.url, Some("https://viewer.example")).is_ok());
    for origin in ["null", "http://evil.example", &site.url.replace("ws", "http")] {
        assert_eq!(connect(&site.url, Some(origin)).err(), Some(403), "{origin}");
    }
    let plain = std::net::TcpStream::connect(site.url.trim_start_matches("ws://")).unwrap();
    let refused = tungstenite::client(&site.url, plain).unwrap_err();
    assert!(refused.to_string().contains("400"), "{refused}");
}

#[test]
fn an_address_other_than_loopback_is_refused() {
    let runtime = Runtime::new().unwrap();
    for address in ["0.0.0.0:0", "[::]:0", "10.1.2.3:8765"] {
        let options = FoxgloveOptions { listen: address.parse().unwrap(), ..options() };
        let refused = runtime.block_on(FoxgloveServer::start(options, requests().0)).unwrap_err();
        assert!(matches!(refused, FoxgloveServerError::NotLoopback { .. }), "{refused}");
        assert!(refused.to_string().contains("ssh -L"), "{refused}");
    }
}

#[test]
fn a_client_over_the_limit_is_refused_until_another_disconnects() {
    let site = FoxgloveSite::start(options());
    let mut clients: Vec<_> = (0..CLIENTS_MAX).map(|_| site.subscriber()).collect();
    assert_eq!(connect(&site.url, None).err(), Some(503));
    clients.pop();
    wait_for("a free slot", || connect(&site.url, None).ok());
}

#[test]
fn clients_that_never_send_a_valid_message_make_room_and_subscribers_stay() {
    let mut site = FoxgloveSite::start(options());
    let mut old = site.subscriber();
    let mut idle: Vec<_> =
        (0..2 * VISITORS_MAX).map(|_| connect(&site.url, None).unwrap()).collect();
    for client in &mut idle {
        // The evicted ones have closed their connections.
        client.flood(&json!({ "op": "dance" }), 1);
    }
    let mut new = site.subscriber();
    site.begin(2);
    site.show(1, &particles(2, 0.25));
    for client in [&mut old, &mut new] {
        assert!(has_bits(&client.message(1).1, &particles(2, 0.25)));
    }
    idle[0].read_to_end();
}

#[test]
fn a_client_that_sends_too_much_is_disconnected_and_others_stay() {
    let mut site = FoxgloveSite::start(options());
    let (mut other, _) = Client::start(&site.url);
    let (mut long, _) = Client::start(&site.url);
    // The server may close the connection before all of it is sent.
    let names = vec!["x".repeat(1 << 10); 65];
    long.flood(&json!({ "op": "getParameters", "parameterNames": names }), 1);
    long.read_to_end();
    let (mut flood, _) = Client::start(&site.url);
    flood.flood(&json!({ "op": "unsubscribe", "subscriptionIds": [] }), 1000);
    flood.read_to_end();
    site.begin(2);
    other.subscribe(1, "/particles");
    site.wait_for_subscription();
    site.show(1, &particles(2, 0.25));
    assert!(has_bits(&other.message(1).1, &particles(2, 0.25)));
}

#[test]
fn a_client_that_does_not_read_delays_no_other_and_then_receives_the_newest_state() {
    // One megabyte per state, far more than socket buffers hold.
    const PARTICLES: u32 = 1 << 15;
    const STATES: u32 = 80;
    let mut site = FoxgloveSite::start(options());
    let (mut slow, _) = Client::start(&site.url);
    let (mut quick, _) = Client::start(&site.url);
    site.begin(PARTICLES);
    slow.subscribe(1, "/particles");
    quick.subscribe(1, "/particles");
    (0..2).for_each(|_| site.wait_for_subscription());
    let mut state = particles(PARTICLES as usize, 0.0);
    for step in 0..STATES {
        state[0].position[0] = step as f32;
        site.show(u64::from(step), &state);
        assert!(has_bits(&quick.message(1).1, &state), "{step}");
    }
    let mut count = 1;
    while !has_bits(&slow.message(1).1, &state) {
        count += 1;
    }
    assert!(count < STATES, "{count} states were queued");
}

#[test]
fn a_client_can_observe_and_control_playback() {
    let second_ns = 1_000_000_000;
    let recording =
        RecordingTimes { epoch_ns: 5 * second_ns, rate_hz: 240, first_step: 0, last_step: 480 };
    let mut site = FoxgloveSite::start(FoxgloveOptions { recording: Some(recording), ..options() });
    let (mut client, server) = Client::start(&site.url);
    let capabilities: Vec<String> = serde_json::from_value(server["capabilities"].clone()).unwrap();
    assert!(capabilities.iter().any(|one| one == "playbackControl"), "{capabilities:?}");
    assert_eq!(server["dataStartTime"], json!({ "sec": 5, "nsec": 0 }), "{server}");
    assert_eq!(server["dataEndTime"], json!({ "sec": 7, "nsec": 0 }), "{server}");
    let state = |client: &mut Client| {
        client.binary(|binary| match binary {
            Binary::Playback { status, time_ns, speed, did_seek, request } => {
                Some((status, time_ns, speed, did_seek, request))
            }
            _ => None,
        })
    };
    let paused = Playback { rate: 1.0, ..Playback::default() };
    site.sinks.publish(&Update::Playback(&paused));
    assert_eq!(state(&mut client), (1, 5 * second_ns, 1.0, false, String::new()));
    client.play(0, 2.0, Some(6 * second_ns), "seven");
    let commands = [(); 3].map(|()| site.command().2);
    let rate = Action::set("time_scale", 2.0);
    let seek = CommandKind::Seek { step: 240 };
    assert_eq!(commands, [seek, rate.into(), Action::Resume.into()]);
    assert_eq!(state(&mut client), (0, 6 * second_ns, 2.0, true, "seven".to_owned()));
    let ended = Playback { step: 480, rate: 2.0, ..paused };
    site.sinks.publish(&Update::Playback(&ended));
    assert_eq!(state(&mut client), (3, 7 * second_ns, 2.0, false, String::new()));
    site.begin(2);
    client.subscribe(1, "/particles");
    site.wait_for_subscription();
    site.show(120, &particles(2, 0.0));
    assert_eq!(client.message(1).0, 5 * second_ns + second_ns / 2);
}
