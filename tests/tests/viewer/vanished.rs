//! Clients that vanish without a goodbye: their grabs end, whether the connection is reset or only
//! silent.

use integration_tests::{DEADLINE, Process, Program, Sandbox};
use serde_json::json;
use sim_contract::Client as Node;

use crate::foxglove_client::Client;
use crate::viewer::page::{Bridge, Page};
use crate::viewer::{is_grabbed, wait_for_particle};

/// Particles that a page and a Foxglove client grab.
const PAGE_PARTICLE: usize = 90;
const FOXGLOVE_PARTICLE: usize = 95;

/// A page and a Foxglove client that have each grabbed a particle.
struct Setup {
    node: Node,
    page: Page,
    client: Client,
    bridge: Bridge,
    _node: Process,
    _sandbox: Sandbox,
}

impl Setup {
    fn start() -> Self {
        let sandbox = Sandbox::new();
        let process = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
        let options = ["--foxglove", "127.0.0.1:0", "--allow-commands"];
        let mut bridge = Bridge::start_with(&sandbox, &options);
        let url = bridge.process.wait_for_line("foxglove ws://").replace("foxglove ", "");
        let mut node = Node::attach(&sandbox.endpoint()).unwrap();
        let mut page = bridge.page();
        let target = [0.2, 0.5, 0.5];
        page.applied(json!({ "kind": "grab", "particle": PAGE_PARTICLE, "target": target }));
        let (mut client, _) = Client::start(&url);
        client.subscribe(1, "/particles");
        client.advertise(1, "/commands");
        let grab = json!({
            "kind": "grab", "particle": FOXGLOVE_PARTICLE, "target": target, "over_s": 0.1,
        });
        client.publish(1, &grab);
        wait_for_particle(&mut node, PAGE_PARTICLE, "the grab of the page", is_grabbed);
        wait_for_particle(&mut node, FOXGLOVE_PARTICLE, "the grab of the client", is_grabbed);
        Self { node, page, client, bridge, _node: process, _sandbox: sandbox }
    }
}

fn wait_for_releases(node: &mut Node) {
    for particle in [PAGE_PARTICLE, FOXGLOVE_PARTICLE] {
        wait_for_particle(node, particle, "the release", |one| !is_grabbed(one));
    }
}

#[test]
fn the_grabs_of_clients_whose_connections_are_reset_end() {
    let Setup { mut node, page, client, bridge, _node, _sandbox } = Setup::start();
    page.reset();
    client.reset();
    wait_for_releases(&mut node);
    // Another page can grab the particles.
    let target = json!([0.2, 0.5, 0.5]);
    bridge.page().applied(json!({ "kind": "grab", "particle": PAGE_PARTICLE, "target": target }));
}

#[test]
fn the_grabs_of_silent_clients_end_after_the_ping_deadline() {
    let Setup { mut node, page, client, bridge: _bridge, _node, _sandbox } = Setup::start();
    // Neither reads, and so neither answers pings, but both connections stay open.
    let silence_max = viewer_bridge::limits::SILENCE_MAX;
    assert!(4 * silence_max < DEADLINE, "the deadline of the test is too short");
    wait_for_releases(&mut node);
    drop((page, client));
}
