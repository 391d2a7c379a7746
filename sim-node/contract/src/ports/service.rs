//! The services of a name, their quality of service, and their errors.

use iceoryx2::prelude::MessagingPattern;
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError, EventOpenOrCreateError};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use sim_messages::{
    BORROWED_SAMPLES_MAX, BORROWED_UPDATES_MAX, CLIENTS_MAX, COMMAND_READERS_MAX,
    COMMANDS_BUFFERED, KEYFRAMES_BUFFERED, LISTENERS_MAX, MEMBERS_MAX, OUTCOME_READERS_MAX,
    OUTCOMES_BUFFERED, OWNER_PUBLISHERS_MAX, READERS_MAX, READY_BUFFERED, RESTORES_MAX,
    SNAPSHOTS_BUFFERED, STATUS_PUBLISHERS_MAX, UPDATES_BUFFERED,
};
use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::ports::domain::root::RootError;
use crate::ports::memory::MemoryError;

/// The service attribute that holds the version of the contract.
pub(crate) const VERSION_KEY: &str = "contract_version";

/// Name of the owner's publisher of `status`, by which other processes know it.
pub(crate) const OWNER_PORT: &str = "owner";

/// Treatment of a message for a reader with a full buffer. The writer never waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WhenFull {
    /// The reader loses its oldest message.
    DropOldest,
    /// The reader does not receive the message, and the writer learns of it.
    RefuseNewest,
}

/// A service: the part of its name after the name of the simulation, and its quality of service.
#[derive(Debug)]
pub(crate) struct ServiceSpec {
    pub(crate) suffix: &'static str,
    pub(crate) pattern: MessagingPattern,
    /// Most publishers or notifiers at the same time.
    pub(crate) publishers_max: usize,
    /// Most subscribers or listeners at the same time.
    pub(crate) readers_max: usize,
    /// Number of messages that a late reader receives: 0 or 1.
    pub(crate) history: usize,
    /// Most messages that wait for one reader.
    pub(crate) buffered: usize,
    /// Most messages that one reader may hold.
    pub(crate) borrowed: usize,
    pub(crate) when_full: WhenFull,
}

/// A latched service that only the owner writes: the base of the services below.
const LATCHED: ServiceSpec = ServiceSpec {
    suffix: "",
    pattern: MessagingPattern::PublishSubscribe,
    publishers_max: OWNER_PUBLISHERS_MAX,
    readers_max: READERS_MAX,
    history: 1,
    buffered: UPDATES_BUFFERED,
    borrowed: BORROWED_UPDATES_MAX,
    when_full: WhenFull::DropOldest,
};
pub(crate) const PARTICLES: ServiceSpec = ServiceSpec {
    suffix: "particles",
    buffered: SNAPSHOTS_BUFFERED,
    borrowed: BORROWED_SAMPLES_MAX,
    ..LATCHED
};
pub(crate) const KEYFRAME: ServiceSpec =
    ServiceSpec { suffix: "keyframe", buffered: KEYFRAMES_BUFFERED, ..LATCHED };
pub(crate) const TOPOLOGY: ServiceSpec = ServiceSpec { suffix: "topology", ..LATCHED };
pub(crate) const BENDS: ServiceSpec = ServiceSpec { suffix: "bends", ..LATCHED };
pub(crate) const SURFACE: ServiceSpec = ServiceSpec { suffix: "surface", ..LATCHED };
pub(crate) const SCENE: ServiceSpec = ServiceSpec { suffix: "scene", ..LATCHED };
pub(crate) const TEARS: ServiceSpec = ServiceSpec { suffix: "tears", ..LATCHED };
/// Buffers as many messages as snapshots, because each step can change a parameter.
pub(crate) const PARAMETERS: ServiceSpec =
    ServiceSpec { suffix: "parameters", buffered: SNAPSHOTS_BUFFERED, ..LATCHED };
/// Buffers as many messages as snapshots, because a moving collider has a message in each step.
pub(crate) const COLLIDERS: ServiceSpec =
    ServiceSpec { suffix: "colliders", buffered: SNAPSHOTS_BUFFERED, ..LATCHED };
/// Buffers as many messages as snapshots, because each step has one.
pub(crate) const FORCES: ServiceSpec =
    ServiceSpec { suffix: "forces", buffered: SNAPSHOTS_BUFFERED, ..LATCHED };
pub(crate) const STATUS: ServiceSpec =
    ServiceSpec { suffix: "status", publishers_max: STATUS_PUBLISHERS_MAX, ..LATCHED };
pub(crate) const OUTCOMES: ServiceSpec = ServiceSpec {
    suffix: "outcomes",
    readers_max: OUTCOME_READERS_MAX,
    history: 0,
    buffered: OUTCOMES_BUFFERED,
    ..LATCHED
};
pub(crate) const COMMANDS: ServiceSpec = ServiceSpec {
    suffix: "commands",
    publishers_max: CLIENTS_MAX,
    readers_max: COMMAND_READERS_MAX,
    history: 0,
    buffered: COMMANDS_BUFFERED,
    when_full: WhenFull::RefuseNewest,
    ..LATCHED
};
/// A new message of a member says all that its unread ones say.
pub(crate) const READY: ServiceSpec = ServiceSpec {
    suffix: "ready",
    publishers_max: MEMBERS_MAX,
    readers_max: COMMAND_READERS_MAX,
    history: 0,
    buffered: READY_BUFFERED,
    ..LATCHED
};
/// A client creates its writer for one message, and drops it after the outcome.
pub(crate) const RESTORE: ServiceSpec = ServiceSpec {
    suffix: "restore",
    publishers_max: RESTORES_MAX,
    readers_max: COMMAND_READERS_MAX,
    history: 0,
    buffered: 1,
    when_full: WhenFull::RefuseNewest,
    ..LATCHED
};
pub(crate) const WAKE: ServiceSpec = ServiceSpec {
    suffix: "wake",
    pattern: MessagingPattern::Event,
    readers_max: LISTENERS_MAX,
    history: 0,
    buffered: 0,
    ..LATCHED
};

/// All services of a name.
pub(crate) const SERVICES: [&ServiceSpec; 16] = [
    &PARTICLES,
    &KEYFRAME,
    &TOPOLOGY,
    &BENDS,
    &SURFACE,
    &SCENE,
    &TEARS,
    &PARAMETERS,
    &COLLIDERS,
    &FORCES,
    &COMMANDS,
    &OUTCOMES,
    &READY,
    &RESTORE,
    &STATUS,
    &WAKE,
];

impl ServiceSpec {
    /// Returns the full name of the service for the simulation `name`.
    pub(crate) fn service_name(&self, name: &str) -> String {
        format!("{name}/{}", self.suffix)
    }

    /// Returns the most samples of one publisher that can be in use at the same time: waiting
    /// samples, samples held by readers, the latched sample and the sample being written.
    ///
    /// Full buffers that drop their oldest sample all hold the newest samples, so the readers share
    /// one buffer of samples. By default, iceoryx2 would reserve a buffer for each reader.
    pub(crate) const fn samples_in_use_max(&self) -> usize {
        let buffers = match self.when_full {
            WhenFull::DropOldest => 1,
            WhenFull::RefuseNewest => self.readers_max,
        };
        buffers * self.buffered + self.readers_max * self.borrowed + self.history + 1
    }
}

/// Error of creating, opening or connecting to a service.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ServiceError {
    /// This process cannot join the domain.
    #[error(
        "cannot join {endpoint}: {cause} (if the domain belongs to another user of this host, choose your own with --domain NAME in every program)"
    )]
    Domain {
        /// The simulation to join.
        endpoint: Endpoint,
        /// Error of iceoryx2.
        cause: String,
    },
    /// The root directory of the domain is not this user's own.
    #[error("cannot join {endpoint}: {cause}")]
    Root {
        /// The simulation to join.
        endpoint: Endpoint,
        /// The problem and its cure.
        cause: RootError,
    },
    /// Not enough shared memory for the ports of this process.
    #[error("cannot join {endpoint}: {memory}")]
    NoMemory {
        /// The simulation to join.
        endpoint: Endpoint,
        /// Needed and available memory.
        memory: MemoryError,
    },
    /// The service does not exist.
    #[error("service '{service}' of {endpoint} does not exist")]
    Missing {
        /// Full name of the service.
        service: String,
        /// The simulation.
        endpoint: Endpoint,
    },
    /// Not enough shared memory for the service: its messages, or the ports of this process.
    #[error("service '{service}': {memory}")]
    Memory {
        /// Full name of the service.
        service: String,
        /// Needed and available memory.
        memory: MemoryError,
    },
    /// The service has another version of the contract.
    #[error(
        "service '{service}' has contract version {actual}, but this program has {expected}: stop every program of the other version, or start this one with another --domain"
    )]
    Version {
        /// Full name of the service.
        service: String,
        /// Version that the service was created with.
        actual: String,
        /// Version of this program.
        expected: u32,
    },
    /// The mirror of a network tunnel holds too few messages.
    #[error(
        "service '{service}' is the mirror of a tunnel that was started with {actual} {quality}, but at least {min} are needed: start the tunnel in a folder whose config/iceoryx2.toml `sim-node doctor --iox2-config` has printed"
    )]
    PoorMirror {
        /// Full name of the service.
        service: String,
        /// The quality of service, in the plural.
        quality: &'static str,
        /// Its value.
        actual: usize,
        /// Its least value.
        min: usize,
    },
    /// A foreign service has the name.
    #[error(
        "service '{service}' exists, but does not belong to this contract ({detail}): choose another --name or --domain"
    )]
    Incompatible {
        /// Full name of the service.
        service: String,
        /// Error of iceoryx2.
        detail: String,
    },
    /// The service was created with another version of iceoryx2.
    #[error(
        "service '{service}' was created with another version of iceoryx2: stop every program that uses it, or choose another --domain"
    )]
    OtherIceoryx {
        /// Full name of the service.
        service: String,
    },
    /// Another process has been creating or removing the service for too long.
    #[error(
        "another process is creating or removing service '{service}' and has not finished ({detail}): try again, and end that process if it hangs"
    )]
    InTransition {
        /// Full name of the service.
        service: String,
        /// Error of iceoryx2.
        detail: String,
    },
    /// The service has the most ports of a kind.
    #[error("service '{service}' already has all of its {max} {ports}: end one of them")]
    Full {
        /// Full name of the service.
        service: String,
        /// Kind of the ports, in the plural.
        ports: &'static str,
        /// Most ports of this kind.
        max: usize,
    },
    /// The service belongs to another user.
    #[error(
        "no permission for service '{service}', which probably belongs to another user: choose your own --domain"
    )]
    NoPermission {
        /// Full name of the service.
        service: String,
    },
    /// Any other error of iceoryx2.
    #[error("service '{service}' failed: {detail}")]
    Failed {
        /// Full name of the service.
        service: String,
        /// Error of iceoryx2.
        detail: String,
    },
}

impl ServiceError {
    pub(crate) fn failed(service: &str, detail: &dyn std::fmt::Debug) -> Self {
        Self::Failed { service: service.to_owned(), detail: format!("{detail:?}") }
    }
}

/// Errors of iceoryx2, grouped by their remedy.
#[derive(Debug)]
pub(crate) enum Cause {
    Missing,
    Full,
    /// Another process is creating or removing the service.
    InTransition(String),
    /// The same for too long, or the files of the service are damaged.
    Stuck(String),
    NoPermission,
    OtherIceoryx,
    Incompatible(String),
    Other(String),
}

impl From<PublishSubscribeOpenError> for Cause {
    fn from(error: PublishSubscribeOpenError) -> Self {
        use PublishSubscribeOpenError as Open;
        let detail = format!("{error:?}");
        match error {
            Open::DoesNotExist => Self::Missing,
            Open::ExceedsMaxNumberOfNodes => Self::Full,
            Open::HangsInCreation
            | Open::IsMarkedForDestruction
            | Open::ServiceInCorruptedState => Self::Stuck(detail),
            Open::Interrupt => Self::InTransition(detail),
            Open::InsufficientPermissions => Self::NoPermission,
            Open::VersionMismatch => Self::OtherIceoryx,
            Open::InternalFailure
            | Open::UnableToCreateServiceTag
            | Open::UnableToAcquireTypeDefinition
            | Open::InvalidTypeDefinition => Self::Other(detail),
            _ => Self::Incompatible(detail),
        }
    }
}

impl From<PublishSubscribeCreateError> for Cause {
    fn from(error: PublishSubscribeCreateError) -> Self {
        use PublishSubscribeCreateError as Create;
        let detail = format!("{error:?}");
        match error {
            Create::AlreadyExists
            | Create::HangsInCreation
            | Create::IsBeingCreatedByAnotherInstance
            | Create::ServiceInCorruptedState
            | Create::Interrupt => Self::InTransition(detail),
            Create::InsufficientPermissions => Self::NoPermission,
            _ => Self::Other(detail),
        }
    }
}

impl From<PublishSubscribeOpenOrCreateError> for Cause {
    fn from(error: PublishSubscribeOpenOrCreateError) -> Self {
        use PublishSubscribeOpenOrCreateError as Either;
        match error {
            Either::PublishSubscribeOpenError(error) => error.into(),
            Either::PublishSubscribeCreateError(error) => error.into(),
            Either::SystemInFlux => Self::InTransition(format!("{error:?}")),
        }
    }
}

impl From<EventOpenError> for Cause {
    fn from(error: EventOpenError) -> Self {
        use EventOpenError as Open;
        let detail = format!("{error:?}");
        match error {
            Open::DoesNotExist => Self::Missing,
            Open::ExceedsMaxNumberOfNodes => Self::Full,
            Open::HangsInCreation
            | Open::IsMarkedForDestruction
            | Open::ServiceInCorruptedState => Self::Stuck(detail),
            Open::Interrupt => Self::InTransition(detail),
            Open::InsufficientPermissions => Self::NoPermission,
            Open::VersionMismatch => Self::OtherIceoryx,
            Open::InternalFailure | Open::UnableToCreateServiceTag => Self::Other(detail),
            _ => Self::Incompatible(detail),
        }
    }
}

impl From<EventCreateError> for Cause {
    fn from(error: EventCreateError) -> Self {
        use EventCreateError as Create;
        let detail = format!("{error:?}");
        match error {
            Create::AlreadyExists
            | Create::IsBeingCreatedByAnotherInstance
            | Create::ServiceInCorruptedState
            | Create::Interrupt => Self::InTransition(detail),
            Create::InsufficientPermissions => Self::NoPermission,
            _ => Self::Other(detail),
        }
    }
}

impl From<EventOpenOrCreateError> for Cause {
    fn from(error: EventOpenOrCreateError) -> Self {
        use EventOpenOrCreateError as Either;
        match error {
            Either::EventOpenError(error) => error.into(),
            Either::EventCreateError(error) => error.into(),
            Either::SystemInFlux => Self::InTransition(format!("{error:?}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    #[test]
    fn the_service_names_and_qualities_of_service_are_frozen() {
        let mut text = String::new();
        for spec in SERVICES {
            let ServiceSpec { pattern, publishers_max, readers_max, history, .. } = spec;
            let ServiceSpec { buffered, borrowed, when_full, .. } = spec;
            writeln!(
                text,
                "{}: {pattern:?}, publishers {publishers_max}, readers {readers_max}, history \
                 {history}, buffered {buffered}, borrowed {borrowed}, when full {when_full:?}",
                spec.service_name("sim")
            )
            .unwrap();
        }
        insta::assert_snapshot!("services", text);
    }
}
