//! The forces on colliders, anchors and fixed particles.

use std::mem::MaybeUninit;

use sim_contract::{ForceRow, ForcesHeader, SnapshotHeader};

use crate::attached::{ClientHandle, with_client};
use crate::outcome::{CatenaryResult, Failure};
use crate::pointers::{check_place, timeout, write};

/// The impulses of a step, borrowed from the client. A force in N is `impulse` times `header.rate_hz`, and a
/// torque in N m is `angular_impulse` times it.
#[derive(Debug)]
#[repr(C)]
pub struct Forces {
    /// Header of the rows: the step, and its rate.
    pub header: ForcesHeader,
    /// The rows: of each collider, then of each anchor, then of each pinned, grabbed or anchored particle, each
    /// by index. The row of a collider is the one at its index.
    pub rows: *const ForceRow,
    /// Number of rows.
    pub row_count: usize,
}

/// Reads the newest forces on colliders, anchors and pinned, grabbed or anchored particles, and waits only if
/// none have arrived. The rows are valid until the next call of this function with this client.
///
/// A node computes forces only while a client reads them: from the first call on, until the client is
/// detached. So the first call waits for the next step. A member of the lockstep calls it once with the
/// timeout 0 before its first turn.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_forces(
    client: *mut ClientHandle,
    timeout_s: f64,
    forces: Option<&mut MaybeUninit<Forces>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        check_place(forces.as_deref(), "forces")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.forces(timeout)?;
        let read = read.ok_or_else(|| attached.nothing(timeout))?;
        write(forces, lend(read, &mut attached.lists.forces), "forces")
    })
}

/// Reads the forces of the step of a snapshot. `snapshot` is its header, or a copy of it. Call it for snapshots
/// in their order. The rows are valid until the next call of this function with this client.
///
/// `CATENARY_TIMEOUT` means that there are none: the snapshot is from before the first call of one of the two
/// functions, or more than 64 snapshots old, or the client has read forces of a later step.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_read_forces_of(
    client: *mut ClientHandle,
    snapshot: Option<&SnapshotHeader>,
    timeout_s: f64,
    forces: Option<&mut MaybeUninit<Forces>>,
) -> CatenaryResult {
    with_client(client, |attached| {
        let snapshot = snapshot.ok_or_else(|| Failure::misuse("snapshot is null"))?;
        check_place(forces.as_deref(), "forces")?;
        let timeout = timeout(timeout_s)?;
        let read = attached.client.forces_of(snapshot, timeout)?;
        let read = read.ok_or_else(|| attached.gone_or(timeout, none_of(snapshot)))?;
        write(forces, lend(read, &mut attached.lists.forces_of), "forces")
    })
}

fn lend(read: sim_contract::Forces, list: &mut Vec<ForceRow>) -> Forces {
    *list = read.rows;
    Forces { header: read.header, rows: list.as_ptr(), row_count: list.len() }
}

fn none_of(snapshot: &SnapshotHeader) -> String {
    let step = snapshot.step;
    format!(
        "no forces of step {step}: it is too old, or from before the first call, or later ones were read"
    )
}
