//! Errors of owners.

use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::ports::service::ServiceError;
use crate::ports::writer::PublishError;

/// Why a name could not be taken, or a scene not be loaded.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OwnerError {
    /// Another process has the name.
    #[error(
        "{endpoint} is already running{by}: stop that one, or choose another --name or --domain",
        by = process_id.map(|id| format!(", as process {id}")).unwrap_or_default()
    )]
    NameTaken {
        /// Whose.
        endpoint: Endpoint,
        /// The process that has it, where it is known.
        process_id: Option<u32>,
    },
    /// The snapshots would not fit into shared memory.
    #[error(
        "{particle_count} particles need {needed_mib} MiB of shared memory ({samples} snapshots for one stalled reader), but /dev/shm has {available_mib} MiB left: take a smaller scene, or enlarge it (mount -o remount,size=... /dev/shm; docker run --shm-size ...)"
    )]
    NotEnoughSharedMemory {
        /// Particles of the scene.
        particle_count: u32,
        /// Snapshots that one reader can keep from being overwritten.
        samples: usize,
        /// What they take, rounded up.
        needed_mib: u64,
        /// What is available, rounded down.
        available_mib: u64,
    },
    /// The load is beyond a limit of the contract.
    #[error("the scene has {count} {what}, at most {max} are possible: take a smaller scene")]
    TooLarge {
        /// What there is too much of.
        what: &'static str,
        /// How much.
        count: usize,
        /// The limit.
        max: usize,
    },
    /// A service could not be created or connected to.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// The load could not be published.
    #[error(transparent)]
    Publish(#[from] PublishError),
}
