//! The processes whose messages a reader accepts.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::prelude::{CallbackProgression, PortFactory};

use crate::messages::status::NodeStatus;
use crate::ports::service::OWNER_PORT;
use crate::ports::session::{Values, version_of};

/// Most owners to remember: the present one, and earlier ones with unread messages.
const OWNERS_MAX: usize = 8;

/// Accepts the messages of the owner of a name, and refuses those of every other process.
///
/// A service has room for more publishers than the owner needs, and iceoryx2 lets any process publish.
/// The owner has a publisher of `status` with a name of its own; at the far end of a tunnel, the tunnel
/// stands for it. Messages of an earlier owner may still be unread when another one has taken the name, so
/// it is remembered.
#[derive(Debug)]
pub(crate) struct Source {
    status: Arc<Values<NodeStatus>>,
    /// Newest last.
    owners: Mutex<VecDeque<UniqueNodeId>>,
}

impl Source {
    /// Accepts the present owner, even if it is gone when its messages are read, and later owners.
    pub(crate) fn new(status: &Arc<Values<NodeStatus>>) -> Self {
        let source = Self { status: Arc::clone(status), owners: Mutex::default() };
        source.remember_owner();
        source
    }

    /// Returns `true` if a message of this iceoryx2 node comes from an owner of the name.
    pub(crate) fn accepts(&self, node: UniqueNodeId) -> bool {
        if !self.owners().contains(&node) {
            self.remember_owner();
        }
        self.owners().contains(&node)
    }

    fn owners(&self) -> MutexGuard<'_, VecDeque<UniqueNodeId>> {
        // A list of ids is valid after any panic.
        self.owners.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn remember_owner(&self) {
        let mut owners = self.owners();
        for node in source_nodes(&self.status) {
            if !owners.contains(&node) {
                owners.push_back(node);
            }
        }
        while owners.len() > OWNERS_MAX {
            owners.pop_front();
        }
    }
}

/// Returns `true` if a tunnel has created the service.
pub(crate) fn is_mirror(service: &Values<NodeStatus>) -> bool {
    version_of(service.attributes()).is_none()
}

/// Returns the iceoryx2 nodes of the owners of the name, living or dead: the publishers of `status` that are
/// named as an owner's. A tunnel has one without that name.
pub(crate) fn owner_nodes(status: &Values<NodeStatus>) -> Vec<UniqueNodeId> {
    let mut nodes = Vec::new();
    status.dynamic_config().list_publishers(|publisher| {
        if publisher.publisher_name.as_str() == OWNER_PORT {
            nodes.push(publisher.node_id);
        }
        CallbackProgression::Continue
    });
    nodes
}

/// Returns the iceoryx2 nodes of all publishers of `status`.
fn publisher_nodes(status: &Values<NodeStatus>) -> Vec<UniqueNodeId> {
    let mut nodes = Vec::new();
    status.dynamic_config().list_publishers(|publisher| {
        nodes.push(publisher.node_id);
        CallbackProgression::Continue
    });
    nodes
}

/// Returns the iceoryx2 nodes whose messages are those of the owner: of a mirror, the tunnel's.
fn source_nodes(status: &Values<NodeStatus>) -> Vec<UniqueNodeId> {
    if is_mirror(status) { publisher_nodes(status) } else { owner_nodes(status) }
}
