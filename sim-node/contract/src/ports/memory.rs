//! Shared memory. Creating a segment does not reserve its memory: pages are taken when they are first
//! written, and SIGBUS ends a process that writes to one when none is left. So every segment is
//! allocated before its first use.

use std::fs::{File, OpenOptions};
use std::io;

use iceoryx2::prelude::Config;
use rustix::fs::{FallocateFlags, fallocate, statvfs};
use rustix::io::Errno;
use thiserror::Error;

use crate::ports::domain::files::{SHARED_MEMORY, segment};

/// Not enough memory in `/dev/shm`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "{needed_mib} MiB of shared memory are needed, but /dev/shm has only {available_mib} MiB left: \
     free some, or enlarge it (mount -o remount,size=... /dev/shm; docker run --shm-size ...)"
)]
pub struct MemoryError {
    /// Needed memory in MiB, rounded up.
    pub needed_mib: u64,
    /// Available memory in MiB, rounded down.
    pub available_mib: u64,
}

/// Shared memory for the ports and connections of one process. iceoryx2 writes to them without
/// allocating them first.
const PORTS_SIZE_BYTES: u64 = 2 << 20;

/// Checks that there is memory for the ports and connections of this process.
pub(crate) fn check_ports() -> Result<(), MemoryError> {
    check(PORTS_SIZE_BYTES)
}

/// Checks that a number of bytes are free in `/dev/shm`.
pub(crate) fn check(needed_bytes: u64) -> Result<(), MemoryError> {
    match available_bytes() {
        Some(available_bytes) => check_fits(needed_bytes, available_bytes),
        // If the size is unknown, it may still be large enough.
        None => Ok(()),
    }
}

pub(crate) fn check_fits(needed_bytes: u64, available_bytes: u64) -> Result<(), MemoryError> {
    if needed_bytes <= available_bytes {
        return Ok(());
    }
    Err(MemoryError {
        needed_mib: needed_bytes.div_ceil(1 << 20),
        available_mib: available_bytes >> 20,
    })
}

/// Returns the free memory in `/dev/shm`, in bytes; `None` if that folder cannot be read.
pub(crate) fn available_bytes() -> Option<u64> {
    let memory = statvfs(SHARED_MEMORY).ok()?;
    Some(memory.f_bavail * memory.f_frsize)
}

/// Error of allocating a segment.
#[derive(Debug)]
pub(crate) enum AllocateError {
    Full(MemoryError),
    System(io::Error),
}

/// Allocates all pages of the segment that holds the messages of a publisher. Returns the segment.
pub(crate) fn allocate(config: &Config, publisher_id: u128) -> Result<File, AllocateError> {
    let Some(path) = segment(config, &config.global.service.data_segment_suffix, publisher_id)
    else {
        let missing = io::Error::new(io::ErrorKind::NotFound, "its segment is missing");
        return Err(AllocateError::System(missing));
    };
    let file = OpenOptions::new().write(true).open(&path).map_err(AllocateError::System)?;
    let size_bytes = file.metadata().map_err(AllocateError::System)?.len();
    match fallocate(&file, FallocateFlags::empty(), 0, size_bytes) {
        Ok(()) => Ok(file),
        Err(Errno::NOSPC) => Err(AllocateError::Full(MemoryError {
            needed_mib: size_bytes.div_ceil(1 << 20),
            available_mib: available_bytes().unwrap_or_default() >> 20,
        })),
        Err(error) => Err(AllocateError::System(error.into())),
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::MetadataExt;

    use crate::client::Client;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::domain;
    use crate::ports::domain::files::segments;
    use crate::testing::TestDomain;
    use sim_messages::{ConstraintState, LoadHeader};

    #[test]
    fn no_message_of_an_owner_or_client_needs_another_page() {
        let domain = TestDomain::new();
        let constraints = vec![ConstraintState::default(); 3000];
        let load = |particle_count| Load {
            header: LoadHeader { particle_count, ..LoadHeader::default() },
            scene: b"version = 1",
            constraints: &constraints,
            bends: &[],
            triangles: &[],
            collider_count: 2,
            keyframe_size_bytes_max: 20_000,
            parameters: sim_messages::ParameterValues::DEFAULT,
        };
        let mut owner = Owner::create(&domain.endpoint(), &load(1000)).unwrap();
        owner.load(&load(2000)).unwrap();
        let mut client = Client::attach(&domain.endpoint()).unwrap();
        // Creates the writer of commands.
        client.send(sim_messages::Action::Pause).unwrap();
        let config = domain::configuration(Some(domain.name())).unwrap();
        let mut segment_count = 0;
        for path in segments(&config, &config.global.service.data_segment_suffix) {
            let file = std::fs::metadata(&path).unwrap();
            let allocated_bytes = file.blocks() * 512;
            assert!(allocated_bytes >= file.len(), "{}: {allocated_bytes} bytes", path.display());
            segment_count += 1;
        }
        // Nine of the load, outcomes, status, and the client's commands.
        assert_eq!(segment_count, 12);
    }
}
