//! One process's membership in a domain, and how it creates and opens the services of a name.

use std::error::Error;
use std::fmt::Debug;
use std::sync::Once;
use std::time::Duration;

use iceoryx2::prelude::{
    AttributeVerifier, IceoryxSend, LogLevel, Node, NodeBuilder, Service, ServiceName,
    SignalHandlingMode, ZeroCopySend, ipc, set_log_level_from_env_or,
};
use iceoryx2::service::builder::publish_subscribe::Builder;
use iceoryx2::service::port_factory;

use crate::endpoint::Endpoint;
use crate::limits::{BORROWED_SAMPLES_MAX, CONTRACT_VERSION, PARTICIPANTS_MAX};
use crate::ports::domain;
use crate::ports::service::{Cause, ServiceError, ServiceSpec, VERSION_KEY, WAKE, WhenFull};
use crate::ports::wake::Wake;

/// A publish-subscribe service whose messages are slices of `T` with the header `H`.
pub(crate) type Slices<T, H> = port_factory::publish_subscribe::PortFactory<ipc::Service, [T], H>;
/// A publish-subscribe service whose messages are single values.
pub(crate) type Values<T> = port_factory::publish_subscribe::PortFactory<ipc::Service, T, ()>;
/// An event service.
pub(crate) type Events = port_factory::event::PortFactory<ipc::Service>;

/// Pause before another try, while another process creates or removes the same service.
const RETRY_PAUSE: Duration = Duration::from_millis(5);
/// Tries before giving up: 100 ms of pauses, beside the second that iceoryx2 itself takes.
const TRIES_MAX: usize = 20;
/// How long to wait for another process that is clearing up after a dead one.
pub(crate) const CLEANUP_TIMEOUT: Duration = Duration::from_millis(100);

/// An iceoryx2 node in the domain of an endpoint. It handles no signal: programs do.
#[derive(Debug)]
pub(crate) struct Session {
    pub(crate) endpoint: Endpoint,
    node: Node<ipc::Service>,
    /// The version that services are created with and asked for: [`CONTRACT_VERSION`], except in
    /// tests.
    contract_version: u32,
    /// The same as an attribute.
    version: AttributeVerifier,
}

/// How a process comes to a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    /// It must exist: the way of clients.
    Open,
    /// It is created unless clients have kept it: the way of the owner.
    Create,
}

impl Session {
    pub(crate) fn join(endpoint: &Endpoint) -> Result<Self, ServiceError> {
        Self::join_with_version(endpoint, CONTRACT_VERSION)
    }

    /// [`Session::join`] as a program of another version of the contract.
    pub(crate) fn join_with_version(
        endpoint: &Endpoint,
        contract_version: u32,
    ) -> Result<Self, ServiceError> {
        static LOG_LEVEL: Once = Once::new();
        // What goes wrong is an error of ours; iceoryx2's own warnings would come on top of it.
        LOG_LEVEL.call_once(|| set_log_level_from_env_or(LogLevel::Error));
        let refused = |cause: &dyn Debug| ServiceError::Domain {
            endpoint: endpoint.clone(),
            cause: format!("{cause:?}"),
        };
        let config = domain::configuration(endpoint.domain()).map_err(|error| refused(&error))?;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|error| refused(&error))?;
        let version = version_attribute(contract_version).map_err(|error| refused(&error))?;
        Ok(Self { endpoint: endpoint.clone(), node, contract_version, version })
    }

    /// A service whose messages are slices of `T` with the header `H`.
    pub(crate) fn slices<T, H>(
        &self,
        spec: &ServiceSpec,
        access: Access,
    ) -> Result<Slices<T, H>, ServiceError>
    where
        T: Debug + ZeroCopySend,
        H: Debug + ZeroCopySend,
    {
        self.retry(spec, |name| {
            let builder = self.node.service_builder(name).publish_subscribe::<[T]>();
            let builder = builder.user_header::<H>();
            match access {
                Access::Open => Ok(builder.open_with_attributes(&self.version)?),
                Access::Create => {
                    Ok(with_quality(builder, spec).open_or_create_with_attributes(&self.version)?)
                }
            }
        })
    }

    /// A service whose messages are single values.
    pub(crate) fn values<T>(
        &self,
        spec: &ServiceSpec,
        access: Access,
    ) -> Result<Values<T>, ServiceError>
    where
        T: Debug + ZeroCopySend,
    {
        self.retry(spec, |name| {
            let builder = self.node.service_builder(name).publish_subscribe::<T>();
            match access {
                Access::Open => Ok(builder.open_with_attributes(&self.version)?),
                Access::Create => {
                    Ok(with_quality(builder, spec).open_or_create_with_attributes(&self.version)?)
                }
            }
        })
    }

    /// The event service [`WAKE`].
    pub(crate) fn events(&self, access: Access) -> Result<Events, ServiceError> {
        self.retry(&WAKE, |name| {
            let builder = self.node.service_builder(name).event();
            match access {
                Access::Open => Ok(builder.open_with_attributes(&self.version)?),
                Access::Create => Ok(builder
                    .max_notifiers(WAKE.publishers_max)
                    .max_listeners(WAKE.readers_max)
                    .max_nodes(PARTICIPANTS_MAX)
                    .event_id_max_value(Wake::ID_MAX)
                    // Whoever clears up after a killed owner says what it could not say itself.
                    .notifier_dead_event(Wake::OwnerGone.event_id())
                    .open_or_create_with_attributes(&self.version)?),
            }
        })
    }

    /// Lets a moment pass for a process that is about to finish what it began.
    pub(crate) fn pause(&self) {
        // A signal ends the pause: then the next try is earlier.
        let _ = self.node.wait(RETRY_PAUSE);
    }

    pub(crate) fn service_name(&self, spec: &ServiceSpec) -> String {
        spec.service_name(self.endpoint.name())
    }

    /// Tries again where another process is in the middle of creating or removing the service, and
    /// once where dead processes hold all places.
    fn retry<S>(
        &self,
        spec: &ServiceSpec,
        attempt: impl Fn(&ServiceName) -> Result<S, Cause>,
    ) -> Result<S, ServiceError> {
        let service = self.service_name(spec);
        let name =
            ServiceName::new(&service).map_err(|error| ServiceError::failed(&service, &error))?;
        let mut has_cleaned_up = false;
        let mut tries = 1;
        loop {
            match attempt(&name) {
                Ok(service) => return Ok(service),
                Err(Cause::Full) if !has_cleaned_up => {
                    has_cleaned_up = true;
                    self.node.blocking_cleanup_dead_nodes(CLEANUP_TIMEOUT);
                }
                Err(Cause::InTransition(_)) if tries < TRIES_MAX => {
                    tries += 1;
                    self.pause();
                }
                Err(cause) => return Err(self.explain(spec, service, cause)),
            }
        }
    }

    fn explain(&self, spec: &ServiceSpec, service: String, cause: Cause) -> ServiceError {
        match cause {
            Cause::Missing => ServiceError::Missing { service, endpoint: self.endpoint.clone() },
            Cause::Full => ServiceError::Full { service, what: "processes", max: PARTICIPANTS_MAX },
            Cause::InTransition(detail) => ServiceError::InTransition { service, detail },
            Cause::NoPermission => ServiceError::NoPermission { service },
            Cause::OtherIceoryx => ServiceError::OtherIceoryx { service },
            Cause::Incompatible(detail) => match self.version_of(spec, &service) {
                Some(found) if found != self.contract_version.to_string() => {
                    ServiceError::Version { service, found, expected: self.contract_version }
                }
                _ => ServiceError::Incompatible { service, detail },
            },
            Cause::Other(detail) => ServiceError::Failed { service, detail },
        }
    }

    /// The contract version that an existing service was created with.
    fn version_of(&self, spec: &ServiceSpec, service: &str) -> Option<String> {
        let name = ServiceName::new(service).ok()?;
        let details = ipc::Service::details(&name, self.node.config(), spec.pattern).ok()??;
        let attributes = details.static_details.attributes();
        attributes.key_value(&VERSION_KEY.try_into().ok()?, 0).map(ToString::to_string)
    }
}

/// The attribute that every service of that version of the contract has.
fn version_attribute(contract_version: u32) -> Result<AttributeVerifier, Box<dyn Error>> {
    let key = VERSION_KEY.try_into()?;
    let value = contract_version.to_string().as_str().try_into()?;
    Ok(AttributeVerifier::new().require(&key, &value)?)
}

fn with_quality<P, H>(
    builder: Builder<P, H, ipc::Service>,
    spec: &ServiceSpec,
) -> Builder<P, H, ipc::Service>
where
    P: Debug + IceoryxSend + ?Sized,
    H: Debug + ZeroCopySend,
{
    builder
        .max_publishers(spec.publishers_max)
        .max_subscribers(spec.readers_max)
        .max_nodes(PARTICIPANTS_MAX)
        .history_size(spec.history)
        .subscriber_max_buffer_size(spec.buffered)
        .subscriber_max_borrowed_samples(BORROWED_SAMPLES_MAX)
        .enable_safe_overflow(spec.when_full == WhenFull::DropOldest)
}
