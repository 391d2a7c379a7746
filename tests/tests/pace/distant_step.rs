//! Commands to a node whose next step is far away: with a period of 1,000 s, nothing that these
//! tests wait for could come with a step.

use integration_tests::{DEADLINE, Process, Program, Sandbox, ctl};
use sim_contract::{Action, Client};

/// A node at 1 Hz and a thousandth of real time, and the last step that it made.
fn slow_node(sandbox: &Sandbox) -> (Process, u64) {
    let node = Process::start_ready(Program::SimNode, sandbox, &["run", "curtain", "--rate", "1"]);
    let outcome = ctl(sandbox, &["set", "time_scale", "0.001"]);
    (node, outcome["step"].as_u64().unwrap())
}

#[test]
fn a_node_answers_commands_while_it_waits_for_a_distant_step() {
    let sandbox = Sandbox::new();
    let (_node, step) = slow_node(&sandbox);
    // The step that the change was for may have been due when it came, or is still awaited.
    let first = ctl(&sandbox, &["pin", "100"])["step"].as_u64().unwrap();
    assert!((step..=step + 1).contains(&first), "{first} after {step}");
    for _ in 0..3 {
        assert_eq!(ctl(&sandbox, &["pin", "101"])["step"], first);
    }
}

#[test]
fn a_new_time_scale_moves_the_step_that_the_node_waits_for() {
    let sandbox = Sandbox::new();
    let (_node, _) = slow_node(&sandbox);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let action = Action::set("time_scale", 1000.0);
    let step = client.request(action, DEADLINE).unwrap().step;
    loop {
        let snapshot = client.next_snapshot(DEADLINE).unwrap().unwrap();
        if snapshot.header().step >= step {
            break;
        }
    }
}

#[test]
fn pauses_and_resets_take_effect_while_the_node_waits_for_a_distant_step() {
    let sandbox = Sandbox::new();
    let (_node, _) = slow_node(&sandbox);
    let reset = ctl(&sandbox, &["reset"])["step"].as_u64().unwrap();
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let snapshot = loop {
        let snapshot = client.next_snapshot(DEADLINE).unwrap().unwrap();
        if snapshot.header().step >= reset {
            break snapshot;
        }
    };
    assert_eq!((snapshot.header().step, snapshot.header().scene_step), (reset, 0));
    ctl(&sandbox, &["pause"]);
    assert_eq!(ctl(&sandbox, &["status"])["paused"], true);
    // The first step of a paused node is due at once.
    ctl(&sandbox, &["step"]);
    assert_eq!(ctl(&sandbox, &["hash"])["step"], reset + 1);
}
