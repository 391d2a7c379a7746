//! `recorder diff`, with recordings whose differences are known.

use integration_tests::{Finished, Sandbox};
use serde_json::{Value, json};

use super::{frames, recorder};

/// Simulates 300 steps of a scene with commands.
fn simulate(sandbox: &Sandbox, name: &str, scene: &str, commands: &str) -> String {
    let file = sandbox.path(&format!("{name}.mcap"));
    let commands = sandbox.write(&format!("{name}.jsonl"), commands);
    let args = ["simulate", scene, "--steps", "300", "--commands", &commands, "-o", &file];
    recorder(sandbox, &args).success();
    file
}

fn diff(sandbox: &Sandbox, a: &str, b: &str) -> Finished {
    recorder(sandbox, &["diff", "--json", a, b])
}

fn report(sandbox: &Sandbox, a: &str, b: &str) -> Value {
    let finished = diff(sandbox, a, b);
    assert_eq!(finished.code, Some(3), "{finished:?}");
    serde_json::from_str(&finished.stdout).unwrap()
}

const PUSH: &str = "{\"step\":10,\"kind\":\"set\",\"parameter\":\"damping\",\"value\":0.5}\n";

#[test]
fn equal_recordings_have_no_difference() {
    let sandbox = Sandbox::new();
    let a = simulate(&sandbox, "a", "curtain", PUSH);
    let b = simulate(&sandbox, "b", "curtain", PUSH);
    let finished = diff(&sandbox, &a, &b);
    let report = finished.json();
    assert_eq!(report["first"], Value::Null, "{report}");
    assert_eq!((&report["common_steps"], &report["different_steps"]), (&json!(301), &json!(0)));
    assert_eq!(report["growth"], json!([]));
}

#[test]
fn the_first_different_command_and_state_are_named_and_the_distance_is_that_of_the_states() {
    let sandbox = Sandbox::new();
    let a = simulate(&sandbox, "a", "curtain", PUSH);
    let pin = format!("{PUSH}{{\"step\":120,\"kind\":\"pin\",\"particle\":100}}\n");
    let b = simulate(&sandbox, "b", "curtain", &pin);
    let report = report(&sandbox, &a, &b);
    assert_eq!(
        (&report["first"], &report["scene"]),
        (&json!("commands"), &Value::Null),
        "{report}"
    );
    assert_eq!(
        (&report["commands"]["step"], &report["commands"]["a"]),
        (&json!(120), &Value::Null)
    );
    assert_eq!(report["commands"]["b"]["kind"], "pin");
    assert_eq!((&report["state"]["step"], &report["different_steps"]), (&json!(120), &json!(181)));

    let (a, b) = (frames(&a), frames(&b));
    let greatest_at = |step: usize| {
        let pairs = a[step].payload().iter().zip(b[step].payload());
        let distances = pairs.map(|(a, b)| {
            let axes = a.position.iter().zip(b.position).map(|(a, b)| f64::from(*a) - f64::from(b));
            axes.map(|axis| axis * axis).sum::<f64>().sqrt()
        });
        distances.fold(0.0, f64::max)
    };
    let rows = report["growth"].as_array().unwrap();
    let steps: Vec<_> = rows.iter().map(|row| row["step"].as_u64().unwrap()).collect();
    assert_eq!(steps, [120, 121, 122, 124, 128, 136, 152, 184, 248, 300]);
    for row in rows {
        let step = usize::try_from(row["step"].as_u64().unwrap()).unwrap();
        let found = row["greatest_m"].as_f64().unwrap();
        assert!((found - greatest_at(step)).abs() <= 1e-12, "step {step}: {found}");
    }
    assert!(rows.last().unwrap()["greatest_m"].as_f64().unwrap() > 1e-5);
}

#[test]
fn a_different_scene_is_named_by_its_line() {
    let sandbox = Sandbox::new();
    let scene = |compliance: &str| {
        let text = format!(
            "version = 1\nname = \"rope\"\n[[generate]]\nshape = \"rope\"\ncount = 5\nfrom = [0, 0, 0]\n\
             to = [1, 0, 0]\ncompliance = {{ structural = {compliance} }}\n"
        );
        sandbox.write(&format!("rope{compliance}.toml"), &text)
    };
    let [a, b] = ["1e-6", "2e-6"].map(|one| simulate(&sandbox, one, &scene(one), PUSH));
    let report = report(&sandbox, &a, &b);
    assert_eq!(report["first"], "scene", "{report}");
    assert!(report["scene"]["a"].as_str().unwrap().starts_with("structural = "), "{report}");
    assert_eq!(report["commands"], Value::Null, "{report}");
    assert_eq!(report["state"]["step"], 1, "the first states are equal: {report}");
}

#[test]
fn recordings_that_cannot_be_compared_are_refused_with_the_reason() {
    let sandbox = Sandbox::new();
    let curtain = simulate(&sandbox, "a", "curtain", PUSH);
    let rope = simulate(&sandbox, "b", "rope", PUSH);
    let refused = diff(&sandbox, &curtain, &rope);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("have 168 and 41 particles"), "{refused:?}");
}
