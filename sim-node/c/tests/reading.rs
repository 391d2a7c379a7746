//! Whatever a node publishes and answers reaches a C program byte for byte.

use std::ffi::{CStr, c_char};
use std::mem::MaybeUninit;
use std::{slice, thread};

use crate::support::*;
use catenary::*;
use sim_contract::testing::TestDomain;
use sim_contract::{
    ColliderState, CollidersHeader, ConstraintState, ForceKind, ForceRow, ForcesHeader, NodeStatus,
    Outcome, Owner, Parameter, ParameterValues, ParticleState, SnapshotHeader, TearsHeader,
    TornConstraint, Triangle, Wake,
};

/// A function of the library that reads.
type Read<T> = extern "C" fn(*mut ClientHandle, f64, Option<&mut MaybeUninit<T>>) -> CatenaryResult;

/// Reads with a function of the library. The owner learns of each new reader, and sends what it lacks.
fn read<T>(owner: &Owner, client: *mut ClientHandle, function: Read<T>) -> T {
    let mut place = MaybeUninit::uninit();
    for _ in 0..100 {
        match function(client, 0.1, Some(&mut place)) {
            // SAFETY: the call has succeeded.
            CatenaryResult::Ok => return unsafe { place.assume_init() },
            CatenaryResult::Timeout => owner.refresh(),
            other => panic!("{other:?}: {}", last_error()),
        }
    }
    panic!("nothing arrives: {}", last_error())
}

/// Copies a list that the library lends.
fn list<T: Copy>(first: *const T, count: usize) -> Vec<T> {
    // SAFETY: the list is valid until the next call of its function.
    unsafe { slice::from_raw_parts(first, count) }.to_vec()
}

#[test]
fn every_list_arrives() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    publish(&owner, 3);
    let torn = [TornConstraint { constraint: 0, ..TornConstraint::default() }];
    let header = TearsHeader { run_id: RUN_ID, step: 3, ..TearsHeader::default() };
    owner.publish_tears(header, &torn).unwrap();
    let values = ParameterValues::DEFAULT.with(Parameter::Damping, 0.25);
    owner.publish_parameters(RUN_ID, 2, &values).unwrap();
    let colliders = [ColliderState { friction: 0.5, ..ColliderState::default() }];
    let header = CollidersHeader { run_id: RUN_ID, step: 3, ..CollidersHeader::default() };
    owner.publish_colliders(header, &colliders).unwrap();
    let status = NodeStatus { run_id: RUN_ID, step: 3, ..NodeStatus::default() };
    owner.publish_status(&status).unwrap();
    let client = attach(&domain, &owner);

    let topology = read(&owner, client, catenary_read_topology);
    let expected = [ConstraintState { b: 1, rest_length: 0.5, ..ConstraintState::default() }];
    assert_eq!(list(topology.constraints, topology.constraint_count), expected);
    assert_eq!((topology.header.run_id, topology.header.particle_count), (RUN_ID, 2));
    let bends = read(&owner, client, catenary_read_bends);
    assert_eq!(list(bends.bends, bends.bend_count), [BEND]);
    assert_eq!(bends.header.particle_count, 2);
    let surface = read(&owner, client, catenary_read_surface);
    assert_eq!(list(surface.triangles, surface.triangle_count), [Triangle { corners: [0, 1, 1] }]);
    let read_torn = read(&owner, client, catenary_read_torn);
    assert_eq!(list(read_torn.constraints, read_torn.constraint_count), torn);
    assert_eq!(read_torn.header.step, 3);
    let parameters = read(&owner, client, catenary_read_parameters);
    let names = (0_u32..).map(|index| text(catenary_parameter_name(index)));
    let damping = names.take(parameters.value_count).position(|name| name == "damping").unwrap();
    let states = list(parameters.values, parameters.value_count);
    assert_eq!(states[damping].value[0].to_bits(), 0.25_f32.to_bits());
    let read_colliders = read(&owner, client, catenary_read_colliders);
    assert_eq!(list(read_colliders.colliders, read_colliders.collider_count), colliders);
    assert_eq!(read(&owner, client, catenary_read_status), status);
    let scene: *const c_char = read(&owner, client, catenary_read_scene);
    // SAFETY: the text is valid until the next call of its function.
    assert_eq!(unsafe { CStr::from_ptr(scene) }, c"version = 1");
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
}

const COLLIDER: ForceRow = ForceRow {
    kind: ForceKind::Collider as u32,
    index: 0,
    impulse: [0.0, -0.25, 0.5],
    angular_impulse: [1.0, 2.0, 3.0],
    contacts: 4,
    spare: 0,
};

/// Publishes the forces of a step, and then its snapshot. Returns the rows.
fn publish_forces(owner: &Owner, step: u64) -> Vec<ForceRow> {
    let pull = [0.0, step as f32, 0.0];
    let other =
        |kind, index| ForceRow { kind: kind as u32, index, impulse: pull, ..ForceRow::default() };
    let rows = vec![COLLIDER, other(ForceKind::Anchor, 0), other(ForceKind::Particle, 1)];
    let header = ForcesHeader { run_id: RUN_ID, step, rate_hz: 240, count: 0 };
    owner.publish_forces(header, &rows).unwrap();
    publish(owner, step);
    rows
}

/// Reads the forces of a step, at once.
fn read_of_step(client: *mut ClientHandle, step: u64) -> Result<Forces, CatenaryResult> {
    let snapshot = SnapshotHeader { run_id: RUN_ID, step, ..SnapshotHeader::default() };
    let mut forces = MaybeUninit::uninit();
    let result = catenary_read_forces_of(client, Some(&snapshot), 0.0, Some(&mut forces));
    // SAFETY: a call that succeeds writes them.
    (result == CatenaryResult::Ok).then(|| unsafe { forces.assume_init() }).ok_or(result)
}

#[test]
fn the_newest_forces_and_those_of_a_snapshot_arrive_from_the_first_call_on() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    let client = attach(&domain, &owner);
    assert_eq!(owner.forces_reader_count(), 0, "a client that reads none costs the node nothing");
    let none = catenary_read_forces(client, 0.0, Some(&mut MaybeUninit::uninit()));
    assert_eq!(none, CatenaryResult::Timeout);
    assert_eq!(owner.forces_reader_count(), 1);
    owner.refresh();
    let published: Vec<_> = (1..=3).map(|step| publish_forces(&owner, step)).collect();

    let of_step = read_of_step(client, 2).unwrap();
    assert_eq!(list(of_step.rows, of_step.row_count), published[1]);
    let expected = ForcesHeader { run_id: RUN_ID, step: 2, count: 3, rate_hz: 240 };
    assert_eq!(of_step.header, expected);
    assert_eq!(read_of_step(client, 1).unwrap_err(), CatenaryResult::Timeout);
    assert!(last_error().starts_with("no forces of step 1: "), "{}", last_error());
    let newest = read(&owner, client, catenary_read_forces);
    assert_eq!(newest.header.step, 3);
    assert_eq!(list(newest.rows, newest.row_count), published[2]);
    assert_eq!(list(of_step.rows, of_step.row_count), published[1], "each function lends its own");

    let wrong = catenary_read_forces_of(client, None, 0.0, Some(&mut MaybeUninit::uninit()));
    assert_eq!(wrong, CatenaryResult::Misuse);
    assert!(last_error().contains("snapshot is null"), "{}", last_error());
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
    assert_eq!(owner.forces_reader_count(), 0);
}

#[test]
fn a_state_arrives_with_its_keyframe_and_is_answered() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    let client = attach(&domain, &owner);
    let particles =
        [1.0, 2.0].map(|x| ParticleState { position: [x, 0.0, 0.5], ..ParticleState::default() });
    let asker = thread::scope(|threads| {
        let address = client.addr();
        let asker = threads.spawn(move || {
            let client = std::ptr::without_provenance_mut(address);
            let state = StateToRestore {
                scene_hash: 42,
                particles: particles.as_ptr(),
                particle_count: particles.len(),
                keyframe: [7_u8, 8, 9].as_ptr(),
                keyframe_size_bytes: 3,
            };
            let mut outcome = MaybeUninit::<Outcome>::zeroed();
            let result = catenary_restore(client, Some(&state), TIMEOUT_S, Some(&mut outcome));
            // SAFETY: an outcome may be zero.
            (result, last_error(), unsafe { outcome.assume_init() })
        });
        let mut states = Vec::new();
        while states.is_empty() {
            owner.refresh();
            owner.receive_states(&mut states);
            thread::yield_now();
        }
        let (command, state) = &states[0];
        let state = state.as_ref().unwrap();
        assert_eq!((state.scene_hash, state.particles.as_slice()), (42, &particles[..]));
        assert_eq!(state.keyframe.as_deref(), Some(&[7, 8, 9][..]));
        let outcome = Outcome::new(0, 9, command.command, Ok(()));
        owner.publish_outcome(&outcome).unwrap();
        owner.wake(Wake::Outcome);
        asker.join().unwrap()
    });
    let (result, error, outcome) = asker;
    assert_eq!((result, outcome.step), (CatenaryResult::Ok, 9), "{error}");
    assert_eq!(catenary_restore(client, None, 0.0, None), CatenaryResult::Misuse);
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
}
