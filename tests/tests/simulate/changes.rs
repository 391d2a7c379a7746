//! Simulations of a recording with changed commands. They begin at a recorded state, so up to the first
//! change they are the recording, and a change of the same commands in a new run gives the same states.

use std::fs;

use integration_tests::{Finished, Sandbox, ctl};
use recording::{Frame, Message, OutcomeRow};

use super::{frames, node, record, recorder, step, wait_for_step};

/// Records a node with commands, from a step after some of them. Returns the last step.
fn record_mid_run(sandbox: &Sandbox, file: &str) -> u64 {
    let node = node(sandbox, &["run", "curtain", "--paused"]);
    ctl(sandbox, &["cut", "40"]);
    step(sandbox, 130);
    let recording = record(sandbox, &["-o", file, "--flush-interval", "100ms"]);
    step(sandbox, 200);
    ctl(sandbox, &["grab", "90", "0.5", "-0.2", "0.3", "--over", "0.1"]);
    step(sandbox, 200);
    ctl(sandbox, &["cut-radius", "0.3", "0.3", "0", "--radius", "0.3"]);
    step(sandbox, 200);
    ctl(sandbox, &["rewind", "--to-step", "600"]);
    step(sandbox, 100);
    let last = ctl(sandbox, &["status"])["step"].as_u64().unwrap();
    wait_for_step(file, last);
    recording.interrupt().success();
    node.interrupt().success();
    last
}

fn outcomes(frames: &[Frame]) -> Vec<OutcomeRow> {
    let updates = frames.iter().flat_map(|frame| &frame.updates);
    let rows = updates.filter_map(|update| match update {
        Message::Outcome(row) => Some(row.clone()),
        _ => None,
    });
    // Those of a paused node have no effect on states.
    rows.filter(|row| !matches!(row.action, sim_contract::Action::Step { .. })).collect()
}

fn index_of(frames: &[Frame], kind: &str) -> (u64, u64) {
    let rows = outcomes(frames);
    let row = rows.iter().find(|row| serde_json::to_value(row.action).unwrap()["kind"] == kind);
    let row = row.unwrap();
    (row.index, row.step)
}

fn is_same(one: &Frame, other: &Frame) -> bool {
    one.row.state_hash == other.row.state_hash && one.particles == other.particles
}

#[test]
fn a_dropped_command_changes_nothing_before_it_and_everything_after_it() {
    let sandbox = Sandbox::new();
    let (run, changed) = (sandbox.path("run.mcap"), sandbox.path("changed.mcap"));
    let last = record_mid_run(&sandbox, &run);
    let recorded = frames(&run);
    let (index, change) = index_of(&recorded, "cut_radius");
    let index = index.to_string();
    recorder(&sandbox, &["simulate", &run, "--drop", &index, "-o", &changed]).success();
    let verified = recorder(&sandbox, &["verify", "--json", &changed]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    recorder(&sandbox, &["check", &changed]).success();

    let new = frames(&changed);
    let first = new.first().unwrap().row.step;
    assert!(first > 130 && first < change, "{first}");
    assert_eq!(new.last().unwrap().row.step, last);
    for (one, other) in new.iter().zip(recorded.iter().filter(|frame| frame.row.step >= first)) {
        assert_eq!(one.row.step, other.row.step);
        let is_before = one.row.step < change;
        assert_eq!(is_same(one, other), is_before, "step {}", one.row.step);
    }
    let torn = |frames: &[Frame]| frames.last().unwrap().row.torn_count;
    assert!(torn(&new) < torn(&recorded));
    let repeated = outcomes(&recorded).into_iter().filter(|row| row.step > first);
    assert_eq!(outcomes(&new).len() + 1, repeated.count());
}

#[test]
fn a_rewind_to_before_the_change_starts_before_it() {
    let sandbox = Sandbox::new();
    let (run, changed) = (sandbox.path("run.mcap"), sandbox.path("changed.mcap"));
    record_mid_run(&sandbox, &run);
    let recorded = frames(&run);
    let (_, rewind) = index_of(&recorded, "rewind");
    // After the step that the rewind goes back to.
    let setting = format!("{}:damping=0.5", 650);
    recorder(&sandbox, &["simulate", &run, "--set", &setting, "-o", &changed]).success();
    let verified = recorder(&sandbox, &["verify", "--json", &changed]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    let new = frames(&changed);
    let first = new.first().unwrap().row.step;
    assert!(first <= 600, "{first}");
    let at = |frames: &[Frame], step| {
        frames.iter().find(|frame| frame.row.step == step).cloned().unwrap()
    };
    assert!(!is_same(&at(&new, 700), &at(&recorded, 700)));
    // The state in place is older than the change, and has its parameters.
    for step in [rewind, rewind + 1, rewind + 99] {
        assert!(is_same(&at(&new, step), &at(&recorded, step)), "step {step}");
    }
}

#[test]
fn a_state_of_another_process_is_put_in_place_again() {
    let sandbox = Sandbox::new();
    let [state, run, changed] =
        ["state.mcap", "run.mcap", "changed.mcap"].map(|name| sandbox.path(name));
    let node = node(&sandbox, &["run", "curtain", "--paused"]);
    ctl(&sandbox, &["pin", "100"]);
    step(&sandbox, 50);
    recorder(&sandbox, &["state", "-o", &state]).success();
    ctl(&sandbox, &["unpin", "100"]);
    step(&sandbox, 1);
    let recording = record(&sandbox, &["-o", &run, "--flush-interval", "100ms"]);
    step(&sandbox, 100);
    recorder(&sandbox, &["restore", &state]).success();
    step(&sandbox, 100);
    let last = ctl(&sandbox, &["status"])["step"].as_u64().unwrap();
    wait_for_step(&run, last);
    recording.interrupt().success();
    node.interrupt().success();

    recorder(&sandbox, &["simulate", &run, "--set", "100:damping=0.5", "-o", &changed]).success();
    let verified = recorder(&sandbox, &["verify", "--json", &changed]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    let (new, recorded) = (frames(&changed), frames(&run));
    let (_, restored) = index_of(&recorded, "restore");
    for one in &new {
        let other = recorded.iter().find(|frame| frame.row.step == one.row.step).unwrap();
        let is_changed = (100..restored).contains(&one.row.step);
        assert_eq!(is_same(one, other), !is_changed, "step {}", one.row.step);
    }
    assert!(new.first().unwrap().row.step < 100 && restored < last);
}

#[test]
fn the_same_commands_from_a_file_give_the_same_states() {
    let sandbox = Sandbox::new();
    let (run, changed) = (sandbox.path("run.mcap"), sandbox.path("changed.mcap"));
    record_mid_run(&sandbox, &run);
    let recorded = frames(&run);
    let rows = outcomes(&recorded);
    let lines = rows.iter().map(|row| serde_json::to_string(row).unwrap() + "\n");
    let commands = sandbox.write("commands.jsonl", &lines.collect::<String>());
    recorder(&sandbox, &["simulate", &run, "--commands", &commands, "-o", &changed]).success();
    let new = frames(&changed);
    assert_eq!(new.len(), recorded.len());
    assert!(new.iter().zip(&recorded).all(|(one, other)| is_same(one, other)));
}

#[test]
fn a_recording_is_its_own_command_file_wherever_it_starts() {
    let sandbox = Sandbox::new();
    let (run, changed) = (sandbox.path("run.mcap"), sandbox.path("changed.mcap"));
    record_mid_run(&sandbox, &run);
    let recorded = frames(&run);
    assert!(recorded[0].row.outcome_count > 0);
    recorder(&sandbox, &["simulate", &run, "--commands", &run, "-o", &changed]).success();
    let new = frames(&changed);
    assert_eq!(new.len(), recorded.len());
    assert!(new.iter().zip(&recorded).all(|(one, other)| is_same(one, other)));
    // From step 0 of the scene, it lacks those before it.
    let late = ["simulate", &run, "--steps", "900", "--commands", &run];
    let refused = recorder(&sandbox, &late);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("earlier commands of its run"), "{refused:?}");
}

/// Simulates 500 steps of a rope with commands.
fn simulate_rope(sandbox: &Sandbox, name: &str, commands: &str) -> String {
    let file = sandbox.path(&format!("{name}.mcap"));
    let commands = sandbox.write(&format!("{name}.jsonl"), commands);
    let args = ["simulate", "rope", "--steps", "500", "--commands", &commands, "-o", &file];
    recorder(sandbox, &args).success();
    file
}

#[test]
fn a_change_in_the_step_of_a_rewind_comes_after_it() {
    let sandbox = Sandbox::new();
    let rewind = "{\"step\":250,\"kind\":\"rewind\",\"to_step\":100}\n";
    let (run, changed) = (simulate_rope(&sandbox, "a", rewind), sandbox.path("changed.mcap"));
    let set = "250:damping=0.1";
    recorder(&sandbox, &["simulate", &run, "--set", set, "-o", &changed]).success();
    let verified = recorder(&sandbox, &["verify", "--json", &changed]).json();
    assert_eq!(verified["verdict"], "identical", "{verified}");
    assert_eq!(index_of(&frames(&changed), "set").1, 251);

    let late = "{\"step\":500,\"kind\":\"rewind\",\"to_step\":100}\n";
    let run = simulate_rope(&sandbox, "b", late);
    let refused = recorder(&sandbox, &["simulate", &run, "--set", "500:damping=0.1"]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("would take effect in step 501"), "{refused:?}");
}

#[test]
fn new_commands_can_go_back_to_before_the_first_of_them() {
    let sandbox = Sandbox::new();
    let run = simulate_rope(&sandbox, "a", "{\"step\":1,\"kind\":\"unpin\",\"particle\":40}\n");
    let rewind = "{\"step\":450,\"kind\":\"rewind\",\"to_step\":100}\n";
    let (commands, changed) = (sandbox.write("d.jsonl", rewind), sandbox.path("changed.mcap"));
    let args = ["simulate", &run, "--commands", &commands, "-o", &changed, "--json"];
    let summary = recorder(&sandbox, &args).json();
    assert_eq!((&summary["applied"], &summary["rejected"]), (&1.into(), &0.into()), "{summary}");
    let direct = frames(&simulate_rope(&sandbox, "b", rewind));
    let new = frames(&changed);
    assert!(is_same(new.last().unwrap(), direct.last().unwrap()));
}

#[test]
fn settings_come_after_the_commands_of_a_file_in_the_same_step() {
    let sandbox = Sandbox::new();
    let run = simulate_rope(&sandbox, "a", "{\"step\":1,\"kind\":\"unpin\",\"particle\":40}\n");
    let [pin, strong, weak] = [
        "{\"step\":250,\"kind\":\"pin\",\"particle\":20}\n",
        "{\"step\":250,\"kind\":\"set\",\"parameter\":\"damping\",\"value\":0.5}\n",
        "{\"step\":250,\"kind\":\"set\",\"parameter\":\"damping\",\"value\":0.1}\n",
    ];
    let hash = |name: &str, lines: String, set: &[&str]| {
        let commands = sandbox.write(name, &lines);
        let args = [&["simulate", &run, "--commands", &commands, "--json"], set].concat();
        recorder(&sandbox, &args).json()["state_hash"].clone()
    };
    let expected = hash("all.jsonl", [pin, strong, weak].concat(), &[]);
    let added = hash("two.jsonl", [pin, strong].concat(), &["--set", "250:damping=0.1"]);
    assert_eq!(added, expected);
    assert_ne!(hash("two.jsonl", [pin, strong].concat(), &[]), expected);
}

#[test]
fn changes_without_a_place_in_the_recording_are_refused() {
    let sandbox = Sandbox::new();
    let (run, out) = (sandbox.path("run.mcap"), sandbox.path("out.mcap"));
    let last = record_mid_run(&sandbox, &run);
    let too_late = format!("{}:damping=0.5", last + 1);
    for (change, code, problem) in [
        (["--drop", "99"], 1, "has no outcome 99 (allowed: "),
        (["--set", "20:damping=0.5"], 1, "a change of step 20 has no effect: "),
        (["--set", &too_late], 1, "(allowed: 1"),
        (["--set", "damping=0.5"], 2, "it must be STEP:PARAMETER=VALUE"),
        (["--drop", "x"], 2, "whole number"),
    ] {
        let args = ["simulate", &run, change[0], change[1], "-o", &out];
        let refused = recorder(&sandbox, &args);
        assert_eq!(refused.code, Some(code), "{refused:?}");
        assert!(refused.stderr.contains(problem), "{refused:?}");
        assert!(!fs::exists(&out).unwrap());
    }
}

#[test]
fn a_change_without_a_recording_says_how_to_make_one() {
    let sandbox = Sandbox::new();
    for (args, expected) in [
        (
            &["curtain", "--steps", "48", "--set", "12:damping=1"][..],
            "--set changes a recording (ending in .mcap), and curtain is a scene. Record it first: `recorder \
             simulate curtain --steps 48 -o run.mcap`",
        ),
        (
            &["curtain", "--drop", "3"],
            "--drop changes a recording (ending in .mcap), and curtain is",
        ),
        (&["run.mcap", "--steps", "48", "--set", "12:damping=1"], "leave out --steps"),
    ] {
        let refused = recorder(&sandbox, &[&["simulate"], args].concat());
        assert_eq!(refused.code, Some(2), "{refused:?}");
        assert!(refused.stderr.contains(expected), "{refused:?}");
    }
}

#[test]
fn a_setting_that_every_scene_rejects_is_a_usage_error() {
    let sandbox = Sandbox::new();
    let run = simulate_rope(&sandbox, "a", "");
    for (change, expected) in [
        ("100:wind=[0,0,9]", "there is no such parameter (allowed: gravity, damping, "),
        ("100:damping=-5", "a value is out of its range (allowed: a number >= 0, "),
        ("100:gravity=-9", "a value is out of its range (allowed: three numbers, "),
    ] {
        let refused = recorder(&sandbox, &["simulate", &run, "--set", change]);
        assert_eq!(refused.code, Some(2), "{}", refused.stderr);
        assert!(refused.stderr.contains(expected), "{}", refused.stderr);
    }
    let applied = recorder(&sandbox, &["simulate", &run, "--set", "100:damping=5"]);
    assert_eq!((applied.code, applied.stderr.as_str()), (Some(0), ""));
}

#[test]
fn a_rejected_command_is_an_outcome_and_its_warning_names_the_allowed_values() {
    let sandbox = Sandbox::new();
    let lines = r#"{"step":100,"kind":"set","parameter":"wind","value":1}
        {"step":100,"kind":"pin","particle":9999}
        {"step":100,"kind":"move_anchor","anchor":0,"translation":[0,0,0],"rotation":[0,0,0,1]}"#;
    let commands = sandbox.write("b.jsonl", lines);
    let done = recorder(&sandbox, &["simulate", "rope", "--steps", "480", "--commands", &commands]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    for expected in [
        "unknown_parameter: there is no such parameter (allowed: gravity, damping, ",
        "unknown_particle: the scene has no such particle (allowed: 0 to ",
        "unknown_anchor: the scene has no such anchor (it has none)",
    ] {
        assert!(done.stderr.contains(expected), "{}", done.stderr);
    }
}

#[test]
fn contacts_that_were_left_out_are_reported() {
    let sandbox = Sandbox::new();
    let contact = "version = 1\n[contact]\nmode = \"particles\"\nthickness = 0.1\n";
    let pile = contact.to_owned() + &"[[particle]]\nposition = [0, 0, 0]\n".repeat(100);
    let simulated = |name: &str, text: &str| {
        let scene = sandbox.write(name, text);
        let Finished { code, stderr, .. } =
            recorder(&sandbox, &["simulate", &scene, "--steps", "3"]);
        assert_eq!(code, Some(0), "{stderr}");
        stderr
    };
    // A pile of 100 has 4,950 pairs, and at most 800 are considered.
    let warning = simulated("pile.toml", &pile);
    assert!(warning.contains("from step 1 on, the particles were piled up"), "{warning}");
    let pair = contact.to_owned() + &"[[particle]]\nposition = [0, 0, 0]\n".repeat(2);
    let quiet = simulated("pair.toml", &pair);
    assert!(!quiet.contains("piled up"), "{quiet}");
}
