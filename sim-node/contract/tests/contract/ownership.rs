//! One owner for a name, and what others see of it coming and going. Owners and clients are in one
//! process, as far apart for iceoryx2 as in two: each has its own node.

use std::sync::mpsc;
use std::thread;

use sim_contract::testing::TestDomain;
use sim_contract::{AttachError, Client, Endpoint, Load, Owner, OwnerError, Tap};

use crate::support::{
    DEADLINE, MOMENT, constraints, create_owner, load_header, publish_step, triangles,
};

#[test]
fn a_second_owner_is_refused_and_told_who_has_the_name() {
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
             one, or choose another --name or --domain"
        )
    );
    // The first one is none the worse, and another name is free.
    publish_step(&owner, 0);
    create_owner(&Endpoint::new(Some(domain_name), "other").unwrap()).unwrap();
}

#[test]
fn a_client_without_a_node_is_told_what_was_looked_for_and_how_to_start_one() {
    let domain = TestDomain::new();
    let endpoint = Endpoint::new(Some(domain.name()), "left").unwrap();
    let error = Client::attach(&endpoint).unwrap_err();
    assert!(matches!(error, AttachError::NoNode { .. }));
    let name = domain.name();
    assert_eq!(
        error.to_string(),
        format!(
            "no simulation runs as 'left' in domain '{name}': there is no service 'left/status'; \
             start one with `sim-node run --domain {name} --name left`, or say with --domain and \
             --name where it runs"
        )
    );
    assert!(matches!(Tap::attach(&endpoint).unwrap_err(), AttachError::NoNode { .. }));
}

#[test]
fn a_dropped_owner_is_noticed_by_those_who_ask_and_those_who_wait() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 0);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let tap = Tap::attach(&domain.endpoint()).unwrap();
    assert!(client.next_snapshot(MOMENT).unwrap().is_none());
    assert!(client.is_owner_alive() && tap.is_owner_alive());

    let endpoint = domain.endpoint();
    let (is_reading, reading) = mpsc::channel();
    let waiter = thread::spawn(move || {
        let mut client = Client::attach(&endpoint).unwrap();
        client.latest_snapshot(DEADLINE).unwrap().unwrap();
        is_reading.send(()).unwrap();
        // Far longer than a test may take: only the owner's going ends it.
        client.latest_snapshot(DEADLINE * 1000).unwrap().is_none() && !client.is_owner_alive()
    });
    while reading.try_recv().is_err() {
        owner.refresh();
        thread::yield_now();
    }
    drop(owner);
    assert!(waiter.join().unwrap());
    assert!(!client.is_owner_alive());
    assert!(!tap.is_owner_alive());
    tap.wait(DEADLINE);
    let error = Client::attach(&domain.endpoint()).unwrap_err().to_string();
    assert!(error.contains("service 'sim/status' has no living publisher"), "{error}");
}

#[test]
fn an_owner_can_come_again_while_a_client_stays() {
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
    // What was read from the first one stays readable.
    assert_eq!((held.header().step, held.particles().len()), (41, 4));
}
