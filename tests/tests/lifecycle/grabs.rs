//! A grab lasts as long as the connection of its client, and the node logs the release as such. The
//! clients are processes that are killed, so nothing of theirs can release a particle.

use std::path::Path;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, ctl, record, wait_for};
use recording::{LogReader, Message, OutcomeRow};
use sim_contract::{Action, Client, Outcome, ParticleFlags, Tap, Update};

/// The client id of every grabber.
const CLIENT_ID: u64 = 77;

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

/// Starts a client that grabs particles, and waits until it has grabbed them.
fn grabber(sandbox: &Sandbox, particles: &[&str]) -> Process {
    let args: Vec<_> = ["77"].iter().chain(particles).copied().collect();
    Process::start_ready(Program::Grabber, sandbox, &args)
}

fn kill(process: Process) {
    process.signal(Signal::KILL);
    assert_eq!(process.wait().code, None);
}

/// Waits for the outcomes of `count` releases of lost grabs.
fn disconnections(tap: &mut Tap, count: usize) -> Vec<Outcome> {
    let mut found = Vec::new();
    wait_for("the releases", || {
        tap.latest_state(|update| match update {
            Update::Outcome(outcome) if outcome.is_disconnection() => found.push(**outcome),
            _ => {}
        });
        (found.len() >= count).then_some(())
    });
    found
}

fn release(particle: u32) -> Action {
    Action::Release { particle, force: false }
}

/// Waits until the snapshots show exactly these particles as grabbed.
fn wait_for_grabs(client: &mut Client, expected: &[usize]) {
    wait_for("the grabs", || {
        let snapshot = client.latest_snapshot(Duration::from_millis(100)).unwrap()?;
        let is_grabbed =
            |index: &usize| snapshot.particles()[*index].flags & ParticleFlags::GRABBED != 0;
        (0..snapshot.particles().len())
            .filter(is_grabbed)
            .eq(expected.iter().copied())
            .then_some(())
    });
}

#[test]
fn the_grabs_of_a_killed_client_end_and_those_of_others_and_of_ctl_stay() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let killed = grabber(&sandbox, &["90", "100"]);
    // The same client id, through another connection.
    let _other = grabber(&sandbox, &["110"]);
    ctl(&sandbox, &["grab", "120", "0.5", "0.2", "0.3"]);
    wait_for_grabs(&mut client, &[90, 100, 110, 120]);
    kill(killed);
    wait_for_grabs(&mut client, &[110, 120]);
}

#[test]
fn grabs_of_a_killed_client_end_while_the_node_is_paused_or_nearly_stands_still() {
    for prepare in [["pause"].as_slice(), &["set", "time_scale", "0.001"]] {
        let sandbox = Sandbox::new();
        let _node = node(&sandbox, &["run", "curtain"]);
        ctl(&sandbox, prepare);
        let mut tap = Tap::attach(&sandbox.endpoint()).unwrap();
        kill(grabber(&sandbox, &["90", "100"]));
        let releases = disconnections(&mut tap, 2);
        let actions: Vec<_> = releases.iter().map(|one| one.command.action()).collect();
        assert_eq!(actions, [release(90), release(100)]);
        for outcome in releases {
            assert!(outcome.is_applied());
            assert_eq!((outcome.command.client_id, outcome.command.sequence), (CLIENT_ID, 0));
        }
    }
}

#[test]
fn a_connection_that_its_living_process_closes_ends_its_grabs() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    let mut reader = Client::attach(&sandbox.endpoint()).unwrap();
    let grab = |particle| {
        let mut client = Client::attach_as(&sandbox.endpoint(), CLIENT_ID).unwrap();
        let action = Action::Grab { particle, target: [0.5, 0.2, 0.3], over_s: 0.0 };
        assert!(client.request(action, DEADLINE).unwrap().is_applied());
        client
    };
    let (closed, _open) = (grab(90), grab(100));
    wait_for_grabs(&mut reader, &[90, 100]);
    drop(closed);
    wait_for_grabs(&mut reader, &[100]);
}

#[test]
fn the_release_of_a_lost_grab_is_recorded_and_verified() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let node = node(&sandbox, &["run", "curtain"]);
    let recorder = record(&sandbox, &file);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let killed = grabber(&sandbox, &["90"]);
    wait_for_grabs(&mut client, &[90]);
    kill(killed);
    wait_for_grabs(&mut client, &[]);
    recorder.interrupt().recorded();
    node.interrupt().success();
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", &file]).success();
    assert!(verified.contains("steps bit-identical"), "{verified}");

    let mut log = LogReader::open(Path::new(&file)).unwrap();
    let mut rows: Vec<OutcomeRow> = Vec::new();
    while let Some(logged) = log.next_message().unwrap() {
        if let Message::Outcome(row) = logged.message {
            rows.push(row);
        }
    }
    let summary: Vec<_> =
        rows.iter().map(|row| (row.client_id, row.disconnected, row.is_applied())).collect();
    assert_eq!(summary, [(CLIENT_ID, false, true), (CLIENT_ID, true, true)]);
    assert_eq!(rows[1].action, release(90));
}

#[test]
fn release_with_force_ends_the_grab_of_another_client() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let _grabber = grabber(&sandbox, &["90"]);
    assert_eq!(ctl(&sandbox, &["release", "90"])["reason"], "grabbed_by_other");
    let forced = ctl(&sandbox, &["release", "90", "--force"]);
    assert_eq!((&forced["status"], &forced["force"]), (&"applied".into(), &true.into()));
    wait_for_grabs(&mut client, &[]);
    assert_eq!(ctl(&sandbox, &["release", "90", "--force"])["reason"], "not_grabbed");
}
