//! Membership of a process in a domain: it creates and opens the services of a name.

use std::error::Error;
use std::fmt::Debug;
use std::fs::File;
use std::time::Duration;

use bytemuck::Pod;
use iceoryx2::prelude::{
    AttributeSet, AttributeVerifier, Config, Node, NodeBuilder, NodeName, PortFactory,
    SemanticStringError, Service as _, ServiceName, SignalHandlingMode, ZeroCopySend,
    ipc_threadsafe,
};
use iceoryx2::service::port_factory;
use sim_messages::{CONTRACT_VERSION, PARTICIPANTS_MAX};

use crate::endpoint::Endpoint;
use crate::ports::domain::{self, files, root};
use crate::ports::leftovers;
use crate::ports::leftovers::lock::{LockPlace, OwnerLock};
use crate::ports::leftovers::orphans::{self, Port};
use crate::ports::leftovers::unfinished;
use crate::ports::memory;
use crate::ports::port::{Header, Service};
use crate::ports::raw::{self, MessageType};
use crate::ports::service::{Cause, ServiceError, ServiceSpec, VERSION_KEY, WAKE, WhenFull};
use crate::ports::wake::Wake;

/// An event service.
pub(crate) type Events = port_factory::event::PortFactory<ipc_threadsafe::Service>;

/// Pause before another attempt, while another process creates or removes the same service.
const RETRY_PAUSE: Duration = Duration::from_millis(5);
/// Longest file name of a program in the name of its iceoryx2 node.
const PROGRAM_CHARACTERS_MAX: usize = 60;
/// Most attempts. In each of them, iceoryx2 waits for [`domain::CREATION_TIMEOUT`].
const ATTEMPTS_MAX: usize = 20;

/// An iceoryx2 node in the domain of an endpoint. It handles no signals; programs do.
#[derive(Debug)]
pub(crate) struct Session {
    pub(crate) endpoint: Endpoint,
    node: Node<ipc_threadsafe::Service>,
    /// Version of the services that are created and opened: [`CONTRACT_VERSION`], except in tests.
    contract_version: u32,
    /// The version as an attribute of services.
    version: AttributeVerifier,
    /// The root of the domain, locked against cleaners.
    _root: File,
}

/// Mode of access to a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Access {
    /// For clients: the service must exist.
    Open,
    /// For the owner, which holds the lock of the name: the service is created, unless clients have
    /// kept it.
    Create,
}

impl Drop for Session {
    /// The last process of a domain leaves nothing of killed ones.
    fn drop(&mut self) {
        leftovers::clean_domain(&self.node);
    }
}

impl Session {
    pub(crate) fn join(endpoint: &Endpoint) -> Result<Self, ServiceError> {
        Self::join_with_version(endpoint, CONTRACT_VERSION)
    }

    /// Returns the configuration of the domain of an endpoint.
    pub(crate) fn configuration(endpoint: &Endpoint) -> Result<Config, ServiceError> {
        domain::configuration(endpoint.domain()).map_err(|error| ServiceError::Domain {
            endpoint: endpoint.clone(),
            cause: format!("{error:?}"),
        })
    }

    /// Returns `false` if no process has joined the domain yet. Checks its root as a process does that joins, and
    /// creates nothing.
    pub(crate) fn has_root(endpoint: &Endpoint, config: &Config) -> Result<bool, ServiceError> {
        root::exists(&root::path(config))
            .map_err(|cause| ServiceError::Root { endpoint: endpoint.clone(), cause })
    }

    /// Joins as a program of any version of the contract.
    pub(crate) fn join_with_version(
        endpoint: &Endpoint,
        contract_version: u32,
    ) -> Result<Self, ServiceError> {
        let refused = |cause: &dyn Debug| ServiceError::Domain {
            endpoint: endpoint.clone(),
            cause: format!("{cause:?}"),
        };
        let config = Self::configuration(endpoint)?;
        let private = |cause| ServiceError::Root { endpoint: endpoint.clone(), cause };
        let root = root::prepare(&root::path(&config)).map_err(private)?;
        unfinished::remove_segments(&config);
        memory::check_ports()
            .map_err(|memory| ServiceError::NoMemory { endpoint: endpoint.clone(), memory })?;
        let is_named = endpoint.domain().is_some();
        if is_named {
            files::check_counter(&config).map_err(private)?;
        }
        let node = NodeBuilder::new()
            .name(&node_name(endpoint).map_err(|error| refused(&error))?)
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc_threadsafe::Service>()
            .map_err(|error| refused(&error))?;
        leftovers::clean_domain(&node);
        if is_named {
            files::narrow_counter(&config);
        }
        let version = version_attribute(contract_version).map_err(|error| refused(&error))?;
        Ok(Self { endpoint: endpoint.clone(), node, contract_version, version, _root: root })
    }

    /// Joins as a tunnel does: its services have no version.
    #[cfg(test)]
    pub(crate) fn join_without_version(endpoint: &Endpoint) -> Result<Self, ServiceError> {
        let mut session = Self::join(endpoint)?;
        session.version = AttributeVerifier::new();
        Ok(session)
    }

    /// Frees the places of those of these ports whose dead processes iceoryx2 has forgotten. For the holder
    /// of the lock of the name.
    pub(crate) fn restore_orphans(&self, ports: &[Port]) {
        if orphans::restore_nodes(self.node.config(), self.node_id(), ports) {
            leftovers::free_places(&self.node);
        }
    }

    /// Returns the id of this process's iceoryx2 node.
    pub(crate) fn node_id(&self) -> u128 {
        self.node.id().value()
    }

    /// Returns `true` if no process holds the lock of the name. What is left of its services is then
    /// for the next owner to remove.
    fn is_abandoned(&self) -> bool {
        self.lock_holder().is_none()
    }

    /// Returns the process that holds the lock of the name: its id, if its file tells.
    #[allow(clippy::option_option, reason = "the id of a holder may be unknown")]
    pub(crate) fn lock_holder(&self) -> Option<Option<u32>> {
        self.lock_place().holder()
    }

    /// Returns where the lock of the name is.
    pub(crate) fn lock_place(&self) -> LockPlace {
        LockPlace::new(self.node.config(), self.endpoint.name())
    }

    /// Returns `true` if a killed owner has left the lock of the name.
    pub(crate) fn is_lock_left(&self) -> bool {
        !OwnerLock::left_files(self.node.config(), self.endpoint.name()).is_empty()
    }

    /// Opens or creates a publish-subscribe service.
    pub(crate) fn service<T: Pod + ZeroCopySend, H: Header>(
        &self,
        spec: &ServiceSpec,
        access: Access,
    ) -> Result<Service<T, H>, ServiceError> {
        self.raw_service(spec, access, &Service::<T, H>::message_type()).map(Service::of)
    }

    fn raw_service(
        &self,
        spec: &ServiceSpec,
        access: Access,
        message: &MessageType,
    ) -> Result<raw::Service, ServiceError> {
        self.retry(spec, access, |name| {
            let builder = raw::builder(&self.node, name, message);
            match access {
                Access::Open => self.of_this_version(builder.open()?),
                Access::Create => {
                    Ok(with_quality(builder, spec).open_or_create_with_attributes(&self.version)?)
                }
            }
        })
    }

    /// Opens or creates the event service [`WAKE`].
    pub(crate) fn events(&self, access: Access) -> Result<Events, ServiceError> {
        self.retry(&WAKE, access, |name| {
            let builder = self.node.service_builder(name).event();
            match access {
                Access::Open => self.of_this_version(builder.open()?),
                Access::Create => Ok(builder
                    .max_notifiers(WAKE.publishers_max)
                    .max_listeners(WAKE.readers_max)
                    .max_nodes(PARTICIPANTS_MAX)
                    .event_id_max_value(Wake::ID_MAX)
                    // The process that cleans up after a killed owner sends its last event.
                    .notifier_dead_event(Wake::OwnerGone.event_id())
                    .open_or_create_with_attributes(&self.version)?),
            }
        })
    }

    /// Refuses a service of another version. One without a version is the mirror of a tunnel; the version
    /// is in its messages.
    fn of_this_version<S: PortFactory>(&self, service: S) -> Result<S, Cause> {
        match version_of(service.attributes()) {
            Some(version) if version != self.contract_version.to_string() => {
                Err(Cause::Incompatible(format!("contract version {version}")))
            }
            _ => Ok(service),
        }
    }

    /// Returns the version of the contract of this program.
    pub(crate) fn contract_version(&self) -> u32 {
        self.contract_version
    }

    pub(crate) fn config(&self) -> &Config {
        self.node.config()
    }

    /// Waits a moment for a process that is creating or removing a service.
    pub(crate) fn pause(&self) {
        // A signal may end the pause early, so the next attempt is earlier.
        let _ = self.node.wait(RETRY_PAUSE);
    }

    pub(crate) fn service_name(&self, spec: &ServiceSpec) -> String {
        spec.service_name(self.endpoint.name())
    }

    /// Repeats an attempt while another process creates or removes the service, and once if dead
    /// processes occupy all places.
    fn retry<S>(
        &self,
        spec: &ServiceSpec,
        access: Access,
        attempt: impl Fn(&ServiceName) -> Result<S, Cause>,
    ) -> Result<S, ServiceError> {
        let service = self.service_name(spec);
        let name =
            ServiceName::new(&service).map_err(|error| ServiceError::failed(&service, &error))?;
        let mut has_cleaned_up = false;
        let mut attempt_count = 1;
        loop {
            match attempt(&name) {
                Ok(service) => return Ok(service),
                Err(Cause::Full) if !has_cleaned_up => {
                    has_cleaned_up = true;
                    leftovers::free_places(&self.node);
                }
                Err(Cause::Stuck(_)) if access == Access::Open && self.is_abandoned() => {
                    return Err(self.service_error(spec, service, Cause::Missing));
                }
                Err(cause @ (Cause::InTransition(_) | Cause::Stuck(_)))
                    if attempt_count < ATTEMPTS_MAX =>
                {
                    attempt_count += 1;
                    if access == Access::Create && matches!(cause, Cause::Stuck(_)) {
                        // Only the owner creates services. A process that removes one has no use for
                        // it any more, and had all the time of an attempt.
                        unfinished::remove_service(self.node.config(), spec, self.endpoint.name());
                    }
                    self.pause();
                }
                Err(cause) => return Err(self.service_error(spec, service, cause)),
            }
        }
    }

    fn service_error(&self, spec: &ServiceSpec, service: String, cause: Cause) -> ServiceError {
        match cause {
            Cause::Missing => ServiceError::Missing { service, endpoint: self.endpoint.clone() },
            Cause::Full => {
                ServiceError::Full { service, ports: "processes", max: PARTICIPANTS_MAX }
            }
            Cause::InTransition(detail) | Cause::Stuck(detail) => {
                ServiceError::InTransition { service, detail }
            }
            Cause::NoPermission => ServiceError::NoPermission { service },
            Cause::OtherIceoryx => ServiceError::OtherIceoryx { service },
            Cause::Incompatible(detail) => match self.existing_version(spec, &service) {
                Some(actual) if actual != self.contract_version.to_string() => {
                    ServiceError::Version { service, actual, expected: self.contract_version }
                }
                _ => ServiceError::Incompatible { service, detail },
            },
            Cause::Other(detail) => ServiceError::Failed { service, detail },
        }
    }

    /// Returns the contract version that an existing service was created with.
    fn existing_version(&self, spec: &ServiceSpec, service: &str) -> Option<String> {
        let name = ServiceName::new(service).ok()?;
        let details =
            ipc_threadsafe::Service::details(&name, self.node.config(), spec.pattern).ok()??;
        version_of(details.static_details.attributes())
    }
}

/// Returns the name that `iox2 node list` shows: the file name of the program, and the name of the
/// simulation.
fn node_name(endpoint: &Endpoint) -> Result<NodeName, SemanticStringError> {
    let path = std::env::current_exe().unwrap_or_default();
    let program = path.file_name().unwrap_or_default().to_string_lossy();
    // iceoryx2 allows 128 characters of ASCII, of which the simulation's name has 64 at most.
    let program = program.chars().take(PROGRAM_CHARACTERS_MAX);
    let program: String =
        program.map(|one| if one.is_ascii_graphic() { one } else { '?' }).collect();
    NodeName::new(&format!("{program}:{}", endpoint.name()))
}

/// Returns the contract version in the attributes of a service; `None` for the mirror of a tunnel.
pub(crate) fn version_of(attributes: &AttributeSet) -> Option<String> {
    let key = VERSION_KEY.try_into().ok()?;
    attributes.key_value(&key, 0).map(ToString::to_string)
}

/// Returns the attribute of every service of a contract version.
fn version_attribute(contract_version: u32) -> Result<AttributeVerifier, Box<dyn Error>> {
    let key = VERSION_KEY.try_into()?;
    let value = contract_version.to_string().as_str().try_into()?;
    Ok(AttributeVerifier::new().require(&key, &value)?)
}

fn with_quality(builder: raw::Builder, spec: &ServiceSpec) -> raw::Builder {
    builder
        .max_publishers(spec.publishers_max)
        .max_subscribers(spec.readers_max)
        .max_nodes(PARTICIPANTS_MAX)
        .history_size(spec.history)
        .subscriber_max_buffer_size(spec.buffered)
        .subscriber_max_borrowed_samples(spec.borrowed)
        .enable_safe_overflow(spec.when_full == WhenFull::DropOldest)
}
