//! The lockstep: the node waits for its members, and for nobody else.

use std::num::NonZeroU32;
use std::path::Path;
use std::sync::Barrier;
use std::thread;

use fastrand::Rng;
use integration_tests::{DEADLINE, Process, Program, Sandbox, Signal, ctl, wait_for};
use recording::{LogReader, Message};
use sim_contract::{Action, Client, Endpoint, GivenState, RequestError, Snapshot, SnapshotFlags};
use sim_host::clock::{monotonic_ns, sleep_until};

const STEPS: u64 = 120;

/// Moves a grabbed particle by what another one does: each error of a step changes all that follow.
fn follow(client: &Client, snapshot: &Snapshot, particle: u32, leader: usize) -> Action {
    let step = snapshot.header().step;
    let [x, y, z] = snapshot.particles()[leader].position;
    let target = [x + 0.1, y - 0.05 * (client.client_id() as f32), z + 0.1];
    let over_s = 0.01;
    if step == 0 {
        Action::Grab { particle, target, over_s }
    } else {
        Action::Move { particle, target, over_s }
    }
}

/// Takes part until the node ends. Returns the number of turns.
fn control(endpoint: &Endpoint, id: u32, seed: u64, joined: &dyn Fn()) -> u64 {
    let mut rng = Rng::with_seed(seed);
    let mut client = Client::attach_as(endpoint, id.into()).unwrap();
    client.join_lockstep(DEADLINE).unwrap();
    joined();
    let mut turns = 0;
    while turns < STEPS
        && let Some(snapshot) = client.next_turn(DEADLINE).unwrap()
    {
        assert_eq!(snapshot.header().step, turns, "a turn was left out");
        sleep_until(monotonic_ns() + rng.u64(0..2_000_000));
        client.send(follow(&client, &snapshot, 20 + id, 60 + id as usize)).unwrap();
        drop(snapshot);
        client.ready().unwrap();
        turns += 1;
    }
    turns
}

/// Runs two controllers beside a node, and returns the hash of its last state.
fn hash_with_controllers(seed: u64, options: &[&str]) -> String {
    let sandbox = Sandbox::new();
    let steps = STEPS.to_string();
    let args = ["run", "curtain", "--paused", "--steps", &steps, "--json"];
    let node = Process::start_ready(Program::SimNode, &sandbox, &[&args[..], options].concat());
    let endpoint = sandbox.endpoint();
    let barrier = Barrier::new(3);
    thread::scope(|scope| {
        for id in [1, 2] {
            let (endpoint, barrier) = (&endpoint, &barrier);
            scope.spawn(move || {
                let joined = || {
                    barrier.wait();
                };
                control(endpoint, id, seed + u64::from(id), &joined)
            });
        }
        barrier.wait();
        assert_eq!(member_count(&sandbox), 2);
        ctl(&sandbox, &["resume"]);
        node.wait().json()["state_hash"].as_str().unwrap().to_owned()
    })
}

#[test]
fn a_client_that_has_read_the_newest_snapshot_joins_and_takes_its_turn_at_it() {
    let sandbox = Sandbox::new();
    // The node never goes on without the client.
    let options = ["run", "curtain", "--rate", "10", "--lockstep-timeout", "1h"];
    let node = Process::start_ready(Program::SimNode, &sandbox, &options);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    for _ in 0..3 {
        let read = client.next_snapshot(DEADLINE).unwrap().unwrap().header().step;
        client.join_lockstep(DEADLINE).unwrap();
        let turn =
            client.next_turn(DEADLINE).unwrap().expect("a turn, although the snapshot was read");
        assert!(turn.header().step >= read);
        drop(turn);
        client.leave_lockstep();
    }
    drop(client);
    node.interrupt().success();
}

#[test]
fn a_client_that_leaves_and_joins_again_at_once_is_waited_for() {
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--as-fast-as-possible"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let mut client = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
    for round in 0..50 {
        // The next turn of some members is far ahead when they leave.
        let every = NonZeroU32::new(if round % 2 == 0 { 1 } else { 1_000_000 }).unwrap();
        client.join_lockstep_every(every, DEADLINE).unwrap();
        let step = client.next_turn(DEADLINE).unwrap().unwrap().header().step;
        client.send(Action::Pin { particle: 30 }).unwrap();
        client.ready().unwrap();
        let outcome = client.next_outcome(DEADLINE).unwrap().unwrap();
        assert_eq!(outcome.step, step + 1, "round {round}");
        assert_eq!(client.missed_turns(), 0);
        client.leave_lockstep();
    }
}

#[test]
fn a_resumed_node_waits_for_its_members_before_the_first_step() {
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--paused", "--as-fast-as-possible"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.join_lockstep(DEADLINE).unwrap();
    ctl(&sandbox, &["resume"]);
    for step in 0..3 {
        let turn = *client.next_turn(DEADLINE).unwrap().unwrap().header();
        assert_eq!(turn.step, step);
        client.send(Action::Pin { particle: 30 }).unwrap();
        client.ready().unwrap();
        let outcome = client.next_outcome(DEADLINE).unwrap().unwrap();
        assert_eq!(outcome.step, step + 1);
    }
    drop(client);
    // A pause in between changes nothing.
    ctl(&sandbox, &["pause"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.join_lockstep(DEADLINE).unwrap();
    let step = ctl(&sandbox, &["hash"])["step"].as_u64().unwrap();
    ctl(&sandbox, &["resume"]);
    assert_eq!(client.next_turn(DEADLINE).unwrap().unwrap().header().step, step);
    client.send(Action::Unpin { particle: 30 }).unwrap();
    client.ready().unwrap();
    assert_eq!(client.next_outcome(DEADLINE).unwrap().unwrap().step, step + 1);
}

#[test]
fn the_same_controllers_give_the_same_hash_at_any_speed() {
    let expected = hash_with_controllers(0, &[]);
    for seed in 1..=10 {
        assert_eq!(hash_with_controllers(seed, &[]), expected, "seed {seed}");
        let fast = hash_with_controllers(100 + seed, &["--as-fast-as-possible"]);
        assert_eq!(fast, expected, "seed {seed}, as fast as possible");
    }
    let other_rate = hash_with_controllers(0, &["--rate", "200"]);
    assert_ne!(other_rate, expected);
}

fn member_count(sandbox: &Sandbox) -> usize {
    ctl(sandbox, &["status"])["lockstep"].as_array().unwrap().len()
}

#[test]
fn a_member_of_every_fourth_step_is_waited_for_at_those_steps_only() {
    let sandbox = Sandbox::new();
    // It would be far ahead by the next turn if it did not wait.
    let args = ["run", "curtain", "--as-fast-as-possible"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.join_lockstep_every(NonZeroU32::new(4).unwrap(), DEADLINE).unwrap();
    let mut last = None;
    for _ in 0..50 {
        let step = client.next_turn(DEADLINE).unwrap().unwrap().header().step;
        assert!(last.is_none_or(|last| step == last + 4), "{step} after {last:?}");
        last = Some(step);
        client.ready().unwrap();
    }
    drop(client);
    wait_for("an empty lockstep", || (member_count(&sandbox) == 0).then_some(()));
}

/// Resets a scene in lockstep a few times, and returns the hashes of each episode.
fn episodes(client: &mut Client, every: u32) -> Vec<Vec<u64>> {
    client.join_lockstep_every(NonZeroU32::new(every).unwrap(), DEADLINE).unwrap();
    drop(client.next_turn(DEADLINE).unwrap().unwrap());
    let mut episodes = Vec::new();
    for _ in 0..5 {
        client.send(Action::Reset).unwrap();
        client.ready().unwrap();
        let mut hashes = Vec::new();
        for turn in 0..40_u16 {
            let snapshot = client.next_turn(DEADLINE).unwrap().unwrap();
            let header = *snapshot.header();
            assert_eq!(header.scene_step, u64::from(turn) * u64::from(every), "{header:?}");
            assert_eq!(header.flags & SnapshotFlags::IN_PLACE != 0, turn == 0);
            hashes.push(header.state_hash);
            let (particle, target) = (90, [f32::from(turn) * 0.01, 0.2, 0.3]);
            let over_s = 0.01;
            client
                .send(match turn {
                    0 => Action::Grab { particle, target, over_s },
                    _ => Action::Move { particle, target, over_s },
                })
                .unwrap();
            drop(snapshot);
            if turn < 39 {
                client.ready().unwrap();
            }
        }
        episodes.push(hashes);
    }
    client.leave_lockstep();
    episodes
}

#[test]
fn episodes_that_begin_with_a_reset_repeat_bit_for_bit() {
    for every in [1, 4] {
        let mut expected: Option<Vec<u64>> = None;
        for (options, rounds) in [(&["--as-fast-as-possible"][..], 3), (&["--rate", "240"], 1)] {
            let sandbox = Sandbox::new();
            let args = [&["run", "curtain"][..], options].concat();
            let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
            for _ in 0..rounds {
                // The node runs on before each of them, so that they join at different steps.
                let mut client = Client::attach(&sandbox.endpoint()).unwrap();
                for hashes in episodes(&mut client, every) {
                    assert_eq!(*expected.get_or_insert(hashes.clone()), hashes, "every {every}");
                }
            }
        }
        let expected = expected.unwrap();
        assert_ne!(expected[0], expected[39], "the cloth moves");
    }
}

#[test]
fn a_member_gives_a_state_in_its_turn() {
    let sandbox = Sandbox::new();
    let _node = Process::start_ready(Program::SimNode, &sandbox, &["run", "curtain"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let scene_hash = client.topology(DEADLINE).unwrap().unwrap().header.scene_hash;
    client.join_lockstep_every(NonZeroU32::new(3).unwrap(), DEADLINE).unwrap();
    let first = client.next_turn(DEADLINE).unwrap().unwrap();
    let (step, particles) = (first.header().step, first.particles().to_vec());
    drop(first);
    client.ready().unwrap();
    assert_eq!(client.next_turn(DEADLINE).unwrap().unwrap().header().step, step + 3);
    let given = GivenState { scene_hash, particles: &particles, keyframe: None };
    assert!(matches!(client.restore(&given, DEADLINE), Err(RequestError::InTurn)));
    let sent = client.send_state(&given).unwrap();
    client.ready().unwrap();
    let shown = client.next_turn(DEADLINE).unwrap().unwrap();
    assert_eq!(shown.header().step, step + 4, "the state in place is a turn");
    assert_eq!(shown.particles(), particles);
    drop(shown);
    assert!(client.arrived_outcome(sent.sequence()).unwrap().unwrap().is_applied());
    client.take_back(sent);
    client.ready().unwrap();
    assert_eq!(client.next_turn(DEADLINE).unwrap().unwrap().header().step, step + 7);
}

#[test]
fn a_member_that_is_too_late_sees_how_many_turns_it_has_missed() {
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--lockstep-timeout", "100ms", "--every", "2"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    assert_eq!(client.missed_turns(), 0);
    client.join_lockstep_every(NonZeroU32::new(3).unwrap(), DEADLINE).unwrap();
    let turn = |client: &mut Client| client.next_turn(DEADLINE).unwrap().unwrap().header().step;
    // Not the first one, at which the node may have published a step for a command.
    turn(&mut client);
    client.ready().unwrap();
    let last = turn(&mut client);
    assert_eq!(client.missed_turns(), 0);
    wait_for("steps without the member", || {
        (ctl(&sandbox, &["hash"])["step"].as_u64().unwrap() > last + 60).then_some(())
    });
    client.ready().unwrap();
    let next = turn(&mut client);
    // Each second step is published, so the member, which takes part in every third, has each fourth.
    // The turn at `last` is one of those that the node did not wait for.
    assert_eq!(client.missed_turns(), 1 + (next - last - 4).div_ceil(4));
    assert!(next > last + 60, "{next} after {last}");
}

#[test]
fn a_member_that_is_too_late_but_in_time_for_its_next_turn_has_missed_one() {
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--lockstep-timeout", "100ms", "--rate", "240"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.join_lockstep_every(NonZeroU32::new(480).unwrap(), DEADLINE).unwrap();
    let step = client.next_turn(DEADLINE).unwrap().unwrap().header().step;
    wait_for("a step without the member", || {
        (ctl(&sandbox, &["hash"])["step"].as_u64().unwrap() > step).then_some(())
    });
    // A program that reads the status itself hides nothing.
    client.status(DEADLINE).unwrap().unwrap();
    client.ready().unwrap();
    assert_eq!(client.next_turn(DEADLINE).unwrap().unwrap().header().step, step + 480);
    assert_eq!(client.missed_turns(), 1);
}

#[test]
fn a_member_takes_part_at_published_steps_only() {
    let sandbox = Sandbox::new();
    let args = ["run", "curtain", "--as-fast-as-possible", "--every", "5"];
    let _node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    client.join_lockstep(DEADLINE).unwrap();
    let mut turn = || {
        let step = client.next_turn(DEADLINE).unwrap().unwrap().header().step;
        client.ready().unwrap();
        step
    };
    let first = turn();
    assert_eq!((1..50).map(|_| turn()).collect::<Vec<_>>(), every_fifth_after(first));
    assert_eq!(member_count(&sandbox), 1);
}

fn every_fifth_after(first: u64) -> Vec<u64> {
    (1..50).map(|index| first + 5 * index).collect()
}

fn step(sandbox: &Sandbox) -> u64 {
    ctl(sandbox, &["status"])["step"].as_u64().unwrap()
}

/// Waits until the node has made further steps.
fn goes_on(sandbox: &Sandbox) {
    let before = step(sandbox);
    wait_for("further steps", || (step(sandbox) > before + 10).then_some(()));
}

#[test]
fn a_killed_member_is_named_and_the_run_goes_on() {
    let sandbox = Sandbox::new();
    let mut node = Process::start_ready(Program::SimNode, &sandbox, &["run", "pendulum"]);
    let member = Process::start(Program::Hold, &sandbox, &["1000000"]);
    let joined = node.wait_for_line("client ");
    wait_for("a member", || (member_count(&sandbox) == 1).then_some(()));
    goes_on(&sandbox);
    member.signal(Signal::KILL);
    let (id, _) = joined.split_once(" joined the lockstep at step ").unwrap();
    node.wait_for_line(&format!("{id} left the lockstep at step "));
    assert_eq!(member_count(&sandbox), 0);
    goes_on(&sandbox);
    assert_eq!(member.wait().code, None);
    assert_eq!(node.interrupt().code, Some(0));
}

#[test]
fn a_stopped_member_is_dropped_after_the_stated_time_and_joins_again() {
    let sandbox = Sandbox::new();
    let args = ["run", "pendulum", "--lockstep-timeout", "200ms"];
    let mut node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let member = Process::start(Program::Hold, &sandbox, &["1000000"]);
    wait_for("the member", || (member_count(&sandbox) == 1).then_some(()));
    goes_on(&sandbox);
    member.signal(Signal::STOP);
    let line = node.wait_for_line("warning: client ");
    assert!(line.contains(" was not ready for the step after "), "{line}");
    assert!(line.contains(" within 200ms: the lockstep continues without it"), "{line}");
    goes_on(&sandbox);
    assert_eq!(member_count(&sandbox), 0);
    member.signal(Signal::CONT);
    wait_for("the member", || (member_count(&sandbox) == 1).then_some(()));
    goes_on(&sandbox);
    member.signal(Signal::KILL);
    member.wait();
    assert_eq!(node.interrupt().code, Some(0));
}

/// Returns the kinds and clients of the events in a recording.
fn events(file: &str) -> Vec<(String, u64)> {
    let mut log = LogReader::open(Path::new(file)).unwrap();
    let mut events = Vec::new();
    let mut last_step = 0;
    while let Some(logged) = log.next_message().unwrap() {
        if let Message::Event(row) = logged.message {
            assert!(row.step >= last_step, "{row:?} after step {last_step}");
            last_step = row.step;
            let client_id = row.client_id.unwrap();
            assert!(row.text.starts_with(&format!("client {client_id} ")), "{row:?}");
            events.push((row.kind, client_id));
        }
    }
    events
}

#[test]
fn a_recording_and_a_watch_name_each_member_that_joins_leaves_or_is_dropped() {
    let sandbox = Sandbox::new();
    let args = ["run", "pendulum", "--lockstep-timeout", "500ms"];
    let node = Process::start_ready(Program::SimNode, &sandbox, &args);
    let file = sandbox.path("run.mcap");
    // A recording in the lockstep would be a member, too.
    let mut recording = Process::start(Program::Recorder, &sandbox, &["record", "-o", &file]);
    recording.wait_for_line("recording from step ");
    let mut watch = Process::start(Program::SimNode, &sandbox, &["ctl", "watch"]);
    watch.wait_for_output(2);
    // A membership of less than a step is named, too.
    for _ in 0..3 {
        let mut client = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
        client.join_lockstep(DEADLINE).unwrap();
        drop(client);
        wait_for("an empty lockstep", || (member_count(&sandbox) == 0).then_some(()));
    }
    let members = ["8", "9"].map(|id| Process::start(Program::Member, &sandbox, &[id, "1"]));
    wait_for("two members", || (member_count(&sandbox) == 2).then_some(()));
    let [killed, stopped] = members;
    // The node prints a line a second, and may leave these out.
    let named = |line| wait_for(line, || watch.has_written_part(line).then_some(()));
    killed.signal(Signal::KILL);
    named("client 8 was dropped");
    stopped.signal(Signal::STOP);
    named("client 9 was dropped");
    stopped.signal(Signal::CONT);
    wait_for("the member", || (member_count(&sandbox) == 1).then_some(()));
    assert_eq!(stopped.interrupt().code, Some(0));
    wait_for("an empty lockstep", || (member_count(&sandbox) == 0).then_some(()));
    named("client 7 left the lockstep");
    goes_on(&sandbox);
    recording.interrupt().recorded();
    let found = events(&file);
    let kinds =
        |id| found.iter().filter(move |(_, client)| *client == id).map(|(kind, _)| &kind[..]);
    assert_eq!(kinds(7).collect::<Vec<_>>(), ["joined", "left"].repeat(3));
    assert_eq!(kinds(8).collect::<Vec<_>>(), ["joined", "killed"]);
    // A busy machine may drop it more than once.
    let last: Vec<_> = kinds(9).collect();
    assert!(last.starts_with(&["joined", "timed_out"]), "{last:?}");
    assert!(last.ends_with(&["joined", "left"]), "{last:?}");
    let verified = Process::run(Program::Recorder, &sandbox, &["verify", "-v", &file]).success();
    assert!(verified.contains("messages on /status and /events"), "{verified}");
    killed.wait();
    watch.interrupt();
    node.interrupt().success();
}

#[test]
fn a_member_continues_with_the_next_node() {
    let sandbox = Sandbox::new();
    let start = || Process::start_ready(Program::SimNode, &sandbox, &["run", "pendulum"]);
    let mut node = start();
    let mut client = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
    client.join_lockstep(DEADLINE).unwrap();
    node.wait_for_line("client 7 joined the lockstep at step ");
    let first = client.next_turn(DEADLINE).unwrap().unwrap().header().run_id;
    client.ready().unwrap();
    node.signal(Signal::KILL);
    node.wait();
    let mut node = start();
    let second = wait_for("a turn of the next run", || {
        let snapshot = client.next_turn(DEADLINE).unwrap()?;
        let run_id = snapshot.header().run_id;
        drop(snapshot);
        client.ready().unwrap();
        (run_id != first).then_some(run_id)
    });
    node.wait_for_line("client 7 joined the lockstep at step ");
    assert_eq!(client.next_turn(DEADLINE).unwrap().unwrap().header().run_id, second);
    // No outcome can come in a turn.
    let error = client.request(Action::Pause, DEADLINE).unwrap_err().to_string();
    assert!(error.contains("use `send`, then `ready`"), "{error}");
    client.ready().unwrap();
    assert_eq!(node.interrupt().code, Some(0));
}

#[test]
fn a_replay_waits_for_its_members_at_any_rate_and_after_a_seek() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let simulate = ["simulate", "curtain", "--steps", "500", "-o", &file];
    assert_eq!(Process::run(Program::Recorder, &sandbox, &simulate).code, Some(0));
    let play = ["play", &file, "--paused", "--rate", "max"];
    let replay = Process::start_ready(Program::Recorder, &sandbox, &play);
    let mut client = Client::attach_as(&sandbox.endpoint(), 7).unwrap();
    let error = client.ready().unwrap_err().to_string();
    assert!(error.contains("call join_lockstep first"), "{error}");
    client.join_lockstep(DEADLINE).unwrap();
    ctl(&sandbox, &["resume"]);
    let mut observer = Client::attach(&sandbox.endpoint()).unwrap();
    for step in 0..=200 {
        assert_eq!(client.next_turn(DEADLINE).unwrap().unwrap().header().step, step);
        if step.is_multiple_of(50) {
            // However long the member takes, the replay stays.
            for _ in 0..3 {
                wait_for("a status that awaits the member", || {
                    let status = observer.status(DEADLINE).unwrap()?;
                    assert!(status.step <= step, "{} > {step}", status.step);
                    (status.step == step && status.members()[0].is_awaited == 1).then_some(())
                });
            }
        }
        client.ready().unwrap();
    }
    // It waits before step 202, and obeys commands meanwhile.
    ctl(&sandbox, &["rewind", "--to-step", "400"]);
    let turns = std::iter::from_fn(|| {
        let step = client.next_turn(DEADLINE).unwrap()?.header().step;
        client.ready().unwrap();
        Some(step)
    });
    let steps: Vec<_> = turns.take_while(|step| *step < 500).filter(|step| *step >= 400).collect();
    assert_eq!(steps, (400..500).collect::<Vec<_>>());
    replay.wait().success();
}
