//! A replay publishes what was recorded: headers and payloads are compared in shared memory.

use std::time::Duration;

use recorder::{Frame, Message, OutcomeRow, RunDescription, StepRow, SurfaceRow, TopologyRow};
use sim_contract::testing::TestDomain;
use sim_contract::{
    Action, CONTRACT_VERSION, Client, Command, ConstraintState, LoadHeader, Outcome, OutcomeStatus,
    Owner, ParticleState, Reason, SnapshotFlags, SnapshotHeader, Triangle,
};

use super::position::Position;
use super::replay::{Recorded, Replay};

/// Long enough on any machine.
const TIMEOUT: Duration = Duration::from_secs(10);

fn run() -> RunDescription {
    RunDescription {
        run_id: 5,
        epoch_ns: 1_000,
        scene_name: "dot".to_owned(),
        origin: [0.5, 0.0, 0.0],
        rate_hz: 240,
        method: 0,
        particle_count: 2,
        constraint_count: 1,
        solver_version: 3,
        contract_version: CONTRACT_VERSION,
        recorder_version: "0".to_owned(),
    }
}

fn outcome(index: u64, step: u64, action: Action) -> Message {
    let outcome = Outcome::new(index, step, Command::new(9, index, action), Ok(()));
    Message::Outcome(OutcomeRow::from(&outcome))
}

fn frame(step: u64, updates: Vec<Message>) -> Frame {
    let row = StepRow {
        step,
        scene_step: step + 1,
        state_hash: 99,
        topology_revision: 0,
        torn_count: 0,
        outcome_count: 4,
        wake_late_ns: 6,
        solve_ns: 7,
    };
    let particle = ParticleState { position: [-0.0, step as f32, 0.0], ..Default::default() };
    Frame { updates, row, particles: vec![particle; 2] }
}

fn replay(domain: &TestDomain) -> Replay {
    let load = LoadHeader::default();
    let recorded = Recorded {
        run: &run(),
        scene: b"version = 1",
        topology: &TopologyRow::new(&load, &[ConstraintState { b: 1, ..Default::default() }]),
        surface: &SurfaceRow::new(&load, &[Triangle { corners: [0, 1, 0] }]),
        collider_count: 1,
        keyframe_size_bytes_max: 64,
    };
    Replay::new(&domain.endpoint(), &recorded, Position::default(), 1.0).unwrap()
}

/// A client that reads snapshots from now on: the first look takes the place of a reader.
fn reader(domain: &TestDomain) -> Client {
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert!(client.next_snapshot(Duration::ZERO).unwrap().is_none());
    client
}

fn next_header(client: &mut Client) -> (SnapshotHeader, Vec<ParticleState>) {
    let snapshot = client.next_snapshot(TIMEOUT).unwrap().unwrap();
    (*snapshot.header(), snapshot.particles().to_vec())
}

#[test]
fn snapshots_are_those_of_the_node_but_for_run_time_and_flag() {
    let domain = TestDomain::new();
    let mut replay = replay(&domain);
    let mut client = reader(&domain);
    let keyframe = Message::Keyframe { step: 12, bytes: vec![1, 2, 3] };
    replay.publish(&frame(12, vec![keyframe])).unwrap();
    let (header, particles) = next_header(&mut client);
    let expected = SnapshotHeader {
        contract_version: CONTRACT_VERSION,
        solver_version: 3,
        run_id: header.run_id,
        step: 12,
        scene_step: 13,
        keyframe_step: 12,
        sim_time_ns: 50_000_000,
        publish_monotonic_ns: header.publish_monotonic_ns,
        state_hash: 99,
        outcome_count: 4,
        wake_late_ns: 6,
        solve_ns: 7,
        topology_revision: 0,
        torn_count: 0,
        particle_count: 2,
        flags: SnapshotFlags::REPLAY,
    };
    assert_eq!(header, expected);
    assert_ne!(header.run_id, run().run_id);
    assert_eq!(particles, frame(12, Vec::new()).particles);
    assert!(client.topology(Duration::ZERO).unwrap().is_none());
    replay.answer_commands(13).unwrap();
    assert_eq!(client.topology(TIMEOUT).unwrap().unwrap().constraints.len(), 1);
}

#[test]
fn the_paused_flag_follows_the_recorded_outcomes() {
    let domain = TestDomain::new();
    let mut replay = replay(&domain);
    let mut client = reader(&domain);
    let pause = outcome(2, 6, Action::Pause);
    let resume = outcome(3, 8, Action::Resume);
    let frames = [
        (frame(5, Vec::new()), false),
        (frame(6, vec![pause]), true),
        (frame(7, Vec::new()), true),
        (frame(8, vec![resume]), false),
    ];
    for (frame, is_paused) in frames {
        replay.publish(&frame).unwrap();
        let (header, _) = next_header(&mut client);
        assert_eq!(header.flags & SnapshotFlags::PAUSED != 0, is_paused, "step {}", header.step);
    }
}

#[test]
fn commands_are_answered_beside_the_recorded_run() {
    let domain = TestDomain::new();
    let mut replay = replay(&domain);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let mut ask = |action| {
        client.send(action).unwrap();
        replay.answer_commands(42).unwrap();
        client.next_outcome(TIMEOUT).unwrap().unwrap()
    };
    let paused = ask(Action::Pause);
    assert_eq!((paused.step, paused.status), (42, OutcomeStatus::Applied as u32));
    assert_eq!(paused.flags, sim_contract::OUTCOME_FLAG_CONTROL);
    let refused = ask(Action::Pin { particle: 0 });
    assert_eq!(refused.reason, Reason::NoEffectHere as u32);
    assert!(!replay.control.is_moving());
}

#[test]
fn a_name_that_is_taken_is_refused() {
    let domain = TestDomain::new();
    let _replay = replay(&domain);
    let load = sim_contract::Load {
        header: LoadHeader::default(),
        scene: b"",
        constraints: &[],
        triangles: &[],
        collider_count: 0,
        keyframe_size_bytes_max: 1,
    };
    let error = Owner::create(&domain.endpoint(), &load).unwrap_err();
    assert!(error.to_string().contains("is running already"), "{error}");
}

#[test]
fn a_snapshot_of_another_size_is_refused() {
    let domain = TestDomain::new();
    let mut replay = replay(&domain);
    let short = Frame { particles: vec![ParticleState::default()], ..frame(1, Vec::new()) };
    let error = replay.publish(&short).unwrap_err();
    assert_eq!(error.to_string(), "step 1 has 1 particles, the scene 2");
}
