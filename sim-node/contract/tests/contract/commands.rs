//! Commands reach the owner, and outcomes reach their sender. If both sides have to act, the owner
//! acts in the test's thread until the client's thread has ended.

use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use sim_contract::testing::TestDomain;
use sim_contract::{
    Action, COMMANDS_BUFFERED, CONSOLE_CLIENT_ID, Client, Command, Endpoint, OUTCOMES_BUFFERED,
    Outcome, Owner, OwnerState, RequestError, Snapshot, Tap,
};

use crate::support::{DEADLINE, MOMENT, answer_commands, create_owner, publish_step};

const PIN: Action = Action::Pin { particle: 3 };
const RELEASE: Action = Action::Release { particle: 3, force: false };

/// Runs `client` beside an owner that answers all commands at step 9.
fn run_beside_owner<T: Send + 'static>(client: impl FnOnce(Endpoint) -> T + Send + 'static) -> T {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 8);
    let endpoint = domain.endpoint();
    let client = thread::spawn(move || client(endpoint));
    let mut outcome_count = 0;
    while !client.is_finished() {
        answer_commands(&owner, 9, &mut outcome_count);
        thread::yield_now();
    }
    client.join().unwrap()
}

fn receive(owner: &Owner) -> Vec<(u64, u64, Action)> {
    let mut commands = Vec::new();
    owner.receive_commands(&mut commands);
    let commands = commands.iter().map(|received| received.command);
    commands.map(|command| (command.client_id, command.sequence, command.action())).collect()
}

#[test]
fn a_request_returns_an_applied_or_rejected_outcome() {
    let outcomes = run_beside_owner(|endpoint| {
        let mut client = Client::attach(&endpoint).unwrap();
        assert!((1..1 << 53).contains(&client.client_id()));
        [PIN, RELEASE].map(|action| client.request(action, DEADLINE).unwrap())
    });
    let [pin, release] = outcomes;
    assert!(pin.is_applied() && !release.is_applied());
    assert_eq!((pin.step, pin.command.sequence, pin.command.action()), (9, 1, PIN));
    assert_eq!((release.command.sequence, release.reason_name()), (2, "not_grabbed"));
}

#[test]
fn outcomes_arrive_in_order_and_only_at_their_sender() {
    run_beside_owner(|endpoint| {
        let mut other = Client::attach(&endpoint).unwrap();
        let mut client = Client::attach_as(&endpoint, 5).unwrap();
        for _ in 0..3 {
            other.send(RELEASE).unwrap();
            client.send(PIN).unwrap();
        }
        // Waiting for the outcome of a later command keeps the earlier outcomes.
        assert_eq!(client.request(PIN, DEADLINE).unwrap().command.sequence, 4);
        let mut next = || client.next_outcome(DEADLINE).unwrap().unwrap();
        let sequences = [next(), next(), next()].map(|outcome: Outcome| {
            assert_eq!(outcome.command.client_id, 5);
            outcome.command.sequence
        });
        assert_eq!(sequences, [1, 2, 3]);
        assert!(client.next_outcome(MOMENT).unwrap().is_none());
    });
}

#[test]
fn processes_that_share_the_console_use_different_ascending_numbers() {
    run_beside_owner(|endpoint| {
        let mut consoles =
            [(); 2].map(|()| Client::attach_as(&endpoint, CONSOLE_CLIENT_ID).unwrap());
        let mut sequences = Vec::new();
        for _ in 0..3 {
            for console in &mut consoles {
                sequences.push(console.request(PIN, DEADLINE).unwrap().command.sequence);
            }
        }
        assert!(sequences.is_sorted_by(|a, b| a < b), "{sequences:?}");
        assert!(sequences.iter().all(|sequence| (1 << 50..1 << 53).contains(sequence)));
        assert!(consoles[0].next_outcome(MOMENT).unwrap().is_none());
    });
}

#[test]
fn an_unanswered_command_times_out_and_the_error_states_whether_a_node_runs() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let error = client.request(PIN, MOMENT).unwrap_err();
    let (name, process) = (domain.name(), std::process::id());
    assert_eq!(
        error.to_string(),
        format!(
            "no outcome of command 1 after at most 20ms, so its effect is unknown: process {process} \
             runs as 'sim' in domain '{name}', but does not answer (is it stopped, or overloaded?)"
        )
    );
    drop(owner);
    let error = client.request(PIN, MOMENT).unwrap_err();
    let RequestError::NoReceiver { owner: OwnerState::Gone { .. } } = &error else {
        panic!("{error}");
    };
    assert_eq!(
        error.to_string(),
        format!(
            "the command was not sent: no node runs as 'sim' in domain '{name}' now (start one with \
             `sim-node run --domain {name}`)"
        )
    );
}

#[test]
fn an_outcome_that_was_overwritten_is_reported_as_missed() {
    let flood = 4 * OUTCOMES_BUFFERED as u64;
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 8);
    let endpoint = domain.endpoint();
    let client = thread::spawn(move || {
        let mut client = Client::attach_as(&endpoint, 5).unwrap();
        client.request(PIN, DEADLINE).unwrap();
        client.request(RELEASE, DEADLINE).unwrap_err()
    });
    let mut outcome_count = 0;
    while outcome_count == 0 {
        answer_commands(&owner, 9, &mut outcome_count);
        thread::yield_now();
    }
    while receive(&owner).is_empty() {
        assert!(!client.is_finished());
        thread::yield_now();
    }
    // The client sleeps meanwhile, because nothing wakes it until the owner goes.
    for index in 1..=flood {
        let client_id = if index == 1 { 5 } else { 6 };
        let command = Command::new(client_id, 2, RELEASE);
        owner.publish_outcome(&Outcome::new(index, 9, command, Ok(()))).unwrap();
    }
    drop(owner);
    let error = client.join().unwrap();
    let RequestError::OutcomesMissed { sequence: 2, missed_count, .. } = error else {
        panic!("{error}");
    };
    assert!((1..=flood - OUTCOMES_BUFFERED as u64).contains(&missed_count), "{missed_count}");
    assert!(error.to_string().contains("so the command may have been applied"), "{error}");
}

#[test]
fn a_command_beyond_the_queue_is_an_error_and_the_queued_commands_are_kept() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach_as(&domain.endpoint(), 5).unwrap();
    for _ in 0..COMMANDS_BUFFERED {
        client.send(PIN).unwrap();
    }
    let error = client.send(RELEASE).unwrap_err();
    assert!(
        matches!(error, RequestError::QueueFull { owner: OwnerState::Alive { .. } }),
        "{error}"
    );
    let commands = receive(&owner);
    let expected: Vec<_> = (1..=COMMANDS_BUFFERED as u64).map(|number| (5, number, PIN)).collect();
    assert_eq!(commands, expected);
    assert_eq!(client.send(RELEASE).unwrap(), 257);
    assert_eq!(receive(&owner), [(5, 257, RELEASE)]);
}

#[test]
fn each_command_has_an_outcome_though_the_owner_answers_late() {
    const COUNT: usize = 3 * OUTCOMES_BUFFERED;
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let mut client = Client::attach_as(&domain.endpoint(), 5).unwrap();
    let mut received = Vec::new();
    for _ in 0..COUNT {
        client.send(PIN).unwrap();
        owner.receive_commands(&mut received);
    }
    for (index, received) in (0_u64..).zip(&received) {
        owner.publish_outcome(&Outcome::new(index, 9, received.command, Ok(()))).unwrap();
        let outcome = client.next_outcome(DEADLINE).unwrap();
        assert_eq!(outcome.map(|outcome| outcome.command.sequence), Some(index + 1));
    }
    assert_eq!(received.len(), COUNT);
}

#[test]
fn dropping_a_client_waits_until_its_commands_are_answered() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let endpoint = domain.endpoint();
    let sender = thread::spawn(move || {
        Client::attach_as(&endpoint, 5).unwrap().send(PIN).unwrap();
    });
    // The client is dropped right after sending. Without the wait, its command would be lost.
    let mut commands = Vec::new();
    while commands.is_empty() && !sender.is_finished() {
        commands = receive(&owner);
        thread::yield_now();
    }
    sender.join().unwrap();
    assert_eq!(commands, [(5, 1, PIN)]);
}

#[test]
fn a_client_that_only_sends_is_no_reader_and_a_client_that_only_reads_is_no_sender() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 0);
    let mut commander = Client::attach(&domain.endpoint()).unwrap();
    commander.send(PIN).unwrap();
    assert_eq!(owner.reader_count(), 0);
    let mut reader = Client::attach(&domain.endpoint()).unwrap();
    assert!(reader.next_snapshot(MOMENT).unwrap().is_none());
    assert_eq!(owner.reader_count(), 1);
    assert!(reader.next_outcome(MOMENT).unwrap().is_none());
}

#[test]
fn a_client_that_sends_without_a_pause_does_not_keep_others_from_being_received() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    let endpoint = domain.endpoint();
    let (is_over, has_sent) = (AtomicBool::new(false), Barrier::new(2));
    thread::scope(|scope| {
        scope.spawn(|| {
            // It is the first to connect, so its commands come first.
            let mut flooder = Client::attach_as(&endpoint, 1).unwrap();
            flooder.send(PIN).unwrap();
            has_sent.wait();
            while !is_over.load(Ordering::Relaxed) {
                let _full = flooder.send(PIN);
            }
        });
        has_sent.wait();
        let mut other = Client::attach_as(&endpoint, 2).unwrap();
        let mut counts = Vec::new();
        for _ in 0..100 {
            other.send(RELEASE).unwrap();
            let received = receive(&owner);
            let count = |id| received.iter().filter(|(client, ..)| *client == id).count();
            counts.push((count(1), count(2)));
        }
        // The thread ends before a failure can leave the scope.
        is_over.store(true, Ordering::Relaxed);
        let is_fair = |(flood, other): &(usize, usize)| *flood <= COMMANDS_BUFFERED && *other == 1;
        assert!(counts.iter().all(is_fair), "{counts:?}");
    });
}

#[test]
fn a_client_waits_in_parts_for_the_outcome_of_a_sent_command() {
    let domain = TestDomain::new();
    let owner = create_owner(&domain.endpoint()).unwrap();
    publish_step(&owner, 8);
    let mut client = Client::attach(&domain.endpoint()).unwrap();
    let sequence = client.send(PIN).unwrap();
    let early = client.outcome(sequence, MOMENT).unwrap_err();
    assert!(matches!(early, RequestError::Timeout { timeout: MOMENT, .. }), "{early}");
    answer_commands(&owner, 9, &mut 0);
    let outcome = client.outcome(sequence, DEADLINE).unwrap();
    assert_eq!((outcome.command.sequence, outcome.command.action()), (sequence, PIN));
}

#[test]
fn clients_taps_and_snapshots_move_between_threads() {
    fn require_send<T: Send>() {}
    require_send::<Client>();
    require_send::<Tap>();
    require_send::<Snapshot>();
}
