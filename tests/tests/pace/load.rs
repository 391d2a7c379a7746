//! Loads beside the loop, and loads of scenes with another rate, which begin a new run.

use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl, wait_for};
use sim_contract::{Action, Client, Tap, Text};

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

fn load(scene: &str) -> Action {
    Action::Load { scene: Text::new(scene).unwrap() }
}

#[test]
fn a_load_of_another_rate_begins_a_run_that_every_client_follows() {
    let sandbox = Sandbox::new();
    let node = node(&sandbox, &["run", "curtain"]);
    let mut client = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
    let mut tap = Tap::attach(&sandbox.endpoint()).unwrap();
    let first = *client.next_snapshot(DEADLINE).unwrap().unwrap().header();
    let outcome = client.request(load("free-fall"), DEADLINE).unwrap();
    assert!(outcome.is_applied() && outcome.begins_run());
    assert_eq!(outcome.run_id, first.run_id, "it ends the log of its run");
    let begun = wait_for("step 0 of the new run", || {
        let snapshot = client.next_snapshot(DEADLINE).unwrap()?;
        let header = *snapshot.header();
        (header.run_id != first.run_id).then_some(header)
    });
    assert_eq!((begun.step, begun.scene_step, begun.topology_revision), (0, 0, 0));
    assert_eq!((begun.outcome_count, begun.snapshot_index), (0, 0));
    let state = wait_for("a state of the new run", || {
        let state = tap.next_state(|_| {});
        let Some(state) = state else {
            tap.wait(Duration::from_millis(10));
            return None;
        };
        (state.header.run_id == begun.run_id).then_some((*state.header, state.load.header))
    });
    assert_eq!((state.0.step, state.1.rate_hz, state.1.run_id), (0, 60, begun.run_id));
    // The log of the new run begins with its first command.
    let pin = client.request(Action::Pin { particle: 0 }, DEADLINE).unwrap();
    assert_eq!((pin.run_id, pin.index), (begun.run_id, 0));
    let status = ctl(&sandbox, &["status"]);
    assert_eq!(
        (status["scene"].as_str(), status["rate_hz"].as_u64()),
        (Some("free-fall"), Some(60))
    );
    assert_eq!(ctl(&sandbox, &["load", "curtain"])["new_run"], true);
    node.interrupt().success();
}

#[test]
fn a_paused_node_stays_paused_in_a_new_run_and_ends_at_its_last_step() {
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--paused", "--duration", "1s", "--json"];
    let node = node(&sandbox, &args);
    ctl(&sandbox, &["step", "3"]);
    ctl(&sandbox, &["load", "free-fall"]);
    let status = ctl(&sandbox, &["status"]);
    assert_eq!((status["step"].as_u64(), status["paused"].as_bool()), (Some(0), Some(true)));
    ctl(&sandbox, &["step", "2"]);
    ctl(&sandbox, &["rewind", "--to-step", "1"]);
    let error = Process::run(Program::SimNode, &sandbox, &["ctl", "rewind", "1s"]);
    assert_eq!(error.code, Some(4), "the states of the other scene are gone: {}", error.stdout);
    ctl(&sandbox, &["resume"]);
    assert_eq!(node.wait().json()["steps"], 60, "one second at 60 Hz");
}

#[test]
fn a_rate_of_the_command_line_holds_for_every_scene() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--rate", "100", "--paused"]);
    let loaded = ctl(&sandbox, &["load", "free-fall"]);
    assert!(loaded["new_run"].is_null(), "{loaded}");
    let status = ctl(&sandbox, &["status"]);
    assert_eq!((status["rate_hz"].as_u64(), status["step"].as_u64()), (Some(100), Some(1)));
}

#[test]
fn a_member_of_the_lockstep_follows_a_load_of_another_rate() {
    let sandbox = Sandbox::new();
    let _node = node(&sandbox, &["run", "curtain", "--as-fast-as-possible"]);
    let mut member = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
    member.join_lockstep(DEADLINE).unwrap();
    let mut last = None;
    for turn in 0..60 {
        let header = *member.next_turn(DEADLINE).unwrap().unwrap().header();
        let place = (header.run_id, header.step);
        match last {
            // The command before turn 20 and that before turn 40 begin a run.
            Some((run_id, _)) if turn == 20 || turn == 40 => {
                assert!(place.0 != run_id && place.1 == 0, "turn {turn}: {place:?}");
            }
            Some((run_id, step)) => assert_eq!(place, (run_id, step + 1), "turn {turn}"),
            None => {}
        }
        last = Some(place);
        match turn {
            19 => _ = member.send(load("free-fall")).unwrap(),
            39 => _ = member.send(load("rope")).unwrap(),
            _ => {}
        }
        member.ready().unwrap();
    }
}

#[test]
fn a_large_scene_is_loaded_beside_the_loop_and_only_its_client_waits() {
    let sandbox = Sandbox::new();
    let large = "version = 1\n[solver]\nrate_hz = 240\n[[generate]]\nshape = \"cloth\"\n\
        columns = 200\nrows = 200\nspacing = 0.01\nmass = 0.01\n";
    let large = sandbox.write("large.toml", large);
    let node = node(&sandbox, &["run", "curtain"]);
    let mut loader = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
    let mut other = Client::attach_as(&sandbox.endpoint(), 8).unwrap();
    // Two answers, because one could be of the poll that received the load. The load may also end before
    // they come.
    wait_for("two answers during a load", || {
        loader.send(load(&large)).unwrap();
        loader.send(Action::Pin { particle: 39_999 }).unwrap();
        let answers =
            [0; 3].map(|_| other.request(Action::Pin { particle: 20 }, DEADLINE).unwrap().index);
        let loaded = loader.next_outcome(DEADLINE).unwrap().unwrap();
        let pin = loader.next_outcome(DEADLINE).unwrap().unwrap();
        // Only the new scene has the particle.
        assert!(loaded.is_applied() && pin.is_applied(), "{loaded:?} {pin:?}");
        assert!(loaded.index < pin.index && !loaded.begins_run());
        ctl(&sandbox, &["load", "curtain"]);
        (answers[1] < loaded.index).then_some(())
    });
    node.interrupt().success();
}
