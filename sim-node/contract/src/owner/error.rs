//! Errors of owners.

use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::ports::memory::MemoryError;
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
    /// The messages of the load do not fit into shared memory.
    #[error(
        "{particle_count} particles and {constraint_count} constraints: {memory}, or choose a smaller \
         scene"
    )]
    NotEnoughSharedMemory {
        /// Number of particles in the scene.
        particle_count: u32,
        /// Number of constraints in the scene.
        constraint_count: usize,
        /// Needed and available memory.
        memory: MemoryError,
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
