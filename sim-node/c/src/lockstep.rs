//! Membership in the lockstep.

use std::mem::MaybeUninit;
use std::num::NonZeroU32;

use crate::attached::{ClientHandle, with_client};
use crate::outcome::{CatenaryResult, Failure};
use crate::pointers::{check_place, timeout, write};
use crate::snapshots::{Snapshot, keep};

/// Joins the lockstep: from now on, the node waits in each turn of this client until the client has called
/// `catenary_ready`. The commands that the client sends before that take effect in the next step, so the run is the same each
/// time.
///
/// The first turn is at the step of joining, and each further turn `every` steps after the last one; 1 is each step. A step
/// that shows a load, a reset, a rewind or a restored state is always a turn, and so is step 0 of a new run; the next turn
/// counts from there. A turn that falls on a step that the node does not publish (--every) moves to the next published step.
///
/// The node goes on without a client that it has waited for too long: 2 s, unless it was started with
/// another --lockstep-timeout. `catenary_missed_turns` shows it.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_join_lockstep(
    client: *mut ClientHandle,
    every: u32,
    timeout_s: f64,
) -> CatenaryResult {
    with_client(client, |attached| {
        let every = NonZeroU32::new(every)
            .ok_or_else(|| Failure::misuse("every is 0 (allowed: 1 or more)"))?;
        Ok(attached.client.join_lockstep_every(every, timeout(timeout_s)?)?)
    })
}

/// Borrows the newest snapshot that the node waits for this client at, or waits for it. Release the
/// snapshot, and call `catenary_ready` after sending the commands of the turn. `CATENARY_TIMEOUT` means
/// that the node is paused, or waits for another member or for its deadline.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_next_turn(
    client: *mut ClientHandle,
    timeout_s: f64,
    snapshot: Option<&mut MaybeUninit<Snapshot>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(snapshot.as_deref(), "snapshot")?;
        let timeout = timeout(timeout_s)?;
        let held = attached.client.next_turn(timeout)?;
        write(snapshot, keep(held.ok_or_else(|| attached.nothing(timeout))?), "snapshot")
    })
}

/// Ends the turn that `catenary_next_turn` has begun.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_ready(client: *mut ClientHandle) -> CatenaryResult {
    with_client(client, |attached| Ok(attached.client.ready()?))
}

/// Gets the number of turns that the node has computed without this client since it joined, up to the last turn
/// of `catenary_next_turn`, because it was not ready in time. Turns of a replay are not counted.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_missed_turns(
    client: *mut ClientHandle,
    count: Option<&mut MaybeUninit<u64>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(count.as_deref(), "count")?;
        write(count, attached.client.missed_turns(), "count")
    })
}

/// Leaves the lockstep: the node goes on without waiting for this client. Detaching does the same.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_leave_lockstep(client: *mut ClientHandle) -> CatenaryResult {
    with_client(client, |attached| {
        attached.client.leave_lockstep();
        Ok(())
    })
}
