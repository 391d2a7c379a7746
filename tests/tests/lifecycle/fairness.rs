//! Clients that send commands without a pause keep no other client waiting.

use std::error::Error;
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use integration_tests::{DEADLINE, Process, Program, Sandbox};
use sim_contract::{Action, Client};

type Failure = Box<dyn Error>;

/// Clients that fill their queues all the time. Together they fill every turn of the node.
const FLOODERS: usize = 4;
/// Number of commands whose outcome is awaited.
const REQUESTS: usize = 20;
/// Most steps until a command is applied. It waits for one if the node has no room for more commands.
const STEPS_MAX: usize = 3;

#[test]
fn a_client_beside_flooding_clients_is_answered() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    // The flooding clients are the first to connect and have the lowest ids.
    let endpoint = sandbox.endpoint();
    let is_over = AtomicBool::new(false);
    let are_connected = Barrier::new(FLOODERS + 1);
    let steps = thread::scope(|scope| {
        for id in 1..=FLOODERS as u64 {
            let (endpoint, is_over, are_connected) = (&endpoint, &is_over, &are_connected);
            scope.spawn(move || {
                let mut flooder = Client::attach_as(endpoint, id).unwrap();
                are_connected.wait();
                while !is_over.load(Ordering::Relaxed) {
                    // A full queue is the purpose.
                    let _full = flooder.send(Action::Pin { particle: 90 });
                }
            });
        }
        are_connected.wait();
        // The node waits for a member of the lockstep, so no outcome is overwritten before this thread reads
        // it, however long the machine keeps it waiting.
        let mut honest = Client::attach_as(&endpoint, 1 << 52).unwrap();
        let joined = honest.join_lockstep(DEADLINE).map_err(Failure::from);
        let steps: Result<Vec<usize>, Failure> =
            joined.and_then(|()| (0..REQUESTS).map(|_| count_steps(&mut honest)).collect());
        // The threads end before a failure can leave the scope.
        is_over.store(true, Ordering::Relaxed);
        steps
    });
    let steps = steps.unwrap();
    assert!(steps.iter().all(|&count| count <= STEPS_MAX), "{steps:?}");
}

/// Sends a command in a turn of the lockstep, and counts the steps until it has been applied.
fn count_steps(honest: &mut Client) -> Result<usize, Failure> {
    honest.next_turn(DEADLINE)?.ok_or("no turn")?;
    let sequence = honest.send(Action::Unpin { particle: 100 })?;
    let mut count = 0;
    loop {
        honest.ready()?;
        honest.next_turn(DEADLINE)?.ok_or("no turn")?;
        count += 1;
        if let Some(outcome) = honest.next_outcome(Duration::ZERO)? {
            if !outcome.is_applied() || outcome.command.sequence != sequence {
                return Err(format!("outcome of command {sequence}: {outcome:?}").into());
            }
            honest.ready()?;
            return Ok(count);
        }
    }
}
