//! Actions that send commands to the node.

use std::time::Duration;

use sim_contract::{Action, Client, RequestError};

use crate::faults::action::Ending;
use crate::faults::actor::{Actor, Ends};
use crate::faults::world::World;
use crate::programs::Program;
use crate::wait::{DEADLINE, Deadline};

/// Ends of `ctl`: applied or answered, a usage error, rejected.
const CTL_ENDS: Ends = Ends {
    codes: &[0, 2, 4],
    errors: &["the scene has no particle", "there is no built-in scene", "missing.toml"],
    needs_no_signal: true,
};
const CTL_ALONE: Ends = Ends { codes: &[2], errors: &["no node runs as"], needs_no_signal: true };
/// Ends of a client that grabs a particle. It fails if another client has grabbed it, or if the node is
/// paused.
const GRABBER_ENDS: Ends = Ends { codes: &[0], errors: &["error: "], needs_no_signal: true };

/// Client id of the first client that stays connected.
const CLIENT_ID: u64 = 1000;
/// Client id of the first client of a flood.
const FLOOD_ID: u64 = 2000;

impl World {
    pub(super) fn ctl(&mut self, line: &str) {
        let ends = self.ctl_ends();
        let words: Vec<_> = ["ctl"].into_iter().chain(line.split(' ')).collect();
        let finished = self.run(Program::SimNode, &words, ends);
        if line.starts_with("load") && finished.code == Some(0) {
            self.load_count += 1;
            self.check_clients_follow();
        }
    }

    pub(super) fn kill_ctl(&mut self, line: &str, changes: u32) {
        let words: Vec<_> = ["ctl"].into_iter().chain(line.split(' ')).collect();
        let ctl = Actor::start(Program::SimNode, &self.sandbox, &words, self.ctl_ends());
        ctl.kill_after(changes, &self.files, &mut self.journal);
        // It may have sent its command before.
        self.load_count += u64::from(line.starts_with("load"));
    }

    fn ctl_ends(&self) -> Ends {
        if self.node.is_some() { CTL_ENDS } else { CTL_ALONE }
    }

    /// Sends a command from a client that stays connected, also from node to node. A running node answers
    /// each command.
    pub(super) fn request(&mut self, client: usize, command: &str) {
        let is_running = self.node.is_some();
        let Some(client) = self.client(client) else { return };
        let action = parse(command);
        let outcome = client.request(action, DEADLINE);
        assert_eq!(outcome.is_ok(), is_running, "{outcome:?}");
        let is_load = matches!(action, Action::Load { .. });
        if is_load && outcome.is_ok_and(|outcome| outcome.is_applied()) {
            self.load_count += 1;
            self.check_clients_follow();
        }
    }

    /// Returns a client, attached if there is a node.
    pub(super) fn client(&mut self, index: usize) -> Option<&mut Client> {
        let slot = &mut self.clients[index];
        if slot.is_none() && self.node.is_some() {
            let client = Client::attach_as(&self.sandbox.endpoint(), CLIENT_ID + index as u64);
            *slot = Some(client.expect("a client of a running node"));
        }
        slot.as_mut()
    }

    /// Sends `count` commands from each of some clients, as fast as the node receives them. Each command has
    /// an outcome.
    pub(super) fn flood(&mut self, clients: usize, count: usize, command: &str) {
        if self.node.is_none() {
            return;
        }
        let attach = |index| {
            let client = Client::attach_as(&self.sandbox.endpoint(), FLOOD_ID + index as u64);
            Flooder {
                client: client.expect("a client of a running node"),
                to_send: count,
                sent: 0,
                answered: 0,
            }
        };
        let mut flooders: Vec<_> = (0..clients).map(attach).collect();
        let action = parse(command);
        let deadline = Deadline::start();
        while flooders.iter().any(|flooder| !flooder.is_done()) {
            deadline.check("the outcomes of a flood of commands");
            for flooder in &mut flooders {
                flooder.advance(action);
            }
        }
    }

    /// Waits until the node has made some steps, or is paused.
    pub(super) fn wait_for_steps(&mut self, steps: u64) {
        if self.node.is_none() {
            return;
        }
        let client = self.client(0).expect("a client of a running node");
        let (mut run_id, mut first, mut step) = (0, 0, 0);
        let mut deadline = Deadline::start();
        loop {
            deadline.check("a step of the node");
            let status = client.status(DEADLINE).expect("a status").expect("a running node");
            // The client may be older than the node, and have an unread status of the node before.
            if status.run_id != run_id {
                (run_id, first, step) = (status.run_id, status.step, status.step);
            }
            if status.is_paused() || status.step >= first + steps {
                return;
            }
            // A busy machine makes few steps. Only a node that makes none is stuck.
            if status.step > step {
                (step, deadline) = (status.step, Deadline::start());
            }
        }
    }

    /// Sends the load of a scene, and kills the node after some changes of the files of the domain, or when
    /// the load is done.
    pub(super) fn kill_node_in_load(&mut self, scene: &str, changes: u32) {
        let Some(mut node) = self.node.take() else { return };
        let client = Client::attach_as(&self.sandbox.endpoint(), FLOOD_ID);
        let mut client = client.expect("a client of a running node");
        let command = format!(r#"{{"kind":"load","scene":"{scene}"}}"#);
        client.send(parse(&command)).expect("a node that receives commands");
        let mut is_answered = || matches!(client.next_outcome(Duration::ZERO), Ok(Some(_)));
        self.files.wait_for_changes(changes, || is_answered() || !node.is_running());
        self.node = Some(node);
        self.end_node(Ending::Kill);
    }

    /// Kills a client after some changes of the files of the domain. It may have grabbed a particle.
    pub(super) fn kill_grabber(&mut self, particle: u32, changes: u32) {
        let args = [particle.to_string()];
        let args: Vec<_> = args.iter().map(String::as_str).collect();
        let grabber = Actor::start(Program::Grab, &self.sandbox, &args, GRABBER_ENDS);
        grabber.kill_after(changes, &self.files, &mut self.journal);
    }
}

/// A client that sends many commands.
struct Flooder {
    client: Client,
    to_send: usize,
    sent: usize,
    answered: usize,
}

impl Flooder {
    fn is_done(&self) -> bool {
        self.sent == self.to_send && self.answered == self.sent
    }

    /// Sends as many commands as the node has room for, and receives the outcomes that have arrived.
    fn advance(&mut self, action: Action) {
        while self.sent < self.to_send {
            match self.client.send(action) {
                Ok(_) => self.sent += 1,
                Err(RequestError::QueueFull { .. }) => break,
                Err(error) => panic!("{error}"),
            }
        }
        while let Some(outcome) = self.client.next_outcome(Duration::ZERO).expect("an outcome") {
            assert_eq!(outcome.command.client_id, self.client.client_id());
            self.answered += 1;
        }
    }
}

fn parse(command: &str) -> Action {
    serde_json::from_str(command).unwrap_or_else(|error| panic!("{error} in {command}"))
}
