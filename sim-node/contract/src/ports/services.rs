//! All services of a name, and the process that owns the name.

use std::sync::Arc;

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::node::NodeView;
use iceoryx2::prelude::{CallbackProgression, Config, NodeState, PortFactory};
use sim_messages::{
    BendState, CLIENT_ID_END, ColliderState, CollidersHeader, Command, ConstraintState, ForceRow,
    ForcesHeader, KeyframeHeader, LoadHeader, NodeStatus, Outcome, ParameterState,
    ParametersHeader, ParticleState, Ready, RestoreHeader, SnapshotHeader, TearsHeader,
    TornConstraint, Triangle,
};
use thiserror::Error;

use crate::endpoint::Endpoint;
use crate::ports::leftovers::lock::OwnerLock;
use crate::ports::leftovers::orphans::{self, Port};
use crate::ports::mirror::Mirror;
use crate::ports::port::{Service, reader_count};
use crate::ports::raw;
use crate::ports::service::{
    BENDS, COLLIDERS, COMMANDS, FORCES, KEYFRAME, OUTCOMES, PARAMETERS, PARTICLES, READY, RESTORE,
    SCENE, STATUS, SURFACE, ServiceError, TEARS, TOPOLOGY,
};
use crate::ports::session::{Access, Events, Session};
use crate::ports::source::{Source, is_mirror, owner_nodes};

/// The services of a name, except `status`.
#[derive(Debug)]
pub(crate) struct Services {
    /// Configuration of the domain.
    pub(crate) config: Config,
    pub(crate) particles: Service<ParticleState, SnapshotHeader>,
    pub(crate) keyframe: Service<u8, KeyframeHeader>,
    pub(crate) topology: Service<ConstraintState, LoadHeader>,
    pub(crate) bends: Service<BendState, LoadHeader>,
    pub(crate) surface: Service<Triangle, LoadHeader>,
    pub(crate) scene: Service<u8, LoadHeader>,
    pub(crate) tears: Service<TornConstraint, TearsHeader>,
    pub(crate) parameters: Service<ParameterState, ParametersHeader>,
    pub(crate) colliders: Service<ColliderState, CollidersHeader>,
    pub(crate) forces: Service<ForceRow, ForcesHeader>,
    pub(crate) commands: Service<Command>,
    pub(crate) outcomes: Service<Outcome>,
    pub(crate) ready: Service<Ready>,
    pub(crate) restore: Service<u8, RestoreHeader>,
    pub(crate) wake: Events,
}

impl Services {
    /// Opens or creates the services. `status` is separate: the owner takes it before the others, so
    /// that readers can tell whether the name has an owner.
    pub(crate) fn access(session: &Session, access: Access) -> Result<Self, ServiceError> {
        Ok(Self {
            config: session.config().clone(),
            particles: session.service(&PARTICLES, access)?,
            keyframe: session.service(&KEYFRAME, access)?,
            topology: session.service(&TOPOLOGY, access)?,
            bends: session.service(&BENDS, access)?,
            surface: session.service(&SURFACE, access)?,
            scene: session.service(&SCENE, access)?,
            tears: session.service(&TEARS, access)?,
            parameters: session.service(&PARAMETERS, access)?,
            colliders: session.service(&COLLIDERS, access)?,
            forces: session.service(&FORCES, access)?,
            commands: session.service(&COMMANDS, access)?,
            outcomes: session.service(&OUTCOMES, access)?,
            ready: session.service(&READY, access)?,
            restore: session.service(&RESTORE, access)?,
            wake: session.events(access)?,
        })
    }

    /// Returns the publish-subscribe services. The owner writes all but the last three.
    fn publish_subscribe(&self) -> [&raw::Service; 14] {
        [
            &self.particles,
            &self.keyframe,
            &self.topology,
            &self.bends,
            &self.surface,
            &self.scene,
            &self.tears,
            &self.parameters,
            &self.colliders,
            &self.forces,
            &self.outcomes,
            &self.commands,
            &self.ready,
            &self.restore,
        ]
    }

    /// Returns the ports of all services, living or dead.
    pub(crate) fn ports(&self) -> Vec<Port> {
        let ports = self.publish_subscribe().into_iter().flat_map(orphans::ports);
        ports.chain(orphans::event_ports(&self.wake)).collect()
    }

    /// Returns `true` once the owner receives what clients send. It creates its ports after the services.
    fn are_received(&self) -> bool {
        self.publish_subscribe()[11..].iter().all(|service| reader_count(service) > 0)
    }

    /// Returns the number of readers of everything that the owner publishes, except the status.
    pub(crate) fn reader_count(&self) -> usize {
        self.publish_subscribe()[..11].iter().map(|service| reader_count(service)).sum()
    }
}

/// Error of attaching to a simulation.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum AttachError {
    /// No living process owns the name.
    #[error(
        "no node runs as {endpoint}: {detail}; start one with `sim-node run{options}`, or name a running one with --domain and --name"
    )]
    NoNode {
        /// Address without a simulation.
        endpoint: Endpoint,
        /// The end of the last node, or the missing service or publisher.
        detail: String,
        /// Options that start a node at this address.
        options: String,
    },
    /// A process owns the name, but its services are missing.
    #[error(
        "{} runs as {endpoint}, but its services are missing: if it has not just started, a cleaner of /tmp has removed their files; restart it",
        process_id.map_or("a process".to_owned(), |id| format!("process {id}"))
    )]
    NoServices {
        /// Address of the process.
        endpoint: Endpoint,
        /// The process, if its lock names it.
        process_id: Option<u32>,
    },
    /// The id of the client is too large.
    #[error("{client_id} is no client id (allowed: 0 to {})", CLIENT_ID_END - 1)]
    ClientId {
        /// The refused id.
        client_id: u64,
    },
    /// A service could not be opened or connected to.
    #[error(transparent)]
    Service(#[from] ServiceError),
    /// The system returned no random number for the client id.
    #[error("the system returned no random number for the client id: {detail}")]
    NoRandomNumber {
        /// Error of the system.
        detail: String,
    },
}

/// A living process that owns a name, or calls itself its owner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OwnerProcess {
    /// Its process id, if iceoryx2 knows it.
    pub(crate) id: Option<u32>,
}

/// Returns the living process of one of these iceoryx2 nodes, which have publishers of `status`.
pub(crate) fn living_process(
    status: &Service<NodeStatus>,
    nodes: &[UniqueNodeId],
) -> Option<OwnerProcess> {
    let mut process = None;
    if nodes.is_empty() {
        return process;
    }
    let listed = status.nodes(|node| match node {
        NodeState::Alive(node) if nodes.contains(node.id()) => {
            let id = node.details().as_ref().map(|details| details.process_id().value());
            process = Some(OwnerProcess { id: id.and_then(|id| u32::try_from(id).ok()) });
            CallbackProgression::Stop
        }
        _ => CallbackProgression::Continue,
    });
    // If iceoryx2 cannot list the nodes, the process counts as alive.
    if listed.is_err() { Some(OwnerProcess { id: None }) } else { process }
}

/// A connection to the services of a simulation that another process owns.
#[derive(Debug)]
pub(crate) struct Attachment {
    pub(crate) services: Services,
    pub(crate) status: Arc<Service<NodeStatus>>,
    /// The connection to an owner on another host; `None` for one on this host.
    mirror: Option<Mirror>,
    /// The processes whose messages count, for all readers of this attachment.
    pub(crate) source: Arc<Source>,
    // Dropped last: the services belong to its node.
    pub(crate) session: Session,
}

/// Most attempts to open the services of an owner that is still creating them and its ports.
const ATTEMPTS_MAX: usize = 100;

impl Attachment {
    /// Joins the domain of an endpoint, and opens all services of its living owner. A domain that no program
    /// uses stays without files.
    pub(crate) fn to(endpoint: &Endpoint) -> Result<Self, AttachError> {
        let config = Session::configuration(endpoint)?;
        if Session::has_root(endpoint, &config)? {
            Self::open(Session::join(endpoint)?)
        } else {
            Err(no_node(&config, endpoint, "no program uses this domain".to_owned()))
        }
    }

    /// Opens all services of a living owner, once it receives commands.
    pub(crate) fn open(session: Session) -> Result<Self, AttachError> {
        let status = match session.service(&STATUS, Access::Open) {
            Err(ServiceError::Missing { service, .. }) => {
                let detail = format!("service '{service}' does not exist");
                return Err(no_node(session.config(), &session.endpoint, detail));
            }
            result => Arc::new(result?),
        };
        let (is_mirror, lock) = (is_mirror(&status), session.lock_place());
        for _ in 0..ATTEMPTS_MAX {
            if !is_mirror && living_process(&status, &owner_nodes(&status, &lock)).is_none() {
                break;
            }
            match Services::access(&session, Access::Open) {
                Err(ServiceError::Missing { .. }) => session.pause(),
                services if is_mirror => return Self::open_mirror(session, status, services?),
                services => {
                    let services = services?;
                    if services.are_received() {
                        let source = Arc::new(Source::new(&status, lock));
                        return Ok(Self { services, status, mirror: None, source, session });
                    }
                    session.pause();
                }
            }
        }
        let service = session.service_name(&STATUS);
        let detail = format!("service '{service}' has no live publisher");
        Err(no_node(session.config(), &session.endpoint, detail))
    }

    /// Connects to an owner on another host.
    fn open_mirror(
        session: Session,
        status: Arc<Service<NodeStatus>>,
        services: Services,
    ) -> Result<Self, AttachError> {
        let Services { particles, ready, .. } = &services;
        if let Some(mirror) = Mirror::connect(&session, &status, particles, ready)? {
            let source = Arc::new(Source::new(&status, session.lock_place()));
            return Ok(Self { services, status, mirror: Some(mirror), source, session });
        }
        let service = session.service_name(&STATUS);
        let detail = format!(
            "service '{service}' is the mirror of a tunnel, through which no status arrives"
        );
        Err(no_node(session.config(), &session.endpoint, detail))
    }

    pub(crate) fn owner(&self) -> Option<OwnerProcess> {
        if let Some(mirror) = &self.mirror {
            return mirror.is_owner_alive().then_some(OwnerProcess { id: None });
        }
        let nodes = owner_nodes(&self.status, &self.session.lock_place());
        living_process(&self.status, &nodes).or_else(|| self.unlisted_owner(&nodes))
    }

    /// Returns `true` if the owner is on another host, behind a tunnel.
    pub(crate) fn is_far(&self) -> bool {
        self.mirror.is_some()
    }

    /// Asks an owner on another host for the latched messages. On this host, readers receive them anyway.
    pub(crate) fn request_latched(&self) {
        if let Some(mirror) = &self.mirror {
            mirror.request_latched();
        }
    }

    /// Returns an owner that iceoryx2 takes for dead, because a cleaner of `/tmp` has removed the files of
    /// its node. It still holds the lock of the name.
    fn unlisted_owner(&self, nodes: &[UniqueNodeId]) -> Option<OwnerProcess> {
        let has_publisher = !nodes.is_empty();
        has_publisher.then(|| self.session.lock_holder()).flatten().map(|id| OwnerProcess { id })
    }
}

/// Returns the error for a name without services. The locks of the name tell more than what is missing.
fn no_node(config: &Config, endpoint: &Endpoint, missing: String) -> AttachError {
    let endpoint = endpoint.clone();
    if let Some(process_id) = OwnerLock::holder(config, endpoint.name()) {
        return AttachError::NoServices { endpoint, process_id };
    }
    let detail = match OwnerLock::killed_holder(config, endpoint.name()) {
        Some(Some(process_id)) => format!("the last one, process {process_id}, was killed"),
        Some(None) => "the last one was killed".to_owned(),
        None => missing,
    };
    let options = endpoint.options();
    AttachError::NoNode { endpoint, detail, options }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sim_messages::{CONTRACT_VERSION, ParameterValues};

    use crate::owner::Owner;
    use crate::owner::error::OwnerError;
    use crate::owner::load::Load;
    use crate::testing::TestDomain;

    const EMPTY: Load<'_> = Load {
        header: LoadHeader {
            run_id: 0,
            step: 0,
            scene_hash: 0,
            origin: [0.0; 3],
            topology_revision: 0,
            count: 0,
            particle_count: 0,
            rate_hz: 240,
            method: 0,
            spare: 0,
        },
        scene: b"",
        constraints: &[],
        bends: &[],
        triangles: &[],
        collider_count: 0,
        keyframe_size_bytes_max: 0,
        parameters: ParameterValues::DEFAULT,
    };

    fn join(domain: &TestDomain, contract_version: u32) -> Session {
        Session::join_with_version(&domain.endpoint(), contract_version).unwrap()
    }

    #[test]
    fn a_client_of_another_contract_version_is_refused_with_both_versions() {
        let domain = TestDomain::new();
        let _owner =
            Owner::create_with_version(&domain.endpoint(), CONTRACT_VERSION, &EMPTY).unwrap();
        let error = Attachment::open(join(&domain, CONTRACT_VERSION + 1)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "service 'sim/status' has contract version 7, but this program has 8: stop every \
             program of the other version, or start this one with another --domain"
        );
    }

    #[test]
    fn an_owner_is_refused_while_clients_keep_services_of_another_version() {
        let domain = TestDomain::new();
        let old = Owner::create_with_version(&domain.endpoint(), CONTRACT_VERSION, &EMPTY).unwrap();
        let client = Attachment::open(join(&domain, CONTRACT_VERSION)).unwrap();
        drop(old);
        let new = Owner::create_with_version(&domain.endpoint(), CONTRACT_VERSION + 1, &EMPTY);
        let error = ServiceError::Version {
            service: "sim/status".to_owned(),
            actual: "7".to_owned(),
            expected: 8,
        };
        assert_eq!(new.unwrap_err(), OwnerError::Service(error));
        // Without clients, the services of the other version are gone.
        drop(client);
        Owner::create_with_version(&domain.endpoint(), CONTRACT_VERSION + 1, &EMPTY).unwrap();
    }

    #[test]
    fn a_foreign_service_is_not_mistaken_for_another_version() {
        let domain = TestDomain::new();
        let session = join(&domain, CONTRACT_VERSION);
        let _foreign = session.service::<u64, ()>(&STATUS, Access::Create).unwrap();
        let error = Attachment::open(join(&domain, CONTRACT_VERSION)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "service 'sim/status' exists, but does not belong to this contract \
             (IncompatibleTypes): choose another --name or --domain"
        );
    }
}
