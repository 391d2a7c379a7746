//! The far end of a network tunnel: the services of an owner on another host.
//!
//! A tunnel creates the services of the other host anew, without the version of the contract, and
//! publishes in the place of the owner. So the owner is known by its status alone, and latched messages
//! come only on request.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use iceoryx2::prelude::PortFactory;
use sim_host::clock::{Deadline, SECOND_NS, monotonic_ns};
use sim_messages::{
    FAR_SILENCE_MAX_MS, MIRROR_BORROWED_MIN, MIRROR_BUFFERED_MIN, NodeStatus, ParticleState, Ready,
    SnapshotHeader,
};

use crate::ports::port::Service;
use crate::ports::reader::Reader;
use crate::ports::service::{PARTICLES, READY, STATUS, ServiceError};
use crate::ports::session::Session;
use crate::ports::writer::Writer;

/// Longest wait for the first status, which comes ten times a second.
const FIRST_STATUS_MAX: Duration = Duration::from_secs(3);
/// Pause before a client asks for the latched messages again.
const REQUEST_PERIOD_NS: u64 = SECOND_NS;

/// A connection to the owner behind a tunnel.
#[derive(Debug)]
pub(crate) struct Mirror {
    status: Reader<NodeStatus>,
    /// Kept for the life of the client: a request that the tunnel has not read vanishes with its writer.
    requests: Writer<Ready>,
    /// CLOCK_MONOTONIC of the last received status.
    heard_ns: AtomicU64,
    /// CLOCK_MONOTONIC from which on another request may be sent.
    next_request_ns: AtomicU64,
}

impl Mirror {
    /// Connects, and waits for a status. Returns `None` if none arrives: there is no owner behind the tunnel.
    pub(crate) fn connect(
        session: &Session,
        status: &Service<NodeStatus>,
        particles: &Service<ParticleState, SnapshotHeader>,
        ready: &Service<Ready>,
    ) -> Result<Option<Self>, ServiceError> {
        check_quality(particles)?;
        let mirror = Self {
            status: Reader::of_every_publisher(status, &STATUS)?,
            requests: Writer::of_values(session.config(), ready, &READY)?,
            heard_ns: AtomicU64::new(0),
            next_request_ns: AtomicU64::new(0),
        };
        let deadline = Deadline::after(FIRST_STATUS_MAX);
        while !deadline.remaining().is_zero() {
            if let Ok(Some(first)) = mirror.status.newest_value() {
                mirror.heard_ns.store(monotonic_ns(), Ordering::Relaxed);
                return check_version(session, &first).map(|()| Some(mirror));
            }
            session.pause();
        }
        Ok(None)
    }

    /// Returns `true` if a status has arrived of late.
    pub(crate) fn is_owner_alive(&self) -> bool {
        let now_ns = monotonic_ns();
        // A broken connection is silence.
        if matches!(self.status.newest_value(), Ok(Some(_))) {
            self.heard_ns.store(now_ns, Ordering::Relaxed);
        }
        let silence_ns = now_ns.saturating_sub(self.heard_ns.load(Ordering::Relaxed));
        Duration::from_nanos(silence_ns) <= Duration::from_millis(FAR_SILENCE_MAX_MS)
    }

    /// Asks the owner for the latched messages, at most once a second.
    pub(crate) fn request_latched(&self) {
        let now_ns = monotonic_ns();
        if now_ns < self.next_request_ns.load(Ordering::Relaxed) {
            return;
        }
        self.next_request_ns.store(now_ns + REQUEST_PERIOD_NS, Ordering::Relaxed);
        // Without memory for it, the next request may succeed.
        let _ = self.requests.send_value(Ready { tag: Ready::REPEAT_TAG, ..Ready::default() });
    }
}

fn check_version(session: &Session, status: &NodeStatus) -> Result<(), ServiceError> {
    let expected = session.contract_version();
    if status.contract_version == expected {
        return Ok(());
    }
    let (service, actual) = (session.service_name(&STATUS), status.contract_version.to_string());
    Err(ServiceError::Version { service, actual, expected })
}

/// Checks the quality of service of one mirror. A tunnel creates all with the defaults of its configuration.
fn check_quality(particles: &Service<ParticleState, SnapshotHeader>) -> Result<(), ServiceError> {
    let quality = particles.static_config();
    let qualities = [
        ("buffered messages", quality.subscriber_max_buffer_size(), MIRROR_BUFFERED_MIN),
        ("held messages", quality.subscriber_max_borrowed_samples(), MIRROR_BORROWED_MIN),
        ("latched messages", quality.history_size(), PARTICLES.history),
    ];
    match qualities.into_iter().find(|(_, actual, min)| actual < min) {
        None => Ok(()),
        Some((quality, actual, min)) => {
            let service = particles.name().to_string();
            Err(ServiceError::PoorMirror { service, quality, actual, min })
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;
    use std::thread;

    use super::*;
    use crate::client::Client;
    use crate::ports::service::ServiceSpec;
    use crate::ports::services::{AttachError, Services};
    use crate::ports::session::Access;
    use crate::testing::TestDomain;
    use sim_messages::CONTRACT_VERSION;

    /// Services as a tunnel creates them, with the status of a node of a contract version.
    struct Tunnel {
        status: Writer<NodeStatus>,
        _services: Services,
        _status_service: Service<NodeStatus>,
        _session: Session,
    }

    impl Tunnel {
        fn create(domain: &TestDomain) -> Self {
            let session = Session::join_without_version(&domain.endpoint()).unwrap();
            let service = session.service(&STATUS, Access::Create).unwrap();
            Self {
                status: Writer::of_values(session.config(), &service, &STATUS).unwrap(),
                _services: Services::access(&session, Access::Create).unwrap(),
                _status_service: service,
                _session: session,
            }
        }

        /// Attaches a client while statuses arrive.
        fn attach(&self, domain: &TestDomain, version: u32) -> Result<Client, AttachError> {
            let is_over = AtomicBool::new(false);
            thread::scope(|scope| {
                let attaching = scope.spawn(|| {
                    let client = Client::attach(&domain.endpoint());
                    is_over.store(true, Ordering::Relaxed);
                    client
                });
                let status = NodeStatus { contract_version: version, ..NodeStatus::default() };
                while !is_over.load(Ordering::Relaxed) {
                    self.status.send_value(status).unwrap();
                    thread::yield_now();
                }
                attaching.join().unwrap()
            })
        }
    }

    #[test]
    fn a_mirror_without_a_version_passes_where_the_status_has_the_right_one() {
        let domain = TestDomain::new();
        let tunnel = Tunnel::create(&domain);
        let client = tunnel.attach(&domain, CONTRACT_VERSION).unwrap();
        assert!(client.is_owner_alive());
    }

    #[test]
    fn a_mirror_of_a_node_of_another_version_is_refused_with_both_versions() {
        let domain = TestDomain::new();
        let tunnel = Tunnel::create(&domain);
        let error = tunnel.attach(&domain, CONTRACT_VERSION + 1).unwrap_err();
        let expected = ServiceError::Version {
            service: "sim/status".to_owned(),
            actual: (CONTRACT_VERSION + 1).to_string(),
            expected: CONTRACT_VERSION,
        };
        assert_eq!(error, AttachError::Service(expected));
    }

    #[test]
    fn a_mirror_without_a_status_has_no_node() {
        let domain = TestDomain::new();
        let _tunnel = Tunnel::create(&domain);
        let error = Client::attach(&domain.endpoint()).unwrap_err();
        assert!(matches!(error, AttachError::NoNode { .. }));
        let text = error.to_string();
        assert!(text.contains("is the mirror of a tunnel, through which no status"), "{text}");
    }

    #[test]
    fn a_mirror_that_holds_too_few_messages_is_refused_with_the_remedy() {
        let domain = TestDomain::new();
        let session = Session::join_without_version(&domain.endpoint()).unwrap();
        let poor = ServiceSpec { buffered: 2, ..PARTICLES };
        let particles = session.service(&poor, Access::Create).unwrap();
        let text = check_quality(&particles).unwrap_err().to_string();
        assert_eq!(
            text,
            "service 'sim/particles' is the mirror of a tunnel that was started with 2 buffered \
             messages, but at least 64 are needed: start the tunnel in a folder whose \
             config/iceoryx2.toml `sim-node doctor --iox2-config` has printed"
        );
    }

    #[test]
    fn a_node_does_not_take_a_name_that_a_tunnel_mirrors() {
        let domain = TestDomain::new();
        let _tunnel = Tunnel::create(&domain);
        let session = Session::join(&domain.endpoint()).unwrap();
        let error = session.service::<NodeStatus, ()>(&STATUS, Access::Create).unwrap_err();
        assert!(matches!(error, ServiceError::Incompatible { .. }), "{error}");
    }
}
