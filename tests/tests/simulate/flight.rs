//! Recordings of commands (`--only-commands`): they verify, and `simulate` adds the particles that they
//! leave out.

use std::fs;

use integration_tests::{Sandbox, Signal, ctl};

use super::{frames, node, record, recorder, step, wait_for_step};

/// Lets a paused node compute 600 steps with commands of most kinds.
fn run_with_commands(sandbox: &Sandbox) {
    step(sandbox, 100);
    ctl(sandbox, &["grab", "90", "0.5", "-0.2", "0.3", "--over", "0.1"]);
    ctl(sandbox, &["cut-radius", "0.3", "0.3", "0", "--radius", "0.1"]);
    step(sandbox, 150);
    ctl(sandbox, &["set", "damping", "0.1"]);
    ctl(sandbox, &["release", "90"]);
    step(sandbox, 150);
    ctl(sandbox, &["rewind", "--to-step", "220"]);
    ctl(sandbox, &["pin", "150"]);
    step(sandbox, 200);
}

#[test]
fn a_recording_of_commands_becomes_the_full_one_bit_for_bit() {
    let sandbox = Sandbox::new();
    let [full, flight, completed] =
        ["full.mcap", "flight.mcap", "out.mcap"].map(|name| sandbox.path(name));
    let node = node(&sandbox, &["run", "curtain", "--paused"]);
    let recordings = [
        (record(&sandbox, &["-o", &full, "--flush-interval", "100ms"]), &full),
        (
            record(&sandbox, &["-o", &flight, "--flush-interval", "100ms", "--only-commands"]),
            &flight,
        ),
    ];
    run_with_commands(&sandbox);
    let last = ctl(&sandbox, &["status"])["step"].as_u64().unwrap();
    for (recording, file) in recordings {
        wait_for_step(file, last);
        recording.interrupt().success();
    }
    node.interrupt().success();

    let (direct, kept) = (frames(&full), frames(&flight));
    assert_eq!(kept.len(), direct.len());
    let count = kept.iter().filter(|frame| frame.particles.is_some()).count();
    assert!((1..4).contains(&count), "{count} of {} snapshots have particles", kept.len());
    let size = |file: &str| fs::metadata(file).unwrap().len();
    assert!(size(&flight) * 8 < size(&full), "{} and {} bytes", size(&flight), size(&full));

    for file in [&flight, &completed] {
        if file == &completed {
            recorder(&sandbox, &["simulate", &flight, "-o", &completed]).success();
        }
        let verified = recorder(&sandbox, &["verify", "--json", file]).json();
        assert_eq!(verified["verdict"], "identical", "{verified}");
        assert_eq!(verified["last_identical_step"], last, "{verified}");
        recorder(&sandbox, &["check", file]).success();
        let info = recorder(&sandbox, &["info", "--json", file]).json();
        assert_eq!((&info["last_step"], &info["lost"]), (&last.into(), &serde_json::json!({})));
    }
    let args = ["verify", "--json", &flight, "--from", "380", "--to", "390"];
    let verified = recorder(&sandbox, &args).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    assert_eq!(verified["last_identical_step"], 390, "{verified}");
    let first = verified["first_step"].as_u64().unwrap();
    assert!(first < 380, "{verified}");
    let text = recorder(&sandbox, &["verify", &flight, "--from", "380", "--to", "390"]).success();
    let expected = format!("\nstarted at step {first}, the last complete state up to --from 380\n");
    assert!(text.ends_with(&expected), "{text}");
    let refused = recorder(&sandbox, &["verify", &flight, "--from", "390", "--to", "380"]);
    assert!(refused.stderr.contains("--from 390 is after --to 380"), "{refused:?}");
    let refused = recorder(&sandbox, &["verify", &flight, "--from", "99999"]);
    assert_eq!(refused.code, Some(1), "nothing was compared: {refused:?}");
    assert!(refused.stderr.contains("--from 99999 is after its last step"), "{refused:?}");

    let completed = frames(&completed);
    assert_eq!(completed.len(), direct.len());
    for (one, other) in completed.iter().zip(&direct) {
        assert_eq!(one.row, other.row);
        assert!(one.particles == other.particles, "the particles of step {}", one.row.step);
        assert!(one.particles.is_some());
    }
}

#[test]
fn programs_that_need_all_particles_name_the_cure() {
    let sandbox = Sandbox::new();
    let flight = sandbox.path("flight.mcap");
    let node = node(&sandbox, &["run", "rope", "--steps", "30", "--paused"]);
    let recording = record(&sandbox, &["-o", &flight, "--only-commands"]);
    step(&sandbox, 30);
    node.wait().success();
    recording.wait().success();
    let pictures = sandbox.path("pictures");
    let arrays = sandbox.path("arrays.npz");
    for args in [
        vec!["play", &flight, "--name", "played"],
        vec!["export", &flight, "--svg", &pictures],
        vec!["export", &flight, "--npz", &arrays],
    ] {
        let refused = recorder(&sandbox, &args);
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.stderr.contains("`recorder simulate IN.mcap -o OUT.mcap`"), "{refused:?}");
    }
    let refused = recorder(&sandbox, &["simulate", "rope"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("a scene needs --steps N"), "{refused:?}");
    let unknown = recorder(&sandbox, &["simulate", "curtian"]);
    assert_eq!(unknown.code, Some(1), "{unknown:?}");
    assert!(unknown.stderr.contains("did you mean 'curtain'?"), "{unknown:?}");
}

#[test]
fn a_killed_recorder_of_commands_leaves_a_file_that_simulates_as_far_as_it_goes() {
    let sandbox = Sandbox::new();
    let (flight, completed) = (sandbox.path("flight.mcap"), sandbox.path("out.mcap"));
    let _node = node(&sandbox, &["run", "curtain", "--paused"]);
    let args = ["-o", &flight, "--only-commands", "--flush-interval", "100ms"];
    let recording = record(&sandbox, &args);
    run_with_commands(&sandbox);
    let last = ctl(&sandbox, &["status"])["step"].as_u64().unwrap();
    wait_for_step(&flight, last);
    recording.signal(Signal::KILL);
    recording.wait();
    let part = format!("{flight}.part");
    let simulated = recorder(&sandbox, &["simulate", &part, "-o", &completed, "--json"]);
    assert_eq!(simulated.code, Some(3), "{simulated:?}");
    let completed = frames(&completed);
    assert_eq!(completed.last().map(|frame| frame.row.step), Some(last));
    assert!(completed.iter().all(|frame| frame.particles.is_some()));
}

/// Two particles that freeze soon, because they repel each other beyond all numbers.
const FREEZES: &str = "version = 1\n[solver]\nrate_hz = 60\nmax_speed = 3e38\n[[particle]]\n\
    position = [0, 9, 0]\n[[particle]]\nposition = [1, 9, 0]\n[[constraint]]\nparticles = [0, 1]\n\
    rest_length = 1e30\n";

#[test]
fn events_of_a_recording_of_commands_are_checked_from_any_state_on() {
    let sandbox = Sandbox::new();
    let flight = sandbox.path("flight.mcap");
    let scene = sandbox.write("fall.toml", FREEZES);
    let node = node(&sandbox, &["run", &scene, "--paused"]);
    let args = ["-o", &flight, "--only-commands", "--flush-interval", "100ms"];
    let recording = record(&sandbox, &args);
    step(&sandbox, 1300);
    wait_for_step(&flight, 1300);
    recording.interrupt().success();
    node.interrupt().success();
    let events = frames(&flight);
    let events = events.iter().flat_map(|frame| &frame.updates);
    assert!(events.into_iter().any(|one| matches!(one, recording::Message::Event(_))));
    for from in ["0", "700", "1250"] {
        let verified = recorder(&sandbox, &["verify", "--json", &flight, "--from", from]).json();
        assert_eq!(verified["verdict"], "identical", "--from {from}: {verified}");
    }
}
