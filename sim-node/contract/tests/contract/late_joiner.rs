//! A late reader receives the latched messages at once. The owner acts in the test's own thread,
//! before or beside the reader, so the messages that arrive were published before the reader joined.

use std::thread;

use sim_contract::testing::TestDomain;
use sim_contract::{Client, Tap, TearCause, TearsHeader, TornConstraint, Update};

use crate::support::{
    DEADLINE, MOMENT, PARTICLE_COUNT, RUN_ID, SCENE, bends, colliders, constraints, create_owner,
    parameters, particle, publish_colliders, publish_everything, publish_step, triangles,
};

#[test]
fn a_late_reader_receives_topology_bends_surface_scene_and_the_last_snapshot() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_everything(&owner, 0);
    publish_everything(&owner, 1);

    let endpoint = domain.endpoint();
    let reader = thread::spawn(move || {
        let mut client = Client::attach(&endpoint).unwrap();
        let topology = client.topology(DEADLINE).unwrap().unwrap();
        assert_eq!(topology.constraints, constraints());
        assert_eq!(topology.header.count, 3);
        let list = client.bends(DEADLINE).unwrap().unwrap();
        assert_eq!((list.header.count, list.bends), (2, bends()));
        let surface = client.surface(DEADLINE).unwrap().unwrap();
        assert_eq!(surface.triangles, triangles());
        assert_eq!(surface.header.particle_count, PARTICLE_COUNT);
        assert_eq!(client.scene(DEADLINE).unwrap().unwrap(), SCENE);
        assert_eq!(client.status(DEADLINE).unwrap().unwrap().step, 1);
        let snapshot = client.next_snapshot(DEADLINE).unwrap().unwrap();
        assert_eq!(snapshot.header().step, 1);
        assert_eq!(snapshot.particles().len(), PARTICLE_COUNT as usize);
        assert_eq!(snapshot.particles()[3], particle(1, 3));
        // Latched messages can be read again; a snapshot is read once.
        assert_eq!(client.topology(MOMENT).unwrap().unwrap(), topology);
        assert!(client.next_snapshot(MOMENT).unwrap().is_none());
    });
    // The owner acts like a paused node: it publishes nothing, but refreshes its readers.
    while !reader.is_finished() {
        owner.refresh();
        thread::yield_now();
    }
    reader.join().unwrap();
}

#[test]
fn a_late_tap_receives_every_kind_of_message() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_everything(&owner, 5);

    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    assert_eq!((owner.reader_count(), owner.keyframe_reader_count()), (1, 1));
    owner.refresh();
    tap.wait(DEADLINE);
    let cut = TornConstraint::new(2, Some(TearCause::Cut));
    let mut kinds = Vec::new();
    let state = tap.next_state(|message| {
        kinds.push(match *message {
            Update::Scene(_, text) if text == SCENE.as_bytes() => "scene",
            Update::Topology(_, list) if list == constraints() => "topology",
            Update::Bends(_, list) if list == bends() => "bends",
            Update::Surface(_, list) if list == triangles() => "surface",
            Update::Colliders(header, list) if list == colliders(header.step) => "colliders",
            Update::Tears(header, [torn]) if header.count == 1 && *torn == cut => "tears",
            Update::Parameters(_, values) if *values == parameters(5) => "parameters",
            Update::Keyframe(header, b"keyframe") if header.size_bytes == 8 => "keyframe",
            Update::Status(status) if status.step == 5 => "status",
            update => panic!("{update:?}"),
        });
    });
    let state = state.unwrap();
    assert_eq!((state.header.step, state.particles[2]), (5, particle(5, 2)));
    let expected = [
        "scene",
        "topology",
        "bends",
        "surface",
        "colliders",
        "tears",
        "parameters",
        "keyframe",
        "status",
    ];
    assert_eq!(kinds, expected);
    assert!(tap.next_state(|_| {}).is_none());
}

#[test]
fn a_late_client_reads_all_torn_constraints_with_their_causes_and_all_colliders() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let publish = |step, new_count, torn: &[TornConstraint]| {
        let header = TearsHeader { run_id: RUN_ID, step, new_count, ..TearsHeader::default() };
        owner.publish_tears(header, torn).unwrap();
        publish_colliders(&owner, step);
        owner.refresh();
    };
    let stretched = TornConstraint::new(2, Some(TearCause::Stretch));
    let (cut, unknown) =
        (TornConstraint::new(0, Some(TearCause::Cut)), TornConstraint::new(1, None));
    publish(1, 1, &[stretched]);
    publish(3, 2, &[stretched, cut, unknown]);

    let mut client = Client::attach(&domain.endpoint()).unwrap();
    // The client connects with its first reads; the owner notices it at the next refresh.
    assert!(client.torn(MOMENT).unwrap().constraints.is_empty());
    assert!(client.colliders(MOMENT).unwrap().colliders.is_empty());
    owner.refresh();
    let torn = client.torn(DEADLINE).unwrap();
    assert_eq!((torn.header.step, torn.header.new_count, torn.header.count), (3, 2, 3));
    assert_eq!(torn.constraints, [stretched, cut, unknown]);
    assert_eq!((cut.cause(), unknown.cause()), (Some(TearCause::Cut), None));
    assert_eq!(client.colliders(DEADLINE).unwrap().colliders, colliders(3));
    // A latched list can be read again, until a new list replaces it.
    assert_eq!(client.torn(MOMENT).unwrap(), torn);
    publish(4, 0, &[]);
    assert_eq!(client.torn(MOMENT).unwrap().header.step, 4);
    assert_eq!(client.colliders(MOMENT).unwrap().header.step, 4);
}

#[test]
fn a_late_client_reads_the_parameters_of_the_load_and_each_change() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(client.parameters(MOMENT).unwrap(), None);
    owner.refresh();
    let first = client.parameters(DEADLINE).unwrap().unwrap();
    assert_eq!((first.header.step, first.values), (0, parameters(0)));
    owner.publish_parameters(RUN_ID, 7, &parameters(7)).unwrap();
    let second = client.parameters(DEADLINE).unwrap().unwrap();
    assert_eq!((second.header.step, second.header.run_id), (7, RUN_ID));
    assert_eq!(second.values, parameters(7));
    assert_eq!(
        client.parameters(MOMENT).unwrap(),
        Some(second),
        "a latched message can be read again"
    );
}

#[test]
fn every_reader_receives_an_empty_list_of_tears_after_a_load() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    client.torn(MOMENT).unwrap();
    owner.refresh();
    let torn = client.torn(DEADLINE).unwrap();
    assert_eq!((torn.header.run_id, torn.constraints.len()), (RUN_ID, 0));
}

#[test]
fn a_reader_that_falls_behind_receives_the_newest_snapshots() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 0);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    // The client connects with its first read; the owner notices it at the next step.
    assert!(client.next_snapshot(MOMENT).unwrap().is_none());
    for step in 1..=200 {
        publish_step(&owner, step);
    }
    let oldest = client.next_snapshot(MOMENT).unwrap().unwrap().header().step;
    assert_eq!(oldest, 201 - sim_contract::SNAPSHOTS_BUFFERED as u64);
    assert_eq!(client.latest_snapshot(MOMENT).unwrap().unwrap().header().step, 200);
    assert!(client.latest_snapshot(MOMENT).unwrap().is_none());
}
