//! The files that dead processes leave in a domain, and their removal.
//!
//! iceoryx2 has no daemon. Each process creates files in the root of the domain and in `/dev/shm`, and removes them when
//! it ends. A killed process leaves its files, and another process removes them when it joins or leaves the
//! domain, or needs the place of a dead port. iceoryx2 itself removes what a complete node names. It waits without a
//! limit for a file that is unfinished, and does not find a file that no node names. So this folder removes those files
//! first. It never removes a file that a living process could still use:
//!
//! | what is left | its state | iceoryx2 | it is removed because |
//! |---|---|---|---|
//! | a node: its folder, its details and the three files of its monitor | complete | removes it with the ports that it names | the kernel has freed the lock of the monitor, so the process is dead |
//! | the same | a file is missing | cannot tell whether the process lives | the node is older than 10 s, and creation takes milliseconds |
//! | a node whose files are gone, but not its ports in the list of a service | forgotten | never frees the places | its files are written again, under the lock of the name, and iceoryx2 removes it ([`orphans`]) |
//! | the counter of nodes, the segment of a service, a connection of two ports | size 0, or no permission to read | waits | it stays unfinished for longer than its creation takes, or a process of the connection is dead ([`unfinished`]) |
//! | the segment of a listener that no service lists | any | does not find it | the process in the name of the file is dead, and no node has a tag for the port |
//! | a service: its configuration and its segment | unfinished | waits, or calls it corrupt | only the holder of the lock of the name creates services, and this process holds it |
//! | a service that no living process has open | complete | keeps it | the same, and its files are older than 10 s ([`on_request`]) |
//! | a segment of messages, a connection | complete, but its node is gone | does not find it | its processes are dead, no node names it, no process has it mapped, and it is older than 10 s ([`on_request`]) |
//! | the lock of a name | not locked | not its own | the kernel has freed it: the next owner takes it ([`lock`]) |
//!
//! The name of a port contains the id of its process. In a container, the same id can belong to another process.
//! That is why a segment also counts as living while a process maps it or a node names it.

pub(crate) mod lock;
pub(crate) mod on_request;
pub(crate) mod orphans;
pub(crate) mod unfinished;

use std::time::Duration;

use iceoryx2::node::NodeView;
use iceoryx2::prelude::{CallbackProgression, Node, NodeState, PortFactory, ipc_threadsafe};

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
