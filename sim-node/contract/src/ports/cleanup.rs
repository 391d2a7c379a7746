//! Removal of what dead processes left in a domain.
//!
//! iceoryx2 would do it on its own whenever a node is created or destroyed, but it waits forever for a
//! connection that a process was killed in the middle of creating. So those go first.

use std::time::Duration;

use iceoryx2::node::NodeView;
use iceoryx2::prelude::{CallbackProgression, Node, NodeState, PortFactory, ipc_threadsafe};

use crate::ports::domain::unfinished;

/// Longest wait for another process that cleans up after a dead process.
const TIMEOUT: Duration = Duration::from_millis(100);

/// Cleans up after all dead processes of the domain that no other process cleans up after.
pub(crate) fn clean_domain(node: &Node<ipc_threadsafe::Service>) {
    clean_up(node, Duration::ZERO);
}

/// Frees the places of dead processes in the services of the domain. Waits for other processes that
/// clean up.
pub(crate) fn free_places(node: &Node<ipc_threadsafe::Service>) {
    clean_up(node, TIMEOUT);
}

fn clean_up(node: &Node<ipc_threadsafe::Service>, timeout: Duration) {
    unfinished::remove_connections(node.config());
    node.blocking_cleanup_dead_nodes(timeout);
    unfinished::remove_listeners(node.config());
}

/// Frees the places of dead processes in one service.
pub(crate) fn free_ports(service: &impl PortFactory<Service = ipc_threadsafe::Service>) {
    // Without a list, there is nothing to clean up.
    let _ = service.nodes(|node| {
        if let NodeState::Dead(dead) = node
            && let Some(details) = dead.details()
        {
            unfinished::remove_connections(details.config());
        }
        CallbackProgression::Continue
    });
    service.blocking_cleanup_dead_nodes(TIMEOUT);
}
