//! The processes whose messages a reader accepts.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::prelude::{CallbackProgression, PortFactory, ipc_threadsafe};
use sim_messages::NodeStatus;

use crate::ports::leftovers::lock::LockPlace;
use crate::ports::port::Service;
use crate::ports::service::OWNER_PORT;
use crate::ports::session::version_of;

/// Most processes to remember: the present owner, earlier owners with unread messages, and processes that only claim to be
/// the owner.
const REMEMBERED_MAX: usize = 8;

/// Accepts the messages of the owner of a name, and refuses those of every other process.
///
/// A service has room for more publishers than the owner needs, and iceoryx2 lets any process publish.
/// The owner is the process that holds the lock, and its publisher of `status` has the name [`OWNER_PORT`]. Behind a
/// tunnel, the process of the tunnel counts as the owner. An earlier owner is remembered, because its messages may still be
/// unread when another process has taken the name.
#[derive(Debug)]
pub(crate) struct Source {
    status: Arc<Service<NodeStatus>>,
    lock: LockPlace,
    /// Newest last.
    remembered: Mutex<VecDeque<Remembered>>,
}

/// An iceoryx2 node with a publisher of the name [`OWNER_PORT`].
#[derive(Debug, Clone, Copy)]
struct Remembered {
    node: UniqueNodeId,
    is_owner: bool,
}

impl Source {
    /// Accepts the present owner, even if it is gone when its messages are read, and later owners.
    pub(crate) fn new(status: &Arc<Service<NodeStatus>>, lock: LockPlace) -> Self {
        let source = Self { status: Arc::clone(status), lock, remembered: Mutex::default() };
        source.remember_new();
        source
    }

    /// Returns `true` if a message of this iceoryx2 node comes from an owner of the name.
    pub(crate) fn accepts(&self, node: UniqueNodeId) -> bool {
        self.find(node).unwrap_or_else(|| {
            self.remember_new();
            self.find(node).unwrap_or(false)
        })
    }

    fn find(&self, node: UniqueNodeId) -> Option<bool> {
        self.remembered().iter().find(|one| one.node == node).map(|one| one.is_owner)
    }

    fn remembered(&self) -> MutexGuard<'_, VecDeque<Remembered>> {
        // A list of ids is valid after any panic.
        self.remembered.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Remembers the nodes that have come since. Only then it reads the lock.
    fn remember_new(&self) {
        let is_mirror = is_mirror(&self.status);
        let nodes =
            if is_mirror { publisher_nodes(&self.status) } else { claiming_nodes(&self.status) };
        let mut remembered = self.remembered();
        for node in nodes {
            if remembered.iter().all(|one| one.node != node) {
                let is_owner = is_mirror || is_holder(node, &self.lock);
                remembered.push_back(Remembered { node, is_owner });
            }
        }
        while remembered.len() > REMEMBERED_MAX {
            remembered.pop_front();
        }
    }
}

/// Returns `true` if the process of an iceoryx2 node holds the lock of the name. A process in a container may own the
/// name through a lock that is not visible here, so a lock without a holder speaks against nobody.
fn is_holder(node: UniqueNodeId, lock: &LockPlace) -> bool {
    let Some(Some(holder)) = lock.holder() else { return true };
    let process = node.pid::<ipc_threadsafe::Service>();
    process.is_ok_and(|process| i64::from(process.value()) == i64::from(holder))
}

/// Returns `true` if a tunnel has created the service.
pub(crate) fn is_mirror(service: &Service<NodeStatus>) -> bool {
    version_of(service.attributes()).is_none()
}

/// Returns the iceoryx2 nodes, living or dead, that call themselves the owner: the publishers of `status` that are
/// named as an owner's. A tunnel has one without that name.
pub(crate) fn claiming_nodes(status: &Service<NodeStatus>) -> Vec<UniqueNodeId> {
    let mut nodes = Vec::new();
    status.dynamic_config().list_publishers(|publisher| {
        if publisher.publisher_name.as_str() == OWNER_PORT {
            nodes.push(publisher.node_id);
        }
        CallbackProgression::Continue
    });
    nodes
}

/// Returns the iceoryx2 nodes of the owners of the name, living or dead.
pub(crate) fn owner_nodes(status: &Service<NodeStatus>, lock: &LockPlace) -> Vec<UniqueNodeId> {
    let mut nodes = claiming_nodes(status);
    nodes.retain(|node| is_holder(*node, lock));
    nodes
}

/// Returns the iceoryx2 nodes of all publishers of `status`. Those of a mirror are the tunnel's.
fn publisher_nodes(status: &Service<NodeStatus>) -> Vec<UniqueNodeId> {
    let mut nodes = Vec::new();
    status.dynamic_config().list_publishers(|publisher| {
        nodes.push(publisher.node_id);
        CallbackProgression::Continue
    });
    nodes
}
