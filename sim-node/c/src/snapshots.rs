//! Snapshots, borrowed from shared memory.

use std::mem::MaybeUninit;
use std::ptr;
use std::time::Duration;

use sim_contract::{Client, ParticleState, ReadError, SnapshotHeader};

use crate::attached::{ClientHandle, with_client};
use crate::handles::Handles;
use crate::outcome::{CatenaryResult, Failure, guard};
use crate::pointers::{check_place, timeout, write};

/// A snapshot, borrowed from shared memory. The data is read-only memory of another process: writing to
/// it ends the program.
///
/// It is valid until `catenary_release_snapshot`, also after the client was detached or the node has
/// ended. A client may hold four snapshots at a time.
#[derive(Debug)]
#[repr(C)]
pub struct Snapshot {
    /// The header.
    pub header: *const SnapshotHeader,
    /// The particles, by index.
    pub particles: *const ParticleState,
    /// Number of particles.
    pub particle_count: usize,
    /// For the library; 0 after the release.
    pub handle: usize,
}

impl Snapshot {
    const NONE: Self =
        Self { header: ptr::null(), particles: ptr::null(), particle_count: 0, handle: 0 };
}

static SNAPSHOTS: Handles<sim_contract::Snapshot> = Handles::new();

pub(crate) fn keep(held: sim_contract::Snapshot) -> Snapshot {
    let (header, particles) = (ptr::from_ref(held.header()), held.particles());
    let (particles, particle_count) = (particles.as_ptr(), particles.len());
    // Moving the value does not move the memory that it holds.
    Snapshot { header, particles, particle_count, handle: SNAPSHOTS.insert(held) }
}

/// Borrows the oldest unread snapshot, or waits for the next one. The first call of a client returns the
/// latest published one. A client that is more than 64 snapshots behind misses some; `snapshot_index` of
/// the header shows it. Release each snapshot.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_next_snapshot(
    client: *mut ClientHandle,
    timeout_s: f64,
    snapshot: Option<&mut MaybeUninit<Snapshot>>,
) -> CatenaryResult {
    borrow(client, timeout_s, snapshot, Client::next_snapshot)
}

/// Borrows the newest unread snapshot and skips those before it, or waits for the next one. Release each
/// snapshot.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_latest_snapshot(
    client: *mut ClientHandle,
    timeout_s: f64,
    snapshot: Option<&mut MaybeUninit<Snapshot>>,
) -> CatenaryResult {
    borrow(client, timeout_s, snapshot, Client::latest_snapshot)
}

/// Writes a snapshot that `read` returns, or one without a handle: the release of a snapshot that was never
/// received is then an error.
fn borrow(
    client: *mut ClientHandle,
    timeout_s: f64,
    mut snapshot: Option<&mut MaybeUninit<Snapshot>>,
    read: fn(&mut Client, Duration) -> Result<Option<sim_contract::Snapshot>, ReadError>,
) -> CatenaryResult {
    if let Some(place) = &mut snapshot {
        place.write(Snapshot::NONE);
    }
    with_client(client, |attached| {
        check_place(snapshot.as_deref(), "snapshot")?;
        let timeout = timeout(timeout_s)?;
        let held = read(&mut attached.client, timeout)?;
        write(snapshot, keep(held.ok_or_else(|| attached.nothing(timeout))?), "snapshot")
    })
}

/// Returns a snapshot to the node, and sets all fields of `*snapshot` to 0. Another release, or the
/// release of a copy, is `CATENARY_MISUSE`. Any thread may release it.
#[unsafe(no_mangle)]
pub extern "C" fn catenary_release_snapshot(snapshot: Option<&mut Snapshot>) -> CatenaryResult {
    guard(|| {
        let snapshot = snapshot.ok_or_else(|| Failure::misuse("snapshot is null"))?;
        let held = SNAPSHOTS.remove(snapshot.handle);
        *snapshot = Snapshot::NONE;
        held.map(drop).ok_or_else(|| Failure::misuse("the snapshot was released before"))
    })
}
