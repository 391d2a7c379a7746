//! Clients that send commands without a pause keep no other client waiting.

use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use integration_tests::{DEADLINE, Process, Program, Sandbox};
use sim_contract::{Action, Client, Outcome};

/// Clients that fill their queues all the time. More would only slow down a small machine.
const FLOODERS: usize = 4;

#[test]
fn a_client_beside_flooding_clients_is_answered() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    // The flooding clients are the first to connect and have the lowest ids.
    let endpoint = sandbox.endpoint();
    let is_over = AtomicBool::new(false);
    let are_connected = Barrier::new(FLOODERS + 1);
    thread::scope(|scope| {
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
        let mut honest = Client::attach_as(&endpoint, 1 << 52).unwrap();
        let answers: Vec<_> =
            (0..20).map(|_| honest.request(Action::Unpin { particle: 100 }, DEADLINE)).collect();
        // The threads end before a failure can leave the scope.
        is_over.store(true, Ordering::Relaxed);
        assert!(answers.iter().all(|answer| answer.as_ref().is_ok_and(Outcome::is_applied)));
    });
}
