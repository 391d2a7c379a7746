//! The nodes of a domain.

use std::collections::BTreeSet;
use std::thread;
use std::time::Duration;

use iceoryx2::prelude::{CallbackProgression, Config};
use sim_host::clock::{self, Deadline};
use sim_messages::{CONSOLE_CLIENT_ID, NodeStatus};

use crate::client::Client;
use crate::endpoint::Endpoint;
use crate::ports::domain::root;
use crate::ports::leftovers::lock::OwnerLock;
use crate::ports::leftovers::{lock, unfinished};
use crate::ports::service::{STATUS, ServiceError};
use crate::ports::services::AttachError;

/// A living process that owns a name.
#[derive(Debug, Clone, PartialEq)]
pub struct ListedNode {
    /// The owned name.
    pub name: String,
    /// The process, if its status or its lock names it.
    pub process_id: Option<u32>,
    /// Answer of the process.
    pub answer: NodeAnswer,
}

/// Answer of a node to the question for its status.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum NodeAnswer {
    /// Its newest status.
    Status(Box<NodeStatus>),
    /// The process lives, but has not answered in time: it is stopped, or busy with a long step.
    Silent,
    /// The node has another version of the contract.
    OtherVersion {
        /// Version of the node.
        actual: String,
        /// Version of this program.
        expected: u32,
    },
    /// The process owns the name, but this one cannot attach to it. The text is the reason.
    Unreachable(String),
}

/// Pause before the next attempt to reach a node.
const PAUSE_NS: u64 = clock::SECOND_NS / 50;

/// Lists the living owners in a domain, by name.
pub(crate) fn list(
    config: &Config,
    endpoint: &Endpoint,
    timeout: Duration,
) -> Result<Vec<ListedNode>, ServiceError> {
    let exists = root::exists(&root::path(config))
        .map_err(|cause| ServiceError::Root { endpoint: endpoint.clone(), cause })?;
    let mut names = lock::names(config);
    if exists {
        names.extend(names_of_services(config));
    }
    let domain = endpoint.domain();
    // A stopped process must not delay the answers of the others.
    let nodes: Vec<_> = thread::scope(|scope| {
        let asked: Vec<_> = names
            .iter()
            .filter_map(|name| Endpoint::new(domain, name).ok())
            .map(|endpoint| scope.spawn(move || find(config, &endpoint, timeout)))
            .collect();
        asked.into_iter().filter_map(|node| node.join().ok().flatten()).collect()
    });
    Ok(nodes)
}

/// Returns the names that have a service `status`. Its owner may have lost the files of its lock.
fn names_of_services(config: &Config) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    // Without a list, the locks tell all names but those of damaged domains.
    unfinished::list_services(config, |service| {
        let service = service.static_details.name().as_str();
        if let Some(name) = service.strip_suffix(STATUS.suffix)
            && let Some(name) = name.strip_suffix('/')
        {
            names.insert(name.to_owned());
        }
        CallbackProgression::Continue
    });
    names
}

/// Returns the owner of a name; `None` if there is none.
fn find(config: &Config, endpoint: &Endpoint, timeout: Duration) -> Option<ListedNode> {
    let answer = ask(config, endpoint, timeout)?;
    let process_id = match &answer {
        NodeAnswer::Status(status) => Some(status.process_id),
        _ => OwnerLock::holder(config, endpoint.name()).flatten(),
    };
    Some(ListedNode { name: endpoint.name().to_owned(), process_id, answer })
}

/// Asks until there is an answer: the services of a node that is just starting are missing.
fn ask(config: &Config, endpoint: &Endpoint, timeout: Duration) -> Option<NodeAnswer> {
    let deadline = Deadline::after(timeout);
    loop {
        let answer = try_to_ask(config, endpoint, timeout)?;
        if !matches!(answer, NodeAnswer::Unreachable(_)) || deadline.remaining().is_zero() {
            return Some(answer);
        }
        clock::sleep_until(clock::monotonic_ns() + PAUSE_NS);
    }
}

fn try_to_ask(config: &Config, endpoint: &Endpoint, timeout: Duration) -> Option<NodeAnswer> {
    let is_owned = || OwnerLock::holder(config, endpoint.name()).is_some();
    let unreachable = |text: String| is_owned().then_some(NodeAnswer::Unreachable(text));
    let mut client = match Client::attach_as(endpoint, CONSOLE_CLIENT_ID) {
        Ok(client) => client,
        Err(AttachError::Service(ServiceError::Version { actual, expected, .. })) => {
            return is_owned().then_some(NodeAnswer::OtherVersion { actual, expected });
        }
        Err(error) => return unreachable(error.to_string()),
    };
    match client.status(timeout) {
        Ok(Some(status)) => Some(NodeAnswer::Status(Box::new(status))),
        Ok(None) => client.is_owner_alive().then_some(NodeAnswer::Silent),
        Err(error) => unreachable(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::domain::Domain;
    use crate::owner::Owner;
    use crate::owner::load::Load;
    use crate::ports::domain;
    use crate::testing::TestDomain;
    use sim_messages::{CONTRACT_VERSION, LoadHeader};

    const LOAD: Load<'_> = Load {
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
        parameters: sim_messages::ParameterValues::DEFAULT,
    };

    fn endpoint(domain: &TestDomain, name: &str) -> Endpoint {
        Endpoint::new(Some(domain.name()), name).unwrap()
    }

    fn list(domain: &TestDomain) -> Vec<ListedNode> {
        Domain::new(&domain.endpoint()).unwrap().nodes(Duration::from_millis(10)).unwrap()
    }

    #[test]
    fn a_domain_without_nodes_is_empty_and_stays_untouched() {
        let domain = TestDomain::new();
        assert_eq!(list(&domain), []);
        assert!(!domain.root().exists());
    }

    #[test]
    fn a_node_of_another_contract_version_is_listed_with_both_versions() {
        let domain = TestDomain::new();
        let other = endpoint(&domain, "other");
        let owner = Owner::create_with_version(&other, CONTRACT_VERSION + 1, &LOAD).unwrap();
        let process_id = Some(std::process::id());
        let actual = (CONTRACT_VERSION + 1).to_string();
        let answer = NodeAnswer::OtherVersion { actual, expected: CONTRACT_VERSION };
        let expected = ListedNode { name: "other".to_owned(), process_id, answer };
        assert_eq!(list(&domain), [expected]);
        drop(owner);
        assert_eq!(list(&domain), []);
    }

    #[test]
    fn an_owner_without_a_status_is_silent_and_one_that_has_lost_its_locks_is_still_listed() {
        let domain = TestDomain::new();
        let owner = Owner::create(&endpoint(&domain, "a"), &LOAD).unwrap();
        let [silent] = list(&domain).try_into().unwrap();
        assert_eq!((silent.name.as_str(), silent.answer), ("a", NodeAnswer::Silent));
        assert_eq!(silent.process_id, Some(std::process::id()));
        let config = domain::configuration(Some(domain.name())).unwrap();
        let prefix = &config.global.prefix;
        let user = rustix::process::geteuid().as_raw();
        std::fs::remove_file(root::path(&config).join(format!("{prefix}a.owner"))).unwrap();
        std::fs::remove_file(format!("/dev/shm/{prefix}{user}_a.owner")).unwrap();
        let names: Vec<_> = list(&domain).into_iter().map(|node| node.name).collect();
        assert_eq!(names, ["a"]);
        drop(owner);
    }
}
