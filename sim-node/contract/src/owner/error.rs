//! Errors of owners.

use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::ports::service::ServiceError;
use crate::ports::writer::PublishError;

/// Error of claiming a name or loading a scene.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OwnerError {
    /// Another process owns the name.
    #[error(
        "{endpoint} is already running{by}: stop that process, or choose another --name or --domain",
        by = process_id.map(|id| format!(", as process {id}")).unwrap_or_default()
    )]
    NameTaken {
        /// Address with this name.
        endpoint: Endpoint,
        /// Id of the process that owns the name, if it is known.
        process_id: Option<u32>,
    },
    /// The snapshots do not fit into shared memory.
    #[error(
        "{particle_count} particles need {needed_mib} MiB of shared memory ({samples} snapshots for one stalled reader), but /dev/shm has only {available_mib} MiB left: choose a smaller scene, or enlarge /dev/shm (mount -o remount,size=... /dev/shm; docker run --shm-size ...)"
    )]
    NotEnoughSharedMemory {
        /// Number of particles in the scene.
        particle_count: u32,
        /// Number of snapshots that one stalled reader keeps from being overwritten.
        samples: usize,
        /// Size of these snapshots in MiB, rounded up.
        needed_mib: u64,
        /// Available memory in MiB, rounded down.
        available_mib: u64,
    },
    /// The load exceeds a limit of the contract.
    #[error(
        "the scene has {count} {elements}, but at most {max} are possible: choose a smaller scene"
    )]
    TooLarge {
        /// Name of the elements, in the plural.
        elements: &'static str,
        /// Number of elements.
        count: usize,
        /// Most elements.
        max: usize,
    },
    /// A service could not be created or connected to.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// The load could not be published.
    #[error(transparent)]
    Publish(#[from] PublishError),
}
