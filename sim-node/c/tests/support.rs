//! A node of a test, and the calls that its C program makes.

use std::ffi::{CStr, CString, c_char};
use std::mem::MaybeUninit;
use std::ptr::null;

use catenary::*;
use sim_contract::testing::TestDomain;
use sim_contract::{
    BendState, ConstraintState, Load, LoadHeader, Owner, ParameterValues, ParticleState,
    SnapshotHeader, Triangle, Wake,
};

pub(crate) const RUN_ID: u64 = 77;
pub(crate) const TIMEOUT_S: f64 = 10.0;

pub(crate) const BEND: BendState = BendState {
    particles: [0, 1, 0, 1],
    coefficients: [1.0, -2.0, 1.0, 0.0],
    geometry: 0.5,
    rigidity: 0.25,
    rest: 0.0,
    shape: 0,
    block: -1,
};

pub(crate) fn owner(domain: &TestDomain) -> Owner {
    let load = Load {
        header: LoadHeader { run_id: RUN_ID, particle_count: 2, ..LoadHeader::default() },
        scene: b"version = 1",
        constraints: &[ConstraintState { b: 1, rest_length: 0.5, ..ConstraintState::default() }],
        bends: &[BEND],
        triangles: &[Triangle { corners: [0, 1, 1] }],
        collider_count: 1,
        keyframe_size_bytes_max: 3,
        parameters: ParameterValues::DEFAULT,
    };
    Owner::create(&domain.endpoint(), &load).unwrap()
}

pub(crate) fn publish(owner: &Owner, step: u64) {
    let header =
        SnapshotHeader { run_id: RUN_ID, step, particle_count: 2, ..SnapshotHeader::default() };
    let particle = |index| ParticleState {
        position: [step as f32, index as f32, 0.5],
        ..ParticleState::default()
    };
    owner.publish_particles(&header, particle).unwrap();
    owner.wake(Wake::Frame);
}

/// Attaches a client that the owner knows as a reader.
pub(crate) fn attach(domain: &TestDomain, owner: &Owner) -> *mut ClientHandle {
    let domain = CString::new(domain.name()).unwrap();
    let mut client = MaybeUninit::uninit();
    let result = catenary_attach(null(), domain.as_ptr(), Some(&mut client));
    assert_eq!(result, CatenaryResult::Ok, "{}", last_error());
    // SAFETY: the call has succeeded.
    let client = unsafe { client.assume_init() };
    let polled = catenary_next_snapshot(client, 0.0, Some(&mut MaybeUninit::uninit()));
    assert_eq!(polled, CatenaryResult::Timeout, "{}", last_error());
    owner.refresh();
    client
}

pub(crate) fn next_snapshot(client: *mut ClientHandle) -> Snapshot {
    let mut snapshot = MaybeUninit::uninit();
    let result = catenary_next_snapshot(client, TIMEOUT_S, Some(&mut snapshot));
    assert_eq!(result, CatenaryResult::Ok, "{}", last_error());
    // SAFETY: the call has succeeded.
    unsafe { snapshot.assume_init() }
}

pub(crate) fn text(pointer: *const c_char) -> String {
    // SAFETY: the functions of the library return texts that are never null.
    unsafe { CStr::from_ptr(pointer) }.to_str().unwrap().to_owned()
}

pub(crate) fn last_error() -> String {
    text(catenary_last_error())
}
