//! Actions on programs that stay connected from node to node.

mod members;
mod readers;
mod restorers;

use crate::faults::actor::{Actor, Ends};
use crate::faults::world::World;
use crate::wait::{DEADLINE, wait_for};

/// Ends of a client that goes on until a signal.
const CLIENT_ENDS: Ends = Ends { codes: &[0], errors: &[], needs_no_signal: false };
/// Ends of a client without a node.
const CLIENT_ALONE: Ends = Ends { codes: &[], errors: &["no node runs as"], needs_no_signal: true };

impl World {
    fn client_ends(&self) -> Ends {
        if self.node.is_some() { CLIENT_ENDS } else { CLIENT_ALONE }
    }

    /// Returns the newest status of the running node.
    pub(super) fn node_status(&mut self) -> sim_contract::NodeStatus {
        let process_id = self.node.as_ref().expect("a running node").process_id();
        let client = self.client(0).expect("a client of a running node");
        wait_for("a status of the node", || {
            let status = client.status(DEADLINE).expect("a readable status")?;
            // The client may have an unread status of the node before.
            (status.process_id == process_id).then_some(status)
        })
    }

    /// Waits until every program that reads snapshots has seen one of the newest run.
    pub(super) fn check_clients_follow(&mut self) {
        let has_clients = !self.followers.is_empty() || self.members.iter().any(Option::is_some);
        if self.node.is_none() || !has_clients {
            return;
        }
        let run_id = self.node_status().run_id;
        let members = self.members.iter_mut().flatten().map(|member| &mut member.actor);
        for client in members.chain(&mut self.followers) {
            wait_for_run(client, run_id);
        }
    }
}

fn wait_for_run(client: &mut Actor, run_id: u64) {
    if client.is_stopped() {
        return;
    }
    let line = format!("run {run_id}");
    wait_for(&format!("a client that sees the run {run_id}"), || {
        (client.has_written(&line) || !client.is_running()).then_some(())
    });
}
