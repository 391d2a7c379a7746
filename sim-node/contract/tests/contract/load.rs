//! Loading another scene under the same name: connected readers continue with it, late readers
//! receive nothing else, and a failed load leaves the old one as it was.

use sim_contract::testing::TestDomain;
use sim_contract::{
    BendState, COLLIDERS_MAX, Client, ColliderShape, ColliderState, CollidersHeader,
    ConstraintState, KeyframeHeader, Load, LoadHeader, Owner, ParameterValues, ParticleState,
    SnapshotHeader, Tap, TearCause, TearsHeader, TornConstraint, Triangle, Update, Wake,
};

use crate::support::{
    DEADLINE, MOMENT, RUN_ID, SCENE, colliders, constraints, create_owner, load_header,
    publish_everything, publish_step, snapshot_header,
};

const NEW_SCENE: &str = "version = 1 # another scene, with a longer text";
const NEW_COUNT: u32 = 9;

/// Passes a larger scene, with first step 6, to `receive`.
fn with_new_load(receive: impl FnOnce(&Load<'_>)) {
    let constraint =
        |a: u32| ConstraintState { a, b: a + 1, rest_length: 0.2, ..Default::default() };
    let constraints: Vec<_> = (0..NEW_COUNT - 1).map(constraint).collect();
    let header =
        LoadHeader { step: 6, particle_count: NEW_COUNT, topology_revision: 2, ..load_header() };
    receive(&Load {
        header,
        scene: NEW_SCENE.as_bytes(),
        constraints: &constraints,
        bends: &[BendState::default(); 4],
        triangles: &[Triangle { corners: [6, 7, 8] }; 3],
        collider_count: 3,
        keyframe_size_bytes_max: 64,
        parameters: ParameterValues::default(),
    });
}

fn load(owner: &mut Owner) {
    with_new_load(|load| owner.load(load).unwrap());
}

/// Publishes a step of the new scene with all its messages.
fn publish_new_step(owner: &Owner, step: u64) {
    let header = CollidersHeader { run_id: RUN_ID, step, ..CollidersHeader::default() };
    owner.publish_colliders(header, &[sphere(); 3]).unwrap();
    let tears =
        TearsHeader { run_id: RUN_ID, step, since_step: 6, new_count: 1, ..TearsHeader::default() };
    owner.publish_tears(tears, &[TornConstraint::new(7, Some(TearCause::Force))]).unwrap();
    let keyframe = KeyframeHeader { run_id: RUN_ID, step, ..KeyframeHeader::default() };
    owner.publish_keyframe(keyframe, b"a keyframe longer than any of the old load").unwrap();
    publish_new_particles(owner, step);
}

fn publish_new_particles(owner: &Owner, step: u64) {
    let header = SnapshotHeader {
        particle_count: NEW_COUNT,
        topology_revision: 2,
        torn_count: 1,
        ..snapshot_header(step)
    };
    owner.publish_particles(&header, |_| ParticleState::default()).unwrap();
    owner.wake(Wake::Frame);
    owner.refresh();
}

fn sphere() -> ColliderState {
    ColliderState { shape: ColliderShape::Sphere as u32, radius: 2.0, ..ColliderState::default() }
}

/// Connects a client to all services, and lets the owner notice it.
fn connect(client: &mut Client, owner: &Owner) {
    client.topology(MOMENT).unwrap();
    client.bends(MOMENT).unwrap();
    client.surface(MOMENT).unwrap();
    client.scene(MOMENT).unwrap();
    client.torn(MOMENT).unwrap();
    client.parameters(MOMENT).unwrap();
    client.colliders(MOMENT).unwrap();
    client.latest_snapshot(MOMENT).unwrap();
    owner.refresh();
}

fn assert_reads_new_load(client: &mut Client) {
    let topology = client.topology(DEADLINE).unwrap().unwrap();
    assert_eq!((topology.header.topology_revision, topology.constraints.len()), (2, 8));
    assert_eq!(client.bends(DEADLINE).unwrap().unwrap().bends.len(), 4);
    assert_eq!(client.surface(DEADLINE).unwrap().unwrap().triangles.len(), 3);
    assert_eq!(client.scene(DEADLINE).unwrap().unwrap(), NEW_SCENE);
    let snapshot = client.latest_snapshot(DEADLINE).unwrap().unwrap();
    assert_eq!((snapshot.header().step, snapshot.particles().len()), (6, 9));
    let torn = client.torn(DEADLINE).unwrap().constraints;
    assert_eq!((torn[0], torn.len()), (TornConstraint::new(7, Some(TearCause::Force)), 1));
    assert_eq!(client.colliders(DEADLINE).unwrap().colliders, [sphere(); 3]);
}

#[test]
fn a_connected_client_continues_with_the_new_load() {
    let domain = TestDomain::new();
    let mut owner = create_owner(&domain.endpoint()).unwrap();
    publish_everything(&owner, 5);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    connect(&mut client, &owner);
    assert_eq!(client.scene(DEADLINE).unwrap().unwrap(), SCENE);
    assert_eq!(client.torn(DEADLINE).unwrap().constraints.len(), 1);
    assert_eq!(client.colliders(DEADLINE).unwrap().colliders, colliders(5));
    let held = client.latest_snapshot(DEADLINE).unwrap().unwrap();

    load(&mut owner);
    // The load publishes an empty list of tears and its own parameters.
    assert!(client.torn(DEADLINE).unwrap().constraints.is_empty());
    let parameters = client.parameters(DEADLINE).unwrap().unwrap();
    assert_eq!((parameters.header.step, parameters.values), (6, ParameterValues::default()));
    publish_new_step(&owner, 6);
    assert_reads_new_load(&mut client);
    // Snapshots of the old load stay readable.
    assert_eq!((held.header().step, held.particles().len()), (5, 4));
}

#[test]
fn a_reader_receives_unread_messages_of_the_old_load_before_the_new_one() {
    let domain = TestDomain::new();
    let mut owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    connect(&mut client, &owner);
    for step in 1..=5 {
        publish_everything(&owner, step);
    }
    load(&mut owner);
    publish_new_step(&owner, 6);
    for step in 1..=6 {
        assert_eq!(client.next_snapshot(DEADLINE).unwrap().unwrap().header().step, step);
    }
    // The newest waiting message belongs to the new load, even behind a full buffer.
    assert_eq!(client.colliders(DEADLINE).unwrap().header.step, 6);
    assert_eq!(client.torn(DEADLINE).unwrap().header.step, 6);
    publish_new_particles(&owner, 7);
    assert_eq!(client.next_snapshot(DEADLINE).unwrap().unwrap().header().step, 7);
}

#[test]
fn a_tap_sees_both_loads_in_their_order() {
    let domain = TestDomain::new();
    let mut owner = create_owner(&domain.endpoint()).unwrap();
    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    publish_everything(&owner, 5);
    load(&mut owner);
    publish_new_step(&owner, 6);
    let indices = |list: &[TornConstraint]| list.iter().map(|torn| torn.constraint).collect();
    let mut tears: Vec<(u64, Vec<u32>)> = Vec::new();
    let first = tap.next_state(|message| {
        if let Update::Tears(header, list) = message {
            tears.push((header.step, indices(list)));
        }
    });
    let first = first.unwrap();
    assert_eq!((first.header.step, first.particles.len()), (5, 4));
    assert_eq!(
        (first.load.scene.as_slice(), first.torn.constraints[0].constraint),
        (SCENE.as_bytes(), 2)
    );
    // Each load begins with an empty list.
    assert_eq!(tears, [(0, vec![]), (5, vec![2]), (6, vec![]), (6, vec![7])]);
    let second = tap.next_state(|_| {}).unwrap();
    assert_eq!((second.header.step, second.particles.len()), (6, 9));
    assert_eq!(
        (second.load.scene.as_slice(), second.torn.constraints[0].constraint),
        (NEW_SCENE.as_bytes(), 7)
    );
    assert!(tap.next_state(|_| {}).is_none() && tap.drain_errors().is_empty());
}

#[test]
fn a_late_reader_receives_nothing_of_the_old_load() {
    let domain = TestDomain::new();
    let mut owner = create_owner(&domain.endpoint()).unwrap();
    publish_everything(&owner, 5);
    load(&mut owner);
    let mut early = Tap::attach(&domain.endpoint()).unwrap();
    owner.refresh();
    // Before its first step, the new load has a scene, and no message of the old load is left.
    let mut kinds = Vec::new();
    let state = early.next_state(|message| {
        kinds.push(match *message {
            Update::Scene(_, text) if text == NEW_SCENE.as_bytes() => "scene",
            Update::Topology(header, _) if header.topology_revision == 2 => "topology",
            Update::Bends(header, _) if header.topology_revision == 2 => "bends",
            Update::Surface(header, _) if header.topology_revision == 2 => "surface",
            Update::Tears(_, []) => "tears",
            Update::Parameters(_, values) if *values == ParameterValues::default() => "parameters",
            Update::Status(_) => "status",
            update => panic!("{update:?}"),
        });
    });
    assert!(state.is_none());
    assert_eq!(kinds, ["scene", "topology", "bends", "surface", "tears", "parameters", "status"]);

    publish_new_step(&owner, 6);
    let mut late = Client::attach(&domain.endpoint()).unwrap();
    connect(&mut late, &owner);
    assert_reads_new_load(&mut late);
}

#[test]
fn a_scene_can_be_loaded_many_times_beside_a_reader_that_never_reads() {
    let domain = TestDomain::new();
    let mut owner = create_owner(&domain.endpoint()).unwrap();
    let _idle = Tap::attach(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    connect(&mut client, &owner);
    // More loads than a reader can keep buffers of dropped writers.
    for _ in 0..200 {
        load(&mut owner);
        publish_new_step(&owner, 6);
    }
    assert_reads_new_load(&mut client);
}

#[test]
fn a_load_beyond_a_limit_leaves_the_old_one_as_it_was() {
    let domain = TestDomain::new();
    let mut owner = create_owner(&domain.endpoint()).unwrap();
    publish_everything(&owner, 5);
    with_new_load(|load| {
        let error =
            owner.load(&Load { collider_count: COLLIDERS_MAX + 1, ..load.clone() }).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the scene has 65537 colliders, but at most 65536 are possible: choose a smaller scene"
        );
    });
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    connect(&mut client, &owner);
    assert_eq!(client.topology(DEADLINE).unwrap().unwrap().constraints, constraints());
    assert_eq!(client.torn(DEADLINE).unwrap().constraints.len(), 1);
    publish_step(&owner, 6);
    assert_eq!(client.latest_snapshot(DEADLINE).unwrap().unwrap().header().step, 6);
}

fn with_colliders(collider_count: usize) -> Load<'static> {
    Load {
        header: LoadHeader::default(),
        scene: b"version = 1",
        constraints: &[],
        bends: &[],
        triangles: &[],
        collider_count,
        keyframe_size_bytes_max: 0,
        parameters: ParameterValues::default(),
    }
}

#[test]
fn lists_of_colliders_are_numbered_over_loads_with_and_without_colliders() {
    let domain = TestDomain::new();
    let mut owner = Owner::create(&domain.endpoint(), &with_colliders(0)).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let index = |client: &mut Client, owner: &Owner| {
        client.colliders(MOMENT).unwrap();
        owner.refresh();
        client.colliders(DEADLINE).unwrap().header.list_index
    };
    assert_eq!(index(&mut client, &owner), 0);
    owner.load(&with_colliders(1)).unwrap();
    for expected in [1, 2] {
        let header = CollidersHeader::default();
        owner.publish_colliders(header, &[ColliderState::default()]).unwrap();
        assert_eq!(index(&mut client, &owner), expected);
    }
    owner.load(&with_colliders(0)).unwrap();
    assert_eq!(index(&mut client, &owner), 3);
    let header = CollidersHeader { run_id: 7, ..CollidersHeader::default() };
    owner.publish_colliders(header, &[]).unwrap();
    assert_eq!(index(&mut client, &owner), 0, "another run");
}
