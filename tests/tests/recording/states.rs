//! States that are put in place: rewinds, and states from recordings and clients. The run continues from
//! them bit for bit, and its recording verifies.

use std::path::Path;
use std::time::Duration;

use integration_tests::storm::{self, HeldState, Storm};
use integration_tests::{DEADLINE, Finished, Process, Program, Sandbox, ctl, record, wait_for};
use recording::{Frame, FrameReader, LogReader, Message};
use sim_contract::{
    Action, Client, GivenState, Outcome, Parameter, ParticleFlags, ParticleState, Reason,
    RestoreContents, Tap,
};

fn node(sandbox: &Sandbox, args: &[&str]) -> Process {
    Process::start_ready(Program::SimNode, sandbox, args)
}

fn recorder(sandbox: &Sandbox, args: &[&str]) -> String {
    Process::run(Program::Recorder, sandbox, args).success()
}

fn hash(sandbox: &Sandbox) -> String {
    ctl(sandbox, &["hash"])["state_hash"].as_str().unwrap().to_owned()
}

fn step(sandbox: &Sandbox, count: u64) {
    ctl(sandbox, &["step", &count.to_string()]);
}

fn frames(file: &str) -> Vec<Frame> {
    let mut reader = FrameReader::new(LogReader::open(Path::new(file)).unwrap());
    std::iter::from_fn(|| reader.next_frame().unwrap()).collect()
}

/// Ends a recorder after the last step of a paused node, and expects that it has lost nothing.
fn end_after(sandbox: &Sandbox, recording: Process, file: &str) {
    interrupt_after(sandbox, recording, file).success();
}

/// Ends a recorder after the last step of a paused node.
fn interrupt_after(sandbox: &Sandbox, recording: Process, file: &str) -> Finished {
    let last = ctl(sandbox, &["status"])["step"].as_u64().unwrap();
    wait_for("the recording of the last step", || {
        let log = LogReader::open(Path::new(&format!("{file}.part"))).ok()?;
        let mut reader = FrameReader::new(log);
        let frames = std::iter::from_fn(|| reader.next_frame().ok().flatten());
        frames.last().filter(|frame| frame.row.step == last)
    });
    recording.interrupt()
}

/// Records 1,000 steps with commands, and returns the hash of the last one.
fn record_a_thousand_steps(sandbox: &Sandbox, file: &str) -> String {
    let node = node(sandbox, &["run", "curtain", "--paused"]);
    let recording = record(sandbox, file);
    ctl(sandbox, &["grab", "90", "0.5", "-0.2", "0.3", "--over", "0.1"]);
    step(sandbox, 300);
    ctl(sandbox, &["cut-radius", "0.3", "0.3", "0", "--radius", "0.1"]);
    ctl(sandbox, &["set", "damping", "0.1"]);
    ctl(sandbox, &["pin", "150"]);
    step(sandbox, 203);
    ctl(sandbox, &["release", "90"]);
    step(sandbox, 497);
    let hash = hash(sandbox);
    end_after(sandbox, recording, file);
    node.interrupt().success();
    hash
}

#[test]
fn a_state_continues_in_another_process_with_the_same_hashes() {
    let sandbox = Sandbox::new();
    let (file, again) = (sandbox.path("run.mcap"), sandbox.path("again.mcap"));
    let expected = record_a_thousand_steps(&sandbox, &file);
    let node = node(&sandbox, &["run", "curtain", "--paused"]);
    let recording = record(&sandbox, &again);
    // Step 510 has no keyframe of its own.
    assert!(frames(&file).iter().all(|one| one.row.step != 510 || one.own_keyframe().is_none()));
    let restored = recorder(&sandbox, &["restore", &file, "--step", "510"]);
    assert!(restored.starts_with("restored at step 1: the state of step 510, "), "{restored}");
    step(&sandbox, 490);
    assert_eq!(hash(&sandbox), expected);
    // The state of a running node is a recording of one step.
    let state = sandbox.path("state.mcap");
    recorder(&sandbox, &["state", "-o", &state]);
    let [only] = &frames(&state)[..] else { panic!("not one step") };
    assert!(only.own_keyframe().is_some());
    ctl(&sandbox, &["reset"]);
    recorder(&sandbox, &["restore", &state]);
    assert_eq!(hash(&sandbox), expected);
    let restored = recorder(&sandbox, &["restore", &file, "--time", "1s"]);
    assert!(restored.contains("the state of step 240, "), "{restored}");
    end_after(&sandbox, recording, &again);
    node.interrupt().success();
    let verified = recorder(&sandbox, &["verify", "-v", &again]);
    assert!(verified.starts_with("494 steps bit-identical (0..=494)"), "{verified}");
    // The state of the state file is one that the run had computed.
    assert!(verified.contains("2 states taken from the file"), "{verified}");
}

#[test]
fn the_state_of_a_paused_node_is_complete_until_a_command_changes_it() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("state.mcap");
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    // Only the first of these steps has a keyframe.
    step(&sandbox, 10);
    ctl(&sandbox, &["mark", "here"]);
    recorder(&sandbox, &["state", "-o", &file]);
    let [only] = &frames(&file)[..] else { panic!("not one step") };
    assert_eq!(only.row.step, 10);
    step(&sandbox, 3);
    ctl(&sandbox, &["pin", "90"]);
    let args = ["state", "-o", &file, "--overwrite"];
    let refused = Process::run(Program::Recorder, &sandbox, &args);
    assert_eq!(refused.code, Some(1));
    assert!(refused.stderr.contains("`sim-node ctl step 1 --domain "), "{}", refused.stderr);
}

#[test]
fn the_state_of_another_scene_is_refused_with_both_hashes() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    recorder(&sandbox, &["simulate", "curtain", "--steps", "10", "-o", &file]);
    let node = node(&sandbox, &["run", "curtain", "--rate", "120", "--paused"]);
    let before = hash(&sandbox);
    let refused = Process::run(Program::Recorder, &sandbox, &["restore", &file]);
    assert_eq!(refused.code, Some(1));
    let hashes = refused.stderr.split(|c: char| !c.is_ascii_hexdigit());
    let hashes: Vec<_> = hashes.filter(|word| word.len() == 16).collect();
    assert!(hashes.len() == 2 && hashes[0] != hashes[1], "{}", refused.stderr);
    assert_eq!(hash(&sandbox), before);
    let beyond = Process::run(Program::Recorder, &sandbox, &["restore", &file, "--step", "11"]);
    assert_eq!(beyond.code, Some(1));
    node.interrupt().success();
}

fn give(client: &mut Client, state: &GivenState<'_>) -> Outcome {
    client.restore(state, DEADLINE).unwrap()
}

#[test]
fn a_wrong_state_is_refused_and_changes_no_bit() {
    let sandbox = Sandbox::new();
    let node = node(&sandbox, &["run", "curtain", "--paused"]);
    ctl(&sandbox, &["step", "50"]);
    let held = HeldState::read(&sandbox);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let before = hash(&sandbox);
    let with = |change: fn(&mut HeldState)| {
        let (particles, keyframe) = (held.particles.clone(), held.keyframe.clone());
        let mut changed = HeldState { particles, keyframe, ..held };
        change(&mut changed);
        changed
    };
    for wrong in [
        with(|held| held.scene_hash ^= 1),
        with(|held| held.particles.truncate(167)),
        with(|held| held.particles.push(ParticleState::default())),
        with(|held| held.particles[40].position[1] = f32::NAN),
        with(|held| held.particles[40].velocity[1] = f32::INFINITY),
        with(|held| held.particles[0].velocity[1] = 1.0),
    ] {
        for state in [wrong.state(), wrong.motion()] {
            assert_eq!(give(&mut client, &state).reason(), Some(Reason::InvalidState));
        }
    }
    for wrong in [
        with(|held| held.particles[40].flags = ParticleFlags::PINNED),
        with(|held| held.particles[40].inverse_mass *= 2.0),
        with(|held| held.keyframe.truncate(20)),
        with(|held| held.keyframe.clear()),
        with(|held| held.keyframe.push(0)),
        with(|held| held.keyframe.resize(1 << 16, 0)),
        with(|held| held.keyframe[0] = 99),
    ] {
        assert_eq!(give(&mut client, &wrong.state()).reason(), Some(Reason::InvalidState));
    }
    // A command alone has no state.
    let action = Action::Restore { contents: RestoreContents::State, state_hash: 0 };
    let outcome = client.request(action, DEADLINE).unwrap();
    assert_eq!(outcome.reason(), Some(Reason::NoEffectHere));
    assert_eq!(hash(&sandbox), before);
    assert_eq!(ctl(&sandbox, &["status"])["rejected_commands"], 20);
    node.interrupt().success();
}

#[test]
fn a_client_gives_positions_and_velocities_and_the_rest_stays() {
    let sandbox = Sandbox::new();
    let file = sandbox.path("run.mcap");
    let node = node(&sandbox, &["run", "curtain", "--paused"]);
    let recording = record(&sandbox, &file);
    ctl(&sandbox, &["cut", "400"]);
    ctl(&sandbox, &["step", "20"]);
    let mut held = HeldState::read(&sandbox);
    ctl(&sandbox, &["pin", "90"]);
    ctl(&sandbox, &["step", "1"]);
    for particle in &mut held.particles[90..] {
        particle.position[2] = -0.5;
        particle.velocity = [0.0; 3];
    }
    held.particles[100].velocity = [-0.0, 1.5, 0.0];
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let outcome = give(&mut client, &held.motion());
    assert_eq!((outcome.is_applied(), outcome.step), (true, 22));
    let snapshot = client.latest_snapshot(DEADLINE).unwrap().unwrap();
    let header = *snapshot.header();
    assert_eq!((header.step, header.scene_step), (22, 21), "no time passes in the scene");
    let Action::Restore { state_hash, .. } = outcome.command.action() else { panic!("no restore") };
    assert_eq!(state_hash, header.state_hash);
    for (index, (found, given)) in snapshot.particles().iter().zip(&held.particles).enumerate() {
        assert_eq!((found.position, found.velocity), (given.position, given.velocity), "{index}");
        let is_pinned = index < 14 || index == 90;
        assert_eq!(found.flags == ParticleFlags::PINNED, is_pinned, "{index}");
    }
    drop(snapshot);
    ctl(&sandbox, &["step", "100"]);
    end_after(&sandbox, recording, &file);
    node.interrupt().success();
    let verified = recorder(&sandbox, &["verify", "-v", &file]);
    assert!(verified.contains("1 state taken from the file"), "{verified}");
    let rows = frames(&file).into_iter().flat_map(|frame| frame.updates);
    let tears = rows.filter(|update| matches!(update, Message::Tears(_)));
    assert_eq!(tears.map(|update| update.step()).collect::<Vec<_>>(), [1], "torn once");
}

#[test]
fn a_rewind_goes_to_a_step_after_the_lost_grab_of_a_client() {
    let sandbox = Sandbox::new();
    let node = node(&sandbox, &["run", "curtain"]);
    let mut client = Client::attach(&sandbox.endpoint()).unwrap();
    let grab = Action::Grab { particle: 90, target: [0.5, -0.2, 0.3], over_s: 0.1 };
    assert!(client.request(grab, DEADLINE).unwrap().is_applied());
    drop(client);
    let mut other = Client::attach(&sandbox.endpoint()).unwrap();
    let released = wait_for("the release of the lost grab", || {
        let snapshot = other.latest_snapshot(DEADLINE).unwrap()?;
        let is_grabbed = snapshot.particles()[90].flags & ParticleFlags::GRABBED != 0;
        (!is_grabbed).then(|| snapshot.header().step)
    });
    wait_for("a later step", || {
        let snapshot = other.latest_snapshot(DEADLINE).unwrap()?;
        (snapshot.header().step > released + 10).then_some(())
    });
    let rewind = Action::Rewind { to_step: Some(released + 5), back_steps: None };
    let outcome = other.request(rewind, DEADLINE).unwrap();
    assert!(outcome.is_applied(), "{outcome:?}");
    node.interrupt().success();
}

#[test]
fn a_live_recording_with_rewinds_and_states_verifies() {
    for (scene, options) in [
        // It has a collider, which moves.
        ("drape", &[][..]),
        ("curtain", &["--every", "7"]),
        ("curtain", &["--history", "1MiB"]),
    ] {
        let sandbox = Sandbox::new();
        let file = sandbox.path("run.mcap");
        let args = [&["run", scene, "--rate", "240"], options].concat();
        let node = node(&sandbox, &args);
        let held = HeldState::read(&sandbox);
        let recording = record(&sandbox, &file);
        let counts = storm::send(&sandbox, &held, Storm { clients: 2, commands: 300 });
        assert!(counts.applied > 0 && counts.rejected > 0, "{counts:?}");
        ctl(&sandbox, &["pause"]);
        let recorded = interrupt_after(&sandbox, recording, &file);
        node.interrupt().success();
        let verified = Process::run(Program::Recorder, &sandbox, &["verify", "--json", &file]);
        let report: serde_json::Value = serde_json::from_str(&verified.stdout).unwrap();
        if recorded.code == Some(3) {
            // A busy machine may lose the keyframe of a state that a command put in place.
            assert_ne!(report["lost"], serde_json::json!({}), "{report}");
            assert_ne!(report["verdict"], "diverged", "{report}");
            continue;
        }
        recorded.success();
        assert_eq!(report["verdict"], "identical", "{report}");
        let compared_count = assert_rewinds_go_to_recorded_states(&file);
        // Of every 7th step, possibly none is the target of a rewind.
        assert!(compared_count > 0 || options.contains(&"--every"));
    }
}

/// Asserts that the state of each rewind is that of the step that its outcome names, if that step was
/// recorded. Returns the number of compared states.
fn assert_rewinds_go_to_recorded_states(file: &str) -> usize {
    let frames = frames(file);
    let frame = |step| frames.iter().find(|frame| frame.row.step == step);
    let updates = frames.iter().flat_map(|frame| &frame.updates);
    let mut count = 0;
    for update in updates {
        let Message::Outcome(row) = update else { continue };
        let Action::Rewind { to_step, .. } = row.action else { continue };
        if !row.is_applied() {
            continue;
        }
        let (now, then) = (frame(row.step).unwrap(), frame(to_step.unwrap()));
        let Some(then) = then else { continue };
        assert_eq!(now.row.state_hash, then.row.state_hash);
        assert_eq!(now.row.scene_step, then.row.scene_step);
        assert!(now.particles == then.particles);
        count += 1;
    }
    count
}

#[test]
fn a_reader_follows_a_rewind_with_all_that_belongs_to_it() {
    let sandbox = Sandbox::new();
    let node = node(&sandbox, &["run", "curtain", "--paused"]);
    let mut tap = Tap::attach(&sandbox.endpoint()).unwrap();
    ctl(&sandbox, &["step", "30"]);
    ctl(&sandbox, &["cut", "40"]);
    ctl(&sandbox, &["set", "damping", "0.5"]);
    ctl(&sandbox, &["step", "30"]);
    ctl(&sandbox, &["cut", "41"]);
    ctl(&sandbox, &["step", "30"]);
    for (target, torn, damping) in
        [("50", &[40][..], 0.5), ("10", &[], 0.3), ("80", &[40, 41], 0.5)]
    {
        let rewound = ctl(&sandbox, &["rewind", "--to-step", target]);
        let step = rewound["step"].as_u64().unwrap();
        assert_eq!(rewound["to_step"].to_string(), target);
        wait_for("the state of the rewind", || {
            let state = tap.next_state(|_| {});
            let Some(state) = state else {
                tap.wait(Duration::from_millis(10));
                return None;
            };
            if state.header.step != step {
                return None;
            }
            assert_eq!(state.header.torn_count as usize, torn.len());
            assert_eq!(state.torn.indices().collect::<Vec<_>>(), torn);
            assert_eq!(state.parameters.values.number(Parameter::Damping), damping);
            Some(())
        });
    }
    node.interrupt().success();
}
