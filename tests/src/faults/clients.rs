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
        for index in 0..self.followers.len() {
            wait_for("a reader that sees the newest run", || {
                has_seen(&mut self.followers[index], run_id).then_some(())
            });
        }
        for slot in 0..self.members.len() {
            wait_for("a member that sees the newest run", || {
                let Some(member) = &mut self.members[slot] else { return Some(()) };
                // A paused node may never reach a step of this member.
                let has_seen = has_seen(&mut member.actor, run_id);
                (has_seen || self.node_status().is_paused()).then_some(())
            });
        }
    }
}

/// Returns `true` if a program has seen a run. A stopped one sees none.
fn has_seen(client: &mut Actor, run_id: u64) -> bool {
    client.is_stopped() || client.has_written(&format!("run {run_id}")) || !client.is_running()
}
