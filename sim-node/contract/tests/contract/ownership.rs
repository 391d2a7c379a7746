//! A name has one owner, and clients notice when it comes and goes. Owners and clients are in one
//! process, but each has its own iceoryx2 node, so they are as separate as in two processes.

use std::sync::mpsc;
use std::thread;

use sim_contract::testing::TestDomain;
use sim_contract::{
    AttachError, CLIENT_ID_END, Client, Endpoint, Load, NodeStatus, Owner, OwnerError, Tap,
};

use crate::support::{
    DEADLINE, MOMENT, constraints, create_owner, load_header, publish_step, triangles,
};

#[test]
fn a_second_owner_is_refused_and_the_error_names_the_first() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let error = create_owner(&domain.endpoint()).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, OwnerError::NameTaken { .. }), "{text}");
    let domain_name = domain.name();
    let process = std::process::id();
    assert_eq!(
        text,
        format!(
            "'sim' in domain '{domain_name}' is already running, as process {process}: stop that \
             process, or choose another --name or --domain"
        )
    );
    // The first owner still works, and another name is free.
    publish_step(&owner, 0);
    create_owner(&Endpoint::new(Some(domain_name), "other").unwrap()).unwrap();
}

#[test]
fn a_client_without_a_node_gets_an_error_that_names_the_service_and_the_remedy() {
    let domain = TestDomain::new();
    let _other = create_owner(&domain.endpoint()).unwrap();
    let endpoint = Endpoint::new(Some(domain.name()), "left").unwrap();
    let error = Client::attach(&endpoint).unwrap_err();
    assert!(matches!(error, AttachError::NoNode { .. }));
    let name = domain.name();
    assert_eq!(
        error.to_string(),
        format!(
            "no node runs as 'left' in domain '{name}': service 'left/status' does not \
             exist; start one with `sim-node run --domain {name} --name left`, or name a running one \
             with --domain and --name"
        )
    );
    assert!(matches!(Tap::attach(&endpoint).unwrap_err(), AttachError::NoNode { .. }));
}

#[test]
fn a_client_of_an_unused_domain_leaves_it_without_files() {
    let domain = TestDomain::new();
    let (endpoint, name) = (domain.endpoint(), domain.name());
    for error in [Client::attach(&endpoint).unwrap_err(), Tap::attach(&endpoint).unwrap_err()] {
        let expected =
            format!("no node runs as 'sim' in domain '{name}': no program uses this domain; ");
        assert!(error.to_string().starts_with(&expected), "{error}");
    }
    assert!(!domain.root().exists());
    let shared_memory = std::fs::read_dir("/dev/shm").unwrap().flatten();
    let names = shared_memory.map(|entry| entry.file_name().into_string().unwrap());
    let left: Vec<_> = names.filter(|one| one.starts_with(&format!("{name}_"))).collect();
    assert_eq!(left, Vec::<String>::new());
}

#[test]
fn a_client_id_that_json_cannot_hold_is_refused() {
    let domain = TestDomain::new();
    let _owner = create_owner(&domain.endpoint()).unwrap();
    let error = Client::attach_as(&domain.endpoint(), CLIENT_ID_END).unwrap_err();
    assert_eq!(
        error.to_string(),
        "9007199254740992 is no client id (allowed: 0 to 9007199254740991)"
    );
    Client::attach_as(&domain.endpoint(), CLIENT_ID_END - 1).unwrap();
}

#[test]
fn clients_that_poll_or_wait_notice_a_dropped_owner() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 0);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let tap = Tap::attach(&domain.endpoint()).unwrap();
    assert!(client.next_snapshot(MOMENT).unwrap().is_none());
    assert!(client.is_owner_alive() && tap.is_owner_alive());

    let endpoint = domain.endpoint();
    let (started_sender, started) = mpsc::channel();
    let waiter = thread::spawn(move || {
        let mut client = Client::attach(&endpoint).unwrap();
        client.latest_snapshot(DEADLINE).unwrap().unwrap();
        started_sender.send(()).unwrap();
        // Far longer than the test may take: only the drop of the owner ends the wait.
        client.latest_snapshot(DEADLINE * 1000).unwrap().is_none() && !client.is_owner_alive()
    });
    while started.try_recv().is_err() {
        owner.refresh();
        thread::yield_now();
    }
    drop(owner);
    assert!(waiter.join().unwrap());
    assert!(!client.is_owner_alive());
    assert!(!tap.is_owner_alive());
    tap.wait(DEADLINE);
    let error = Client::attach(&domain.endpoint()).unwrap_err().to_string();
    assert!(error.contains("service 'sim/status' has no live publisher"), "{error}");
}

#[test]
fn a_client_stays_connected_when_a_new_owner_claims_the_name() {
    let domain = TestDomain::new();
    let first = create_owner(&domain.endpoint()).unwrap();
    publish_step(&first, 41);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert!(client.topology(MOMENT).unwrap().is_none());
    first.refresh();
    assert_eq!(client.topology(MOMENT).unwrap().unwrap().header.topology_revision, 1);
    assert!(client.next_snapshot(MOMENT).unwrap().is_none());
    first.refresh();
    let held = client.next_snapshot(MOMENT).unwrap().unwrap();
    drop(first);
    assert!(!client.is_owner_alive());

    let load = Load {
        header: sim_contract::LoadHeader { topology_revision: 2, ..load_header() },
        scene: b"",
        constraints: &constraints(),
        bends: &[],
        triangles: &triangles(),
        collider_count: 0,
        keyframe_size_bytes_max: 0,
        parameters: sim_contract::ParameterValues::default(),
    };
    let second = Owner::create(&domain.endpoint(), &load).unwrap();
    publish_step(&second, 0);
    assert!(client.is_owner_alive());
    assert_eq!(client.next_snapshot(DEADLINE).unwrap().unwrap().header().step, 0);
    assert_eq!(client.topology(MOMENT).unwrap().unwrap().header.topology_revision, 2);
    // Snapshots of the first owner stay readable.
    assert_eq!((held.header().step, held.particles().len()), (41, 4));
}

#[test]
fn a_status_of_a_new_owner_is_newer_than_all_unread_ones_of_the_owner_before() {
    let domain = TestDomain::new();
    let status = |run_id, step| NodeStatus { run_id, step, ..NodeStatus::default() };
    let first = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert!(client.status(MOMENT).unwrap().is_none());
    // More than any reader buffers.
    for step in 0..100 {
        first.publish_status(&status(1, step)).unwrap();
    }
    drop(first);
    let second = create_owner(&domain.endpoint()).unwrap();
    second.publish_status(&status(2, 7)).unwrap();
    let newest = client.status(DEADLINE).unwrap().unwrap();
    assert_eq!((newest.run_id, newest.step), (2, 7));
}
