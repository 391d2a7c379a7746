//! The attached clients, and the data that the program has borrowed from each.

use std::cell::Cell;
use std::ffi::CString;
use std::ptr;
use std::sync::{Arc, Mutex, TryLockError};
use std::time::Duration;

use sim_contract::{
    BendState, Client, ColliderState, ConstraintState, ForceRow, ParameterState, TornConstraint,
    Triangle,
};
use sim_host::clock::monotonic_ns;

use crate::handles::Handles;
use crate::outcome::{CatenaryResult, Failure, guard};

/// A connection to a simulation. It reads snapshots and sends commands.
///
/// A client may be used by any thread, but by one at a time: a call while another thread is in a call
/// of the same client returns `CATENARY_MISUSE`. Threads that work at the same time attach one client
/// each. A client does not survive `fork`.
#[derive(Debug)]
pub struct ClientHandle {
    _opaque: [u8; 0],
}

/// A client with the lists that the program has borrowed from it.
#[derive(Debug)]
pub(crate) struct Attached {
    pub(crate) client: Client,
    pub(crate) lists: Lists,
    /// When a call last looked for the node, as CLOCK_MONOTONIC in nanoseconds.
    looked_at_ns: Cell<u64>,
}

/// The lists that the program has borrowed from a client.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    pub(crate) topology: Vec<ConstraintState>,
    pub(crate) bends: Vec<BendState>,
    pub(crate) surface: Vec<Triangle>,
    pub(crate) torn: Vec<TornConstraint>,
    pub(crate) parameters: Vec<ParameterState>,
    pub(crate) colliders: Vec<ColliderState>,
    pub(crate) forces: Vec<ForceRow>,
    pub(crate) forces_of: Vec<ForceRow>,
    pub(crate) scene: CString,
}

static CLIENTS: Handles<Arc<Mutex<Attached>>> = Handles::new();

/// Shortest time between two calls without a message that look for the node. That costs about as much as
/// opening a few files.
const LOOK_PERIOD: Duration = Duration::from_millis(100);

/// Runs a call of a client.
pub(crate) fn with_client(
    handle: *const ClientHandle,
    call: impl FnOnce(&mut Attached) -> Result<(), Failure>,
) -> CatenaryResult {
    guard(|| {
        let attached = CLIENTS.get(handle.addr()).ok_or_else(unknown)?;
        match attached.try_lock() {
            Ok(mut attached) => call(&mut attached),
            Err(TryLockError::WouldBlock) => Err(Failure::misuse(
                "another thread is in a call of this client: attach one per thread",
            )),
            Err(TryLockError::Poisoned(_)) => Err(Failure::bug()),
        }
    })
}

fn unknown() -> Failure {
    Failure::misuse("this is no client: it is null, or it was detached")
}

impl Attached {
    /// Returns the reason why nothing arrived. A program that asks often learns of the node's end a little later
    /// than one that waits.
    pub(crate) fn nothing(&self, timeout: Duration) -> Failure {
        self.gone_or(timeout, format!("nothing arrived within {timeout:?}: is the node paused?"))
    }

    /// Same as [`Attached::nothing`], with the text for a node that lives.
    pub(crate) fn gone_or(&self, timeout: Duration, text: String) -> Failure {
        let since = Duration::from_nanos(monotonic_ns().saturating_sub(self.looked_at_ns.get()));
        let is_due = timeout >= LOOK_PERIOD || since >= LOOK_PERIOD;
        if is_due && let Err(gone) = self.check_node() {
            return gone;
        }
        Failure::new(CatenaryResult::Timeout, text)
    }

    /// Looks for the node.
    pub(crate) fn check_node(&self) -> Result<(), Failure> {
        self.looked_at_ns.set(monotonic_ns());
        let gone = || Failure::new(CatenaryResult::Gone, "the node has ended");
        self.client.is_owner_alive().then_some(()).ok_or_else(gone)
    }
}

/// Keeps a client, and returns its handle.
pub(crate) fn keep(client: Client) -> *mut ClientHandle {
    let looked_at_ns = Cell::new(monotonic_ns());
    let attached = Attached { client, lists: Lists::default(), looked_at_ns };
    ptr::without_provenance_mut(CLIENTS.insert(Arc::new(Mutex::new(attached))))
}

/// Detaches a client.
pub(crate) fn remove(handle: *const ClientHandle) -> Result<(), Failure> {
    CLIENTS.remove(handle.addr()).map(drop).ok_or_else(unknown)
}
