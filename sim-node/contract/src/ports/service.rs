//! The services of a name, their quality of service, and why one could not be had.

use iceoryx2::prelude::MessagingPattern;
use iceoryx2::service::builder::event::{EventCreateError, EventOpenError, EventOpenOrCreateError};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::limits::{
    BORROWED_SAMPLES_MAX, CLIENTS_MAX, COMMAND_READERS_MAX, COMMANDS_BUFFERED, LISTENERS_MAX,
    OUTCOME_READERS_MAX, OUTCOMES_BUFFERED, OWNER_PUBLISHERS_MAX, READERS_MAX, SNAPSHOTS_BUFFERED,
    STATUS_PUBLISHERS_MAX, UPDATES_BUFFERED,
};

/// The service attribute that holds the version of the contract.
pub(crate) const VERSION_KEY: &str = "contract_version";

/// What happens to a message for a reader whose buffer is full. The writer never waits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WhenFull {
    /// The reader loses its oldest message.
    DropOldest,
    /// The writer is told that the message was not taken.
    RefuseNewest,
}

/// A service: its name behind the name of the simulation, and its quality of service.
#[derive(Debug)]
pub(crate) struct ServiceSpec {
    pub(crate) suffix: &'static str,
    pub(crate) pattern: MessagingPattern,
    /// Publishers or notifiers at the same time.
    pub(crate) publishers_max: usize,
    /// Subscribers or listeners at the same time.
    pub(crate) readers_max: usize,
    /// Messages that a late reader is given; at most 1.
    pub(crate) history: usize,
    /// Messages that wait for one reader.
    pub(crate) buffered: usize,
    pub(crate) when_full: WhenFull,
}

/// What the owner alone writes, latched: the base of the services below.
const LATCHED: ServiceSpec = ServiceSpec {
    suffix: "",
    pattern: MessagingPattern::PublishSubscribe,
    publishers_max: OWNER_PUBLISHERS_MAX,
    readers_max: READERS_MAX,
    history: 1,
    buffered: UPDATES_BUFFERED,
    when_full: WhenFull::DropOldest,
};
pub(crate) const PARTICLES: ServiceSpec =
    ServiceSpec { suffix: "particles", buffered: SNAPSHOTS_BUFFERED, ..LATCHED };
pub(crate) const KEYFRAME: ServiceSpec =
    ServiceSpec { suffix: "keyframe", buffered: SNAPSHOTS_BUFFERED, ..LATCHED };
pub(crate) const TOPOLOGY: ServiceSpec = ServiceSpec { suffix: "topology", ..LATCHED };
pub(crate) const SURFACE: ServiceSpec = ServiceSpec { suffix: "surface", ..LATCHED };
pub(crate) const SCENE: ServiceSpec = ServiceSpec { suffix: "scene", ..LATCHED };
pub(crate) const TEARS: ServiceSpec = ServiceSpec { suffix: "tears", ..LATCHED };
/// As many as snapshots: each step can change one.
pub(crate) const PARAMETERS: ServiceSpec =
    ServiceSpec { suffix: "parameters", buffered: SNAPSHOTS_BUFFERED, ..LATCHED };
/// As many as snapshots: while one moves, each step has its own.
pub(crate) const COLLIDERS: ServiceSpec =
    ServiceSpec { suffix: "colliders", buffered: SNAPSHOTS_BUFFERED, ..LATCHED };
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
pub(crate) const WAKE: ServiceSpec = ServiceSpec {
    suffix: "wake",
    pattern: MessagingPattern::Event,
    readers_max: LISTENERS_MAX,
    history: 0,
    buffered: 0,
    ..LATCHED
};

impl ServiceSpec {
    /// The service of the simulation `name`.
    pub(crate) fn service_name(&self, name: &str) -> String {
        format!("{name}/{}", self.suffix)
    }

    /// The most samples of one publisher that can be in use at the same time: those that wait,
    /// those that readers hold, the latched one and the one being written.
    ///
    /// Where full buffers drop their oldest, each holds the newest samples, so all readers' buffers
    /// share the same ones. iceoryx2 itself reserves a buffer of others for each reader.
    pub(crate) const fn samples_in_use_max(&self) -> usize {
        let buffers = match self.when_full {
            WhenFull::DropOldest => 1,
            WhenFull::RefuseNewest => self.readers_max,
        };
        buffers * self.buffered + self.readers_max * BORROWED_SAMPLES_MAX + self.history + 1
    }
}

/// Why a service could not be created, opened or connected to.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ServiceError {
    /// This process cannot be a member of the domain.
    #[error(
        "cannot join {endpoint}: {cause} (if another user of this host has the domain, choose your own with --domain NAME on every program)"
    )]
    Domain {
        /// Where to.
        endpoint: Endpoint,
        /// What iceoryx2 says.
        cause: String,
    },
    /// There is no such service.
    #[error("there is no service '{service}' of {endpoint}")]
    Missing {
        /// Its full name.
        service: String,
        /// Where it was looked for.
        endpoint: Endpoint,
    },
    /// The service is of another version of the contract.
    #[error(
        "service '{service}' has contract version {found}, this program has {expected}: stop every program of the other version, or start this one with another --domain"
    )]
    Version {
        /// Its full name.
        service: String,
        /// The version it was created with.
        found: String,
        /// The version of this program.
        expected: u32,
    },
    /// There is a service of that name that is not ours.
    #[error(
        "service '{service}' exists, but is not one of this contract ({detail}): choose another --name or --domain"
    )]
    Incompatible {
        /// Its full name.
        service: String,
        /// What iceoryx2 says.
        detail: String,
    },
    /// The service is of another version of iceoryx2.
    #[error(
        "service '{service}' was created with another version of iceoryx2: stop every program that uses it, or choose another --domain"
    )]
    OtherIceoryx {
        /// Its full name.
        service: String,
    },
    /// Another process has been creating or removing the service for too long.
    #[error(
        "service '{service}' is being created or removed by another process that does not finish ({detail}): try again, and end that process if it hangs"
    )]
    InTransition {
        /// Its full name.
        service: String,
        /// What iceoryx2 says.
        detail: String,
    },
    /// All places at the service are taken.
    #[error("service '{service}' has all of its {max} {what} already: end one of them")]
    Full {
        /// Its full name.
        service: String,
        /// Whom there are too many of.
        what: &'static str,
        /// How many there can be.
        max: usize,
    },
    /// The service belongs to another user.
    #[error(
        "no permission for service '{service}', probably another user's: choose a --domain of your own"
    )]
    NoPermission {
        /// Its full name.
        service: String,
    },
    /// Something that none of the above explains.
    #[error("service '{service}' failed: {detail}")]
    Failed {
        /// Its full name.
        service: String,
        /// What iceoryx2 says.
        detail: String,
    },
}

impl ServiceError {
    pub(crate) fn failed(service: &str, detail: &dyn std::fmt::Debug) -> Self {
        Self::Failed { service: service.to_owned(), detail: format!("{detail:?}") }
    }
}

/// iceoryx2's many errors, by what can be done about them.
#[derive(Debug)]
pub(crate) enum Cause {
    Missing,
    Full,
    InTransition(String),
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
            | Open::ServiceInCorruptedState
            | Open::IsMarkedForDestruction
            | Open::Interrupt => Self::InTransition(detail),
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
            | Open::ServiceInCorruptedState
            | Open::IsMarkedForDestruction
            | Open::Interrupt => Self::InTransition(detail),
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
    fn the_service_names_and_their_quality_are_frozen() {
        let all = [
            &PARTICLES,
            &KEYFRAME,
            &TOPOLOGY,
            &SURFACE,
            &SCENE,
            &TEARS,
            &PARAMETERS,
            &COLLIDERS,
            &COMMANDS,
            &OUTCOMES,
            &STATUS,
            &WAKE,
        ];
        let mut text = String::new();
        for spec in all {
            let ServiceSpec { pattern, publishers_max, readers_max, history, .. } = spec;
            let ServiceSpec { buffered, when_full, .. } = spec;
            writeln!(
                text,
                "{}: {pattern:?}, publishers {publishers_max}, readers {readers_max}, history \
                 {history}, buffered {buffered}, when full {when_full:?}",
                spec.service_name("sim")
            )
            .unwrap();
        }
        insta::assert_snapshot!("services", text);
    }
}
