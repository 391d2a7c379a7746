//! The processes whose messages a reader accepts.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use iceoryx2::identifiers::UniqueNodeId;

use crate::ports::services::Attachment;

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
    attachment: Arc<Attachment>,
    /// Newest last.
    owners: Mutex<VecDeque<UniqueNodeId>>,
}

impl Source {
    /// Accepts the present owner, even if it is gone when its messages are read, and later owners.
    pub(crate) fn new(attachment: &Arc<Attachment>) -> Self {
        let source = Self { attachment: Arc::clone(attachment), owners: Mutex::default() };
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
        for node in self.attachment.source_nodes() {
            if !owners.contains(&node) {
                owners.push_back(node);
            }
        }
        while owners.len() > OWNERS_MAX {
            owners.pop_front();
        }
    }
}
