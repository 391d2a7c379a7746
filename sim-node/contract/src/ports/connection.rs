//! The connections through which commands arrive.

use iceoryx2::prelude::{CallbackProgression, NodeState, PortFactory};

use crate::messages::command::Command;
use crate::ports::session::Values;

/// A connection of a client: its publisher of commands. A client that connects again has another
/// one, even under the same client id.
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

/// Returns the connections whose clients are alive.
///
/// A client that closes its connection removes the publisher. A killed one leaves it behind until a
/// process cleans up, so the state of each publisher's node decides. A node whose state cannot be
/// read counts as alive: no grab must end by mistake.
pub(crate) fn living(commands: &Values<Command>) -> Vec<ConnectionId> {
    let mut publishers = Vec::new();
    commands.dynamic_config().list_publishers(|publisher| {
        publishers.push((publisher.node_id, ConnectionId(publisher.publisher_id.value())));
        CallbackProgression::Continue
    });
    let mut dead = Vec::new();
    // After an error, the nodes that were not listed count as alive.
    let _ = commands.nodes(|node| {
        if let NodeState::Dead(_) = node {
            dead.push(*node.node_id());
        }
        CallbackProgression::Continue
    });
    publishers.retain(|(node, _)| !dead.contains(node));
    publishers.into_iter().map(|(_, connection)| connection).collect()
}
