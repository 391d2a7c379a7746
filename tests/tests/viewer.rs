//! The server of the viewer, end to end: pages receive the state that the node publishes, and their
//! commands show in the snapshots of the node.

mod carry;
mod ghost;
pub(crate) mod page;
mod recording;
mod replay;
mod vanished;

use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, ctl, wait_for};
use serde_json::{Value, json};
use sim_contract::{Client, ParticleFlags, ParticleState};
use viewer_bridge::wire::{FlaggedParticle, statistics_flag};

use page::{Bridge, Page};

/// Waits for a state of the node in which a condition holds for a particle.
fn wait_for_particle(
    node: &mut Client,
    particle: usize,
    what: &str,
    is_so: impl Fn(&ParticleState) -> bool,
) {
    wait_for(what, || {
        let snapshot = node.latest_snapshot(Duration::from_millis(100)).unwrap()?;
        is_so(&snapshot.particles()[particle]).then_some(())
    });
}

fn is_grabbed(particle: &ParticleState) -> bool {
    particle.flags & ParticleFlags::GRABBED != 0
}

/// A message of a grab: kind "grab" or "move".
fn grab(kind: &str, target: [f32; 3]) -> Value {
    json!({ "kind": kind, "particle": 90, "target": target })
}

#[test]
fn a_page_receives_the_state_that_the_node_publishes() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let bridge = Bridge::start(&sandbox);
    let mut page = bridge.page();
    let scene = page.scene();
    assert_eq!((scene.positions.len(), scene.ends.len(), scene.rate_hz), (168, 596, 240));
    assert_eq!((scene.text.name.as_str(), scene.flags), ("curtain", 0));
    let pins = page.pins();
    let pinned = (0..14).map(|particle| FlaggedParticle { particle, flags: 1 });
    assert_eq!(pins.particles, pinned.collect::<Vec<_>>());
    page.frame(|frame| frame.head.stamp.step > 60);
    page.applied(json!({ "kind": "pause" }));
    bridge.page().text_with("node", "is_paused", &json!(true));
    let mut node = Client::attach(&sandbox.endpoint()).unwrap();
    let snapshot = node.latest_snapshot(DEADLINE).unwrap().unwrap();
    let step = snapshot.header().step;
    let mut late = bridge.page();
    let frame = late.frame(|frame| frame.head.stamp.step == step);
    let positions: Vec<_> = snapshot.particles().iter().map(|one| one.position).collect();
    assert_eq!(frame.positions, positions);
    let statistics = page.statistics(|statistics| statistics.client_count == 2);
    assert!(statistics.stretch_max < 0.2 && statistics.stretch_max >= statistics.stretch_mean);
    assert_eq!(statistics.torn_count, 0);
}

#[test]
fn a_particle_follows_the_grab_of_a_page_and_is_released_when_the_page_disconnects() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let bridge = Bridge::start(&sandbox);
    let mut node = Client::attach(&sandbox.endpoint()).unwrap();
    let (mut page, mut other) = (bridge.page(), bridge.page());
    page.applied(grab("grab", [0.2, 0.5, 0.5]));
    assert_eq!(other.rejected(grab("grab", [0.0; 3])), "grabbed_by_other");
    assert_eq!(other.rejected(grab("move", [0.0; 3])), "grabbed_by_other");
    assert_eq!(other.rejected(json!({ "kind": "release", "particle": 3 })), "not_grabbed");
    page.send(&grab("move", [0.3, 0.5, 0.4]));
    wait_for_particle(&mut node, 90, "the particle at its target", |particle| {
        is_grabbed(particle) && particle.position == [0.3, 0.5, 0.4]
    });
    drop(page);
    wait_for_particle(&mut node, 90, "the release", |one| !is_grabbed(one));
    other.applied(grab("grab", [0.2, 0.5, 0.5]));
    other.applied(json!({ "kind": "release", "particle": 90 }));
    wait_for_particle(&mut node, 90, "the release", |one| !is_grabbed(one));
}

#[test]
fn grabs_of_pages_are_released_when_the_bridge_ends() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let bridge = Bridge::start(&sandbox);
    let mut node = Client::attach(&sandbox.endpoint()).unwrap();
    let mut page = bridge.page();
    page.applied(grab("grab", [0.2, 0.5, 0.5]));
    wait_for_particle(&mut node, 90, "the grab", is_grabbed);
    // While the node is paused, the bridge is blocked on the next state.
    page.applied(json!({ "kind": "pause" }));
    page.statistics(|statistics| statistics.flags & statistics_flag::PAUSED != 0);
    page.statistics(|_| true);
    let ended = bridge.process.interrupt();
    assert_eq!(ended.code, Some(0), "{}", ended.stderr);
    ctl(&sandbox, &["resume"]);
    wait_for_particle(&mut node, 90, "the release", |one| !is_grabbed(one));
}

#[test]
fn grabs_of_pages_are_released_when_the_bridge_is_killed() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let bridge = Bridge::start(&sandbox);
    let mut node = Client::attach(&sandbox.endpoint()).unwrap();
    let mut page = bridge.page();
    page.applied(grab("grab", [0.2, 0.5, 0.5]));
    wait_for_particle(&mut node, 90, "the grab", is_grabbed);
    bridge.process.signal(Signal::KILL);
    assert_eq!(bridge.process.wait().code, None);
    wait_for_particle(&mut node, 90, "the release", |one| !is_grabbed(one));
}

#[test]
fn pages_can_pin_cut_brush_set_step_reset_and_load() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let bridge = Bridge::start(&sandbox);
    let mut page = bridge.page();
    let epoch = page.scene().stamp.epoch;
    page.applied(json!({ "kind": "pin", "particle": 100 }));
    let cut = json!({ "kind": "cut_constraints", "epoch": epoch, "constraints": [300, 301, 302] });
    let outcome = page.command(cut.clone());
    assert_eq!((&outcome["applied"], &outcome["rejected"]), (&json!(3), &json!(0)));
    let tear = page.tear();
    assert_eq!((tear.first, tear.constraints()), (0, vec![300, 301, 302]));
    assert_eq!(page.rejected(cut), "already_torn");
    let stale = json!({ "kind": "cut_constraints", "epoch": epoch + 1, "constraints": [1] });
    assert_eq!(page.rejected(stale), "stale_epoch");
    let brush = |eye: [f32; 3]| {
        json!({ "kind": "brush", "eye": eye, "ray": [0, 0, -1], "radius": 0.2,
            "delta": [0, 0, 0.05], "over_s": 0.016, "cap": 0.1 })
    };
    assert_eq!(page.command(brush([0.0, 0.5, 3.0]))["applied"], 1);
    assert_eq!(page.command(brush([9.0, 0.5, 3.0]))["applied"], 0);
    page.applied(json!({ "kind": "set", "parameter": "gravity", "value": [0, -1.5, 0] }));
    let parameters = page.text(|text| text["values"]["gravity"][1] == -1.5);
    assert_eq!(
        (&parameters["is_complete"], &parameters["initial"]["gravity"][1]),
        (&json!(true), &json!(-9.81))
    );
    assert_eq!(
        page.rejected(json!({ "kind": "set", "parameter": "stiffness", "value": 0.5 })),
        "no_effect_here"
    );
    assert_eq!(page.rejected(json!({ "kind": "step", "count": 1 })), "no_effect_here");
    let paused_before = page.applied(json!({ "kind": "pause" }));
    let last = paused_before + 2;
    page.frame_after(json!({ "kind": "step", "count": 3 }), |frame| frame.head.stamp.step == last);
    page.applied(json!({ "kind": "resume" }));
    let reset = page.applied(json!({ "kind": "reset" }));
    let tear = page.tear();
    assert!(tear.torn.is_empty() && tear.first == 0 && tear.stamp.step >= reset);
    check_refusals(&mut page);
    page.send(&json!({ "kind": "load", "scene": "rope" }));
    let rope = page.scene();
    assert_eq!((rope.text.name.as_str(), rope.positions.len()), ("rope", 41));
    assert_ne!(rope.stamp.epoch, epoch);
    page.frame(|frame| frame.head.stamp.epoch == rope.stamp.epoch);
    // Another rate begins a new run, which the page follows.
    page.applied(json!({ "kind": "load", "scene": "ragdoll" }));
    let ragdoll = page.scene();
    assert_eq!(ragdoll.text.name, "ragdoll");
    page.frame(|frame| frame.head.stamp.epoch == ragdoll.stamp.epoch);
}

/// Checks commands that a live node or the bridge refuses.
fn check_refusals(page: &mut Page) {
    for (message, reason) in [
        (json!({ "kind": "load", "scene": "/etc/passwd.toml" }), "unknown_scene"),
        (json!({ "kind": "seek", "step": 3 }), "only_replay"),
        (json!({ "kind": "step_back", "count": 3 }), "only_replay"),
        (json!({ "kind": "pin", "particle": 100_000 }), "unknown_particle"),
    ] {
        assert_eq!(page.rejected(message.clone()), reason, "{message}");
    }
}

#[test]
fn pages_show_parameters_that_other_clients_set() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let bridge = Bridge::start(&sandbox);
    let mut page = bridge.page();
    page.text(|text| text["type"] == "parameters" && text["is_complete"] == true);
    ctl(&sandbox, &["set", "damping", "2.5"]);
    page.text(|text| text["values"]["damping"] == 2.5);
    ctl(&sandbox, &["pause"]);
    page.text_with("node", "is_paused", &json!(true));
    // The node publishes its parameters, so a late bridge knows them as well.
    let late = Bridge::start(&sandbox);
    let text = late.page().text(|text| text["type"] == "parameters" && !text["values"].is_null());
    assert_eq!((&text["is_complete"], &text["values"]["damping"]), (&json!(true), &json!(2.5)));
}

#[test]
fn pages_wait_for_a_node_and_report_when_it_is_lost_and_back() {
    let sandbox = Sandbox::new();
    let mut bridge = Bridge::start(&sandbox);
    bridge.process.wait_for_line("waiting: no node runs as 'sim'");
    let mut page = bridge.page();
    let text = page.text(|text| text["type"] == "node" && text["text"] != "");
    assert_eq!(text["state"], "none");
    assert!(text["text"].as_str().unwrap().contains("sim-node run"), "{text}");
    assert_eq!(page.rejected(json!({ "kind": "pause" })), "no_node");

    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let first = page.scene();
    page.text_with("node", "state", &json!("alive"));
    // A killed node cannot announce its end.
    node.signal(Signal::KILL);
    page.text_with("node", "state", &json!("lost"));
    assert_eq!(page.rejected(json!({ "kind": "pause" })), "no_node");
    drop(node);

    let node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope"]);
    let second = page.scene();
    assert_eq!((first.positions.len(), second.positions.len()), (168, 41));
    assert_ne!(first.text.run_id, second.text.run_id);
    assert_ne!(first.stamp.epoch, second.stamp.epoch);
    page.frame(|frame| frame.head.stamp.epoch == second.stamp.epoch);
    // A clean end.
    node.interrupt();
    page.text_with("node", "state", &json!("lost"));
}

#[test]
fn the_scene_picker_lists_the_scenes_of_the_node() {
    let sandbox = Sandbox::new();
    let listed = Process::run(Program::SimNode, &sandbox, &["scenes", "--json"]).json();
    let listed: Vec<_> = listed.as_array().unwrap().iter().map(|one| &one["name"]).collect();
    let catalog = viewer_bridge::scene::catalog::Catalog::default();
    let known: Vec<_> = catalog.entries().iter().map(|one| json!(one.name)).collect();
    assert_eq!(listed, known.iter().collect::<Vec<_>>());
    assert!(catalog.entries().iter().all(|one| !one.text.is_empty()));
}

#[test]
fn a_page_loads_a_scene_file_that_the_viewer_was_given_and_no_other() {
    let sandbox = Sandbox::new();
    let text = "version = 1\nname = \"dot\"\n[[particle]]\nposition = [0, 0, 0]\n";
    let dot = sandbox.write("dot.toml", text);
    let hidden = sandbox.write("hidden.toml", &text.replace("dot", "hidden"));
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "rope"]);
    let bridge = Bridge::start_with(&sandbox, &["--scene", &dot]);
    let mut page = bridge.page();
    let last = page.hello["scenes"].as_array().unwrap().last().unwrap().clone();
    let entry = json!({ "name": "dot", "rate_hz": 240, "dimensions": 3, "text": dot });
    assert_eq!(last, entry);
    assert_eq!(page.scene().text.name, "rope");
    page.applied(json!({ "kind": "load", "scene": "dot" }));
    assert_eq!(page.scene().text.name, "dot");
    for scene in [&dot, &hidden, "hidden"] {
        assert_eq!(page.rejected(json!({ "kind": "load", "scene": scene })), "unknown_scene");
    }
}

#[test]
fn a_wrong_scene_file_ends_the_viewer_with_its_name_and_the_cure() {
    let sandbox = Sandbox::new();
    let wrong = sandbox.write("wrong.toml", "version = 1\nrate = 60\n");
    let rope = sandbox.write("mine.toml", "version = 1\nname = \"rope\"\n");
    let absent = sandbox.path("absent.toml");
    for (file, problem) in [
        (&wrong, "wrong.toml:2: rate: "),
        (&rope, "there is a scene 'rope' already; give this one another `name`"),
        (&absent, "cannot read the scene"),
    ] {
        let args = ["--listen", "127.0.0.1:0", "--scene", file];
        let done = Process::run(Program::ViewerBridge, &sandbox, &args);
        assert_eq!(done.code, Some(1), "{}", done.stderr);
        assert!(done.stderr.contains(problem), "{}", done.stderr);
    }
}

#[test]
fn the_server_reports_errors_and_signals_by_its_exit_code() {
    let sandbox = Sandbox::new();
    let bridge = Bridge::start(&sandbox);
    let _page = bridge.page();
    let taken = bridge.host.clone();
    let second = Process::run(Program::ViewerBridge, &sandbox, &["--listen", &taken]);
    assert_eq!(second.code, Some(1));
    assert!(second.stderr.starts_with("error: cannot listen at"), "{}", second.stderr);
    assert!(second.stderr.contains("with --listen 127.0.0.1:0"), "{}", second.stderr);
    let wrong = Process::run(Program::ViewerBridge, &sandbox, &["--listen", "nowhere"]);
    assert_eq!(wrong.code, Some(2));
    bridge.process.signal(Signal::TERM);
    let ended = bridge.process.wait();
    assert_eq!((ended.code, ended.stdout.as_str()), (Some(0), ""), "{}", ended.stderr);
}
