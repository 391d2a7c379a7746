//! Readers never delay the owner, and payloads of any length work. These tests count publications
//! and need no clock: an owner that waited would hang the test.

use sim_contract::testing::TestDomain;
use sim_contract::{
    BORROWED_SAMPLES_MAX, Client, CollidersHeader, KeyframeHeader, Load, LoadHeader, Owner,
    PublishError, READERS_MAX, ReadError, SnapshotHeader, Tap, TearsHeader,
};

use crate::support::{
    MOMENT, colliders, create_owner, load_header, publish_everything, publish_step,
};

#[test]
fn a_reader_that_never_reads_does_not_block_the_owner() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    for step in 0..10_000 {
        publish_everything(&owner, step);
    }
    let mut steps = Vec::new();
    while let Some(state) = tap.next_state(|_| {}) {
        steps.push(state.header.step);
    }
    assert_eq!(steps, (9936..10_000).collect::<Vec<_>>());
}

#[test]
fn the_most_readers_holding_the_most_snapshots_leave_memory_for_the_owner() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 0);
    let mut clients: Vec<_> =
        (0..READERS_MAX).map(|_| Client::attach(&domain.endpoint()).unwrap()).collect();
    for client in &mut clients {
        assert!(client.next_snapshot(MOMENT).unwrap().is_none());
    }
    // Each reader holds snapshots that no other reader holds, and then its buffer fills.
    let mut held = Vec::new();
    let mut step = 0;
    for client in &mut clients {
        for _ in 0..BORROWED_SAMPLES_MAX {
            step += 1;
            publish_step(&owner, step);
            held.push((step, client.latest_snapshot(MOMENT).unwrap().unwrap()));
        }
    }
    for _ in 0..1000 {
        step += 1;
        publish_step(&owner, step);
    }
    assert!(held.iter().all(|(step, snapshot)| snapshot.header().step == *step));
    let error = clients[0].next_snapshot(MOMENT).unwrap_err();
    assert!(matches!(error, ReadError::TooManyHeld { max: BORROWED_SAMPLES_MAX, .. }), "{error}");
    let error = Client::attach(&domain.endpoint()).unwrap().next_snapshot(MOMENT).unwrap_err();
    assert!(error.to_string().contains("already has all of its 16 readers"), "{error}");
}

#[test]
fn a_program_that_holds_all_but_one_of_its_snapshots_can_still_read_one() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert!(client.latest_snapshot(MOMENT).unwrap().is_none());
    owner.refresh();
    let mut held = Vec::new();
    for step in 1..BORROWED_SAMPLES_MAX as u64 {
        publish_step(&owner, step);
        held.push(client.latest_snapshot(MOMENT).unwrap().unwrap());
    }
    for step in 10..13 {
        publish_step(&owner, step);
    }
    assert_eq!(client.latest_snapshot(MOMENT).unwrap().unwrap().header().step, 10);
}

#[test]
fn an_empty_scene_works() {
    let domain = TestDomain::new();
    let empty =
        Load { header: LoadHeader { particle_count: 0, ..load_header() }, ..Load::default() };
    let owner = Owner::create(&domain.endpoint(), &empty).unwrap();
    let publish = || {
        owner.publish_particles(&SnapshotHeader::default(), |_| unreachable!()).unwrap();
        owner.publish_tears(TearsHeader::default(), &[]).unwrap();
        owner.publish_colliders(CollidersHeader::default(), &[]).unwrap();
        owner.publish_keyframe(KeyframeHeader::default(), &[]).unwrap();
        owner.refresh();
    };
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert!(client.bends(MOMENT).unwrap().is_none());
    assert!(client.surface(MOMENT).unwrap().is_none());
    assert!(client.topology(MOMENT).unwrap().is_none());
    assert!(client.scene(MOMENT).unwrap().is_none());
    assert!(client.next_snapshot(MOMENT).unwrap().is_none());
    publish();
    let bends = client.bends(MOMENT).unwrap().unwrap();
    assert_eq!((bends.header.count, bends.bends.len()), (0, 0));
    let surface = client.surface(MOMENT).unwrap().unwrap();
    assert_eq!((surface.header.count, surface.triangles.len()), (0, 0));
    assert!(client.topology(MOMENT).unwrap().unwrap().constraints.is_empty());
    assert_eq!(client.scene(MOMENT).unwrap().unwrap(), "");
    assert!(client.next_snapshot(MOMENT).unwrap().unwrap().particles().is_empty());
}

#[test]
fn a_message_longer_than_the_load_announced_is_an_error_with_both_lengths() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let error = owner.publish_keyframe(KeyframeHeader::default(), &[0; 17]).unwrap_err();
    assert!(matches!(error, PublishError::TooLong { len: 17, len_max: 16, .. }));
    assert_eq!(
        error.to_string(),
        "17 elements do not fit into a message of 'sim/keyframe', which the load limited to 16"
    );
    let three = [colliders(0)[0]; 3];
    let error = owner.publish_colliders(CollidersHeader::default(), &three).unwrap_err();
    assert!(matches!(error, PublishError::TooLong { len: 3, len_max: 2, .. }));
    let header = SnapshotHeader { particle_count: 5, ..SnapshotHeader::default() };
    assert!(owner.publish_particles(&header, |_| unreachable!()).is_err());
}
