//! Mistakes of a C program are results and never end the process; what it holds stays valid.

use std::ffi::CString;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};
use std::{slice, thread};

use crate::support::*;
use catenary::*;
use sim_contract::testing::TestDomain;
use sim_contract::{Command, Outcome, Owner, Reason, Wake};
use sim_host::clock::{SECOND_NS, monotonic_ns};

fn assert_misuse(result: CatenaryResult, part: &str) {
    assert_eq!(result, CatenaryResult::Misuse);
    assert!(last_error().contains(part), "{}", last_error());
}

#[test]
fn a_snapshot_outlives_its_client_and_is_released_once() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    publish(&owner, 3);
    let client = attach(&domain, &owner);
    let mut snapshot = next_snapshot(client);
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
    drop(owner);
    // SAFETY: the snapshot is held.
    let particles = unsafe { slice::from_raw_parts(snapshot.particles, snapshot.particle_count) };
    assert_eq!(
        particles.iter().map(|one| one.position).collect::<Vec<_>>(),
        [[3.0, 0.0, 0.5], [3.0, 1.0, 0.5]]
    );
    // SAFETY: the snapshot is held.
    assert_eq!(unsafe { (*snapshot.header).step }, 3);

    let mut copy = Snapshot { ..snapshot };
    assert_eq!(catenary_release_snapshot(Some(&mut snapshot)), CatenaryResult::Ok);
    assert!(snapshot.header.is_null() && snapshot.particles.is_null());
    assert_eq!((snapshot.particle_count, snapshot.handle), (0, 0));
    assert_misuse(catenary_release_snapshot(Some(&mut snapshot)), "released before");
    assert_misuse(catenary_release_snapshot(Some(&mut copy)), "released before");
    assert_misuse(catenary_release_snapshot(None), "snapshot is null");
}

#[test]
fn every_call_of_a_detached_client_is_refused() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    publish(&owner, 0);
    let client = attach(&domain, &owner);
    let snapshot = next_snapshot(client);
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
    // A snapshot is no client either.
    let other = std::ptr::without_provenance_mut(snapshot.handle);
    for client in [client, null_mut(), other] {
        let command = catenary_command_pin(0);
        for result in [
            catenary_detach(client),
            catenary_client_id(client, None),
            catenary_check_node(client),
            catenary_next_snapshot(client, 0.0, None),
            catenary_latest_snapshot(client, 0.0, None),
            catenary_read_topology(client, 0.0, None),
            catenary_read_bends(client, 0.0, None),
            catenary_read_surface(client, 0.0, None),
            catenary_read_torn(client, 0.0, None),
            catenary_read_parameters(client, 0.0, None),
            catenary_read_colliders(client, 0.0, None),
            catenary_read_forces(client, 0.0, None),
            catenary_read_forces_of(client, None, 0.0, None),
            catenary_read_scene(client, 0.0, None),
            catenary_read_status(client, 0.0, None),
            catenary_request(client, command, 0.0, None),
            catenary_send(client, command, None),
            catenary_next_outcome(client, 0.0, None),
            catenary_restore(client, None, 0.0, None),
            catenary_join_lockstep(client, 1, 0.0),
            catenary_next_turn(client, 0.0, None),
            catenary_ready(client),
            catenary_missed_turns(client, None),
            catenary_leave_lockstep(client),
        ] {
            assert_misuse(result, "this is no client");
        }
    }
}

#[test]
fn wrong_arguments_are_refused_with_their_names() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    publish(&owner, 0);
    let client = attach(&domain, &owner);
    assert_misuse(catenary_attach(null(), null(), None), "client is null");
    assert_misuse(
        catenary_attach(c"a b".as_ptr(), null(), Some(&mut MaybeUninit::uninit())),
        "'a b' is not a valid name",
    );
    assert_misuse(
        catenary_attach(c"\xff".as_ptr(), null(), Some(&mut MaybeUninit::uninit())),
        "name is not UTF-8",
    );
    assert_misuse(catenary_next_snapshot(client, 1.0, None), "snapshot is null");
    for timeout_s in [-1.0, f64::NAN, f64::INFINITY] {
        assert_misuse(
            catenary_next_snapshot(client, timeout_s, Some(&mut MaybeUninit::uninit())),
            "is no timeout",
        );
    }
    assert_misuse(catenary_join_lockstep(client, 0, 1.0), "every is 0");
    assert_misuse(catenary_ready(client), "call join_lockstep first");
    assert_misuse(catenary_missed_turns(client, None), "count is null");
    let long = CString::new("x".repeat(161)).unwrap();
    for command in [
        Command::default(),
        catenary_command_grab(0, null(), 0.1),
        catenary_command_load(null()),
        catenary_command_mark(long.as_ptr()),
        catenary_command_set_vector(c"gravity".as_ptr(), null()),
    ] {
        assert_misuse(catenary_send(client, command, None), "the command is empty");
    }
    let held: Vec<_> = (1..=4)
        .map(|step| {
            publish(&owner, step);
            next_snapshot(client)
        })
        .collect();
    publish(&owner, 5);
    let mut fifth = MaybeUninit::uninit();
    let result = catenary_next_snapshot(client, 1.0, Some(&mut fifth));
    assert_misuse(result, "4 messages of 'sim/particles' are already held");
    // SAFETY: a failed call writes a snapshot without a handle.
    let mut fifth = unsafe { fifth.assume_init() };
    assert_misuse(catenary_release_snapshot(Some(&mut fifth)), "released before");
    for mut snapshot in held {
        assert_eq!(catenary_release_snapshot(Some(&mut snapshot)), CatenaryResult::Ok);
    }
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
}

#[test]
fn a_client_in_a_call_of_another_thread_is_refused() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    publish(&owner, 0);
    let client = attach(&domain, &owner);
    let mut first = next_snapshot(client);
    assert_eq!(catenary_release_snapshot(Some(&mut first)), CatenaryResult::Ok);
    let address = client.addr();
    let waiter = thread::spawn(move || {
        let client = std::ptr::without_provenance_mut(address);
        let mut snapshot = MaybeUninit::uninit();
        // The main thread may be in a call.
        while catenary_next_snapshot(client, TIMEOUT_S, Some(&mut snapshot))
            == CatenaryResult::Misuse
        {
            thread::yield_now();
        }
        // SAFETY: every call writes it.
        let mut snapshot = unsafe { snapshot.assume_init() };
        assert_eq!(catenary_release_snapshot(Some(&mut snapshot)), CatenaryResult::Ok);
    });
    // The other thread waits for the next snapshot, sooner or later.
    while catenary_client_id(client, Some(&mut MaybeUninit::uninit())) == CatenaryResult::Ok {
        assert!(!waiter.is_finished(), "it has received nothing yet");
        thread::yield_now();
    }
    assert!(last_error().contains("another thread is in a call"), "{}", last_error());
    publish(&owner, 1);
    waiter.join().unwrap();
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
}

#[test]
fn the_end_of_a_node_and_silence_are_two_results() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    publish(&owner, 0);
    let client = attach(&domain, &owner);
    let mut snapshot = next_snapshot(client);
    assert_eq!(catenary_release_snapshot(Some(&mut snapshot)), CatenaryResult::Ok);
    let next =
        |timeout_s| catenary_next_snapshot(client, timeout_s, Some(&mut MaybeUninit::uninit()));
    assert_eq!(next(0.0), CatenaryResult::Timeout);
    assert_eq!(next(0.15), CatenaryResult::Timeout);
    assert_eq!(catenary_check_node(client), CatenaryResult::Ok);
    drop(owner);
    assert_eq!(next(TIMEOUT_S), CatenaryResult::Gone);
    assert_eq!(catenary_check_node(client), CatenaryResult::Gone);
    let begin_ns = monotonic_ns();
    while next(0.0) != CatenaryResult::Gone {
        assert!(monotonic_ns() - begin_ns < 10 * SECOND_NS, "a program that polls never learns it");
        thread::yield_now();
    }
    assert_eq!(catenary_send(client, catenary_command_pause(), None), CatenaryResult::NotSent);
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
}

/// Sends a command that the node rejects at step 5. Returns the text of the error, and the outcome.
fn rejection(
    owner: &Owner,
    client: *mut ClientHandle,
    command: Command,
    reason: Reason,
) -> (String, Outcome) {
    let address = client.addr();
    let asker = thread::spawn(move || {
        let client = std::ptr::without_provenance_mut(address);
        let mut outcome = MaybeUninit::<Outcome>::zeroed();
        let result = catenary_request(client, command, TIMEOUT_S, Some(&mut outcome));
        assert_eq!(result, CatenaryResult::Rejected);
        // SAFETY: an outcome may be zero, and was written.
        (last_error(), unsafe { outcome.assume_init() })
    });
    let mut received = Vec::new();
    while received.is_empty() {
        owner.refresh();
        owner.receive_commands(&mut received);
        thread::yield_now();
    }
    owner.publish_outcome(&Outcome::new(0, 5, received[0].command, Err(reason))).unwrap();
    owner.wake(Wake::Outcome);
    while !asker.is_finished() {
        owner.refresh();
        thread::yield_now();
    }
    asker.join().unwrap()
}

#[test]
fn a_rejection_is_a_result_with_its_reason() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    let client = attach(&domain, &owner);
    let release = catenary_command_release(1);
    let (error, answer) = rejection(&owner, client, release, Reason::NotGrabbed);
    assert_eq!(error, "rejected at step 5: not_grabbed: the particle is not grabbed");
    assert_eq!((answer.step, answer.reason), (5, Reason::NotGrabbed as u32));
    assert_eq!(text(catenary_reason_name(answer.reason)), "not_grabbed");
    assert_eq!(text(catenary_reason_name(99)), "unknown");
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
}

#[test]
fn a_rejection_names_the_allowed_values_and_indices() {
    let domain = TestDomain::new();
    let owner = owner(&domain);
    let client = attach(&domain, &owner);
    let text = |command, reason| rejection(&owner, client, command, reason).0;
    let set = catenary_command_set(c"tear_force".as_ptr(), -1.0);
    assert_eq!(
        text(set, Reason::OutOfRange),
        "rejected at step 5: out_of_range: a value is out of its range (allowed: a number > 0, or off for no limit)"
    );
    let particle = text(catenary_command_pin(9999), Reason::UnknownParticle);
    assert!(particle.ends_with("the scene has no such particle (allowed: 0 to 1)"), "{particle}");
    let constraint = text(catenary_command_cut(9999), Reason::UnknownConstraint);
    assert!(constraint.ends_with("(allowed: 0)"), "{constraint}");
    let scene = text(catenary_command_load(c"nosuch".as_ptr()), Reason::OutOfRange);
    assert!(
        scene.ends_with("(allowed: a scene that the node can read; see its messages)"),
        "{scene}"
    );
    assert_eq!(catenary_detach(client), CatenaryResult::Ok);
}
