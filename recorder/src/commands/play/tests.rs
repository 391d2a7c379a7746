//! Headers and payloads that a replay publishes equal the recorded ones.

use std::collections::VecDeque;
use std::time::Duration;

use recording::{
    CollidersRow, Frame, Message, OutcomeRow, RecordedState, RunDescription, StepRow, SurfaceRow,
    TearsRow, TopologyRow,
};
use sim_contract::testing::TestDomain;
use sim_contract::{
    Action, CONTRACT_VERSION, Client, ColliderState, Command, ConstraintState, LoadHeader, Outcome,
    OutcomeStatus, Owner, ParticleState, Reason, SnapshotFlags, SnapshotHeader, Tap, TearCause,
    Torn, TornConstraint, Triangle,
};

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
        particle_count: 2,
        constraint_count: 1,
        solver_version: 3,
        contract_version: CONTRACT_VERSION,
        ..RunDescription::default()
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
        snapshot_index: 40,
        energy: None,
    };
    let particle = ParticleState { position: [-0.0, step as f32, 0.0], ..Default::default() };
    Frame { updates, row, particles: Some(vec![particle; 2]), log_times_ns: Vec::new() }
}

fn replay(domain: &TestDomain) -> Replay {
    replay_from(domain, RecordedState::default())
}

fn replay_from(domain: &TestDomain, state: RecordedState) -> Replay {
    replay_after(domain, None, state)
}

/// Serves late subscribers.
fn serve(replay: &mut Replay) {
    replay.receive_commands(&mut VecDeque::new());
}

fn replay_after(domain: &TestDomain, owner: Option<Owner>, state: RecordedState) -> Replay {
    let load = LoadHeader::default();
    let recorded = Recorded {
        run: &run(),
        scene: b"version = 1",
        topology: &TopologyRow::new(
            &load,
            &[ConstraintState { b: 1, ..Default::default() }; 4],
            &[],
        ),
        bends: &[],
        surface: &SurfaceRow::new(&load, &[Triangle { corners: [0, 1, 0] }]),
        collider_count: 1,
        keyframe_size_bytes_max: 64,
    };
    Replay::new(&domain.endpoint(), owner, &recorded, state).unwrap()
}

/// Returns a client that reads snapshots from now on. Its first read subscribes it.
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
fn snapshots_equal_those_of_the_node_except_run_id_number_time_and_flag() {
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
        stride: 1,
        snapshot_index: 0,
    };
    assert_eq!(header, expected);
    assert_ne!(header.run_id, run().run_id);
    assert_eq!(particles, frame(12, Vec::new()).payload());
    assert!(client.topology(Duration::ZERO).unwrap().is_none());
    serve(&mut replay);
    assert_eq!(client.topology(TIMEOUT).unwrap().unwrap().constraints.len(), 4);
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
fn answers_to_commands_are_not_part_of_the_recorded_run() {
    let domain = TestDomain::new();
    let mut replay = replay(&domain);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let mut ask = |action, result| {
        client.send(action).unwrap();
        let mut commands = VecDeque::new();
        replay.receive_commands(&mut commands);
        replay.answer(commands[0].command, 42, result).unwrap();
        client.next_outcome(TIMEOUT).unwrap().unwrap()
    };
    let paused = ask(Action::Pause, Ok(()));
    assert_eq!((paused.step, paused.status), (42, OutcomeStatus::Applied as u32));
    assert_eq!(paused.flags, sim_contract::OUTCOME_FLAG_CONTROL);
    let refused = ask(Action::Pin { particle: 0 }, Err(Reason::NoEffectHere));
    assert_eq!(refused.reason, Reason::NoEffectHere as u32);
}

#[test]
fn readers_stay_connected_when_a_run_follows_another() {
    let domain = TestDomain::new();
    let mut first = replay(&domain);
    let mut tap = Tap::attach(&domain.endpoint()).unwrap();
    first.publish(&frame(12, vec![])).unwrap();
    serve(&mut first);
    let mut next = |replay: &mut Replay| {
        serve(replay);
        let state = tap.next_state(|_| {}).unwrap();
        (state.header.run_id, state.header.step, state.torn.indices().collect::<Vec<_>>())
    };
    let (run_id, step, torn) = next(&mut first);
    assert_eq!((step, torn), (12, vec![]));
    let state = RecordedState { torn: before(None), ..RecordedState::default() };
    let mut second = replay_after(&domain, Some(first.into_owner()), state);
    second.publish_latched().unwrap();
    second.publish(&frame(3, vec![])).unwrap();
    let (second_run_id, step, _) = next(&mut second);
    assert_eq!(step, 3);
    assert_ne!(run_id, second_run_id, "steps never go back in a run");
}

#[test]
fn a_name_in_use_is_refused() {
    let domain = TestDomain::new();
    let _replay = replay(&domain);
    let load = sim_contract::Load {
        header: LoadHeader::default(),
        scene: b"",
        constraints: &[],
        bends: &[],
        triangles: &[],
        collider_count: 0,
        keyframe_size_bytes_max: 1,
        parameters: sim_contract::ParameterValues::default(),
    };
    let error = Owner::create(&domain.endpoint(), &load).unwrap_err();
    assert!(error.to_string().contains("is already running"), "{error}");
}

#[test]
fn a_snapshot_of_another_size_is_refused() {
    let domain = TestDomain::new();
    let mut replay = replay(&domain);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert!(client.colliders(Duration::ZERO).unwrap().colliders.is_empty());
    let particles = Some(vec![ParticleState::default()]);
    let short = Frame { particles, ..frame(1, vec![floor(1, 2.0)]) };
    let error = replay.publish(&short).unwrap_err();
    assert_eq!(error.to_string(), "the snapshot of step 1 has 1 particles, but the scene has 2");
    serve(&mut replay);
    assert!(client.colliders(Duration::ZERO).unwrap().colliders.is_empty(), "nothing of its step");
}

#[test]
fn the_stride_is_the_distance_from_the_snapshot_before() {
    let domain = TestDomain::new();
    let mut replay = replay(&domain);
    let mut client = reader(&domain);
    let strides = [8, 12, 13, 20].map(|step| {
        replay.publish(&frame(step, Vec::new())).unwrap();
        next_header(&mut client).0.stride
    });
    assert_eq!(strides, [1, 4, 1, 7]);
}

fn tears(step: u64, constraints: &[u32], cause: &str) -> Message {
    let causes = vec![cause.to_owned(); constraints.len()];
    Message::Tears(TearsRow { step, constraints: constraints.to_vec(), causes })
}

fn floor(step: u64, offset: f32) -> Message {
    let state = ColliderState { normal: [0.0, 1.0, 0.0], offset, ..ColliderState::default() };
    Message::Colliders(CollidersRow::new(step, &[state]).unwrap())
}

/// Returns the step, the number of new tears, and all tears with their causes, as a client reads them.
fn torn(client: &mut Client) -> (u64, u32, Vec<(u32, Option<TearCause>)>) {
    let torn = client.torn(TIMEOUT).unwrap();
    let all = torn.constraints.iter().map(|one| (one.constraint, one.cause())).collect();
    (torn.header.step, torn.header.new_count, all)
}

/// Constraint 2 tore before the recording.
fn before(cause: Option<TearCause>) -> Torn {
    Torn::from_iter([TornConstraint::new(2, cause)])
}

#[test]
fn each_list_of_tears_is_complete_and_a_reset_empties_it() {
    let domain = TestDomain::new();
    let cause = Some(TearCause::Force);
    let state = RecordedState { torn: before(cause), ..RecordedState::default() };
    let mut replay = replay_from(&domain, state);
    replay.publish_latched().unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(client.torn(Duration::ZERO).unwrap().constraints, []);
    serve(&mut replay);
    let (force, cut) = (Some(TearCause::Force), Some(TearCause::Cut));
    assert_eq!(torn(&mut client), (0, 0, vec![(2, force)]));
    replay.publish(&frame(5, vec![tears(5, &[3, 1], "cut")])).unwrap();
    assert_eq!(torn(&mut client), (5, 2, vec![(2, force), (3, cut), (1, cut)]));
    replay.publish(&frame(7, vec![outcome(4, 7, Action::Reset)])).unwrap();
    assert_eq!(torn(&mut client), (7, 0, vec![]));
    // Tears of the step of a reset follow the reset.
    replay.publish(&frame(8, vec![tears(8, &[0], "x")])).unwrap();
    let updates = vec![outcome(5, 9, Action::Reset), tears(9, &[3], "cut")];
    replay.publish(&frame(9, updates)).unwrap();
    assert_eq!(torn(&mut client), (9, 1, vec![(3, cut)]));
}

#[test]
fn a_replay_that_starts_late_publishes_the_torn_constraints_and_the_colliders() {
    let domain = TestDomain::new();
    let (cut, distance) = (Some(TearCause::Cut), Some(TearCause::Distance));
    let mut torn: Torn = [TornConstraint::new(1, cut)].into_iter().collect();
    torn.extend(4, [TornConstraint::new(0, distance)]);
    torn.header.since_step = 2;
    let Message::Colliders(colliders) = floor(3, 2.0) else { unreachable!() };
    let row = StepRow { step: 6, scene_step: 4, outcome_count: 3, ..frame(6, vec![]).row };
    let state = RecordedState { row, torn, colliders: Some(colliders), ..RecordedState::default() };
    let mut replay = replay_from(&domain, state);
    replay.publish_latched().unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let mut offset = |replay: &mut Replay, timeout| {
        let colliders = client.colliders(timeout).unwrap();
        serve(replay);
        colliders.colliders.first().map(|one| (colliders.header.step, one.offset))
    };
    assert_eq!(offset(&mut replay, Duration::ZERO), None);
    assert_eq!(offset(&mut replay, TIMEOUT), Some((3, 2.0)));
    replay.publish(&frame(6, vec![floor(6, 3.0)])).unwrap();
    assert_eq!(offset(&mut replay, TIMEOUT), Some((6, 3.0)));
    let expected = vec![(1, cut), (0, distance)];
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    assert_eq!(client.torn(Duration::ZERO).unwrap().constraints, []);
    serve(&mut replay);
    let torn = client.torn(TIMEOUT).unwrap();
    let all: Vec<_> = torn.constraints.iter().map(|one| (one.constraint, one.cause())).collect();
    assert_eq!((torn.header.since_step, all), (2, expected));
}
