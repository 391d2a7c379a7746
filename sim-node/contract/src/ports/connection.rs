//! The connections through which the messages of clients arrive.

use std::collections::BTreeMap;

use bytemuck::Pod;
use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::prelude::{CallbackProgression, NodeState, PortFactory, ZeroCopySend};
use sim_messages::{BORROWED_UPDATES_MAX, Command};

use crate::ports::port::Header;
use crate::ports::raw;
use crate::ports::reader::Reader;

/// A connection of a client: its publisher of commands or of a member's messages. A client that
/// connects again has another one, even under the same client id.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct ConnectionId(pub u128);

/// A command with the connection that it came through.
#[derive(Debug, Clone, Copy)]
pub struct ReceivedCommand {
    /// The command as it was sent.
    pub command: Command,
    /// The connection of its sender.
    pub connection: ConnectionId,
}

/// Receives the messages that have arrived, those of each connection in the order of sending, and at
/// most one queue of `buffered` messages of each, so that a client that sends without a pause keeps no
/// other waiting. Ends early at a client with a broken connection.
pub(crate) fn receive_round<T: Pod + ZeroCopySend>(
    reader: &Reader<T>,
    buffered: usize,
    mut add: impl FnMut(T, ConnectionId),
) {
    let mut counts = BTreeMap::new();
    // A subscriber skips the connections of which it holds the most samples that it may. Holding the
    // last ones of a queue is the only way to reach the connections behind it.
    let mut held = Vec::new();
    while let Ok(Some(sample)) = reader.receive() {
        let connection = ConnectionId(sample.origin());
        if let Some(value) = sample.payload().first() {
            add(*value, connection);
        }
        let count = counts.entry(connection).or_insert(0);
        *count += 1;
        if *count > buffered - BORROWED_UPDATES_MAX {
            held.push(sample);
        }
    }
}

/// Receives messages with a payload, at most `count_max`, and of each connection at most as many as a
/// reader may hold. Ends early at a client with a broken connection.
pub(crate) fn receive_held<H: Header>(
    reader: &Reader<u8, H>,
    count_max: usize,
    mut add: impl FnMut(&H, &[u8], ConnectionId),
) {
    // As above, holding the messages is the way to reach every connection.
    let mut held = Vec::new();
    while held.len() < count_max
        && let Ok(Some(sample)) = reader.receive()
    {
        add(sample.user_header(), sample.payload(), ConnectionId(sample.origin()));
        held.push(sample);
    }
}

/// Returns the connections of a service. Those of killed clients count until somebody cleans up. It
/// reads shared memory only.
pub(crate) fn listed(service: &raw::Service) -> Vec<ConnectionId> {
    publishers(service).into_iter().map(|(_, connection)| connection).collect()
}

/// Returns the connections whose clients are alive.
///
/// A client that closes its connection removes the publisher. A killed one leaves it behind until a
/// process cleans up, so the state of each publisher's node decides. A node whose state cannot be
/// read counts as alive: no grab must end by mistake.
pub(crate) fn living(service: &raw::Service) -> Vec<ConnectionId> {
    let mut publishers = publishers(service);
    let dead = dead_nodes(service);
    publishers.retain(|(node, _)| !dead.contains(node));
    publishers.into_iter().map(|(_, connection)| connection).collect()
}

fn publishers(service: &raw::Service) -> Vec<(UniqueNodeId, ConnectionId)> {
    let mut publishers = Vec::new();
    service.dynamic_config().list_publishers(|publisher| {
        publishers.push((publisher.node_id, ConnectionId(publisher.publisher_id.value())));
        CallbackProgression::Continue
    });
    publishers
}

/// Returns `true` if a reader of a service is alive, in the same sense.
pub(crate) fn has_living_reader(service: &raw::Service) -> bool {
    let mut readers = Vec::new();
    service.dynamic_config().list_subscribers(|subscriber| {
        readers.push(subscriber.node_id);
        CallbackProgression::Continue
    });
    let dead = dead_nodes(service);
    readers.iter().any(|node| !dead.contains(node))
}

/// After an error, the nodes that were not listed count as alive.
fn dead_nodes(service: &raw::Service) -> Vec<UniqueNodeId> {
    let mut dead = Vec::new();
    let _ = service.nodes(|node| {
        if let NodeState::Dead(_) = node {
            dead.push(*node.node_id());
        }
        CallbackProgression::Continue
    });
    dead
}
