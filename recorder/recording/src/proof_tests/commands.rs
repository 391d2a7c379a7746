//! Every kind of command, on a scene with every feature: recorded, re-simulated and repeated from
//! the log. Missing and wrong commands are reported.

use std::sync::atomic::AtomicBool;

use crate::log::{LogReader, Message, OutcomeRow, parse_commands};
use serde_json::json;
use sim_messages::{ACTIONS, ActionInfo, PARAMETERS, ParameterInfo};
use sim_solver::Scene;

use super::{ALL, check, rebuild, record};
use crate::simulation::Job;
use crate::verification::{Verdict, verify};

/// A cloth between two anchors, in the wind, above a floor and beside a rotating box.
pub(super) const SCENE: &str = r#"
version = 1
[solver]
tethers = true
tear_force = 400
max_stretch = 2
[wind]
velocity = [1, 0, 2]
drag = 0.05
gust = 0.5
[[particle]]
position = [0, 1, 0]
[[particle]]
position = [0.7, 1, 0]
[[anchor]]
particles = [0, 1]
repeat = true
path = [{ time = 0 }, { time = 0.5, translation = [0, 0.1, 0.1] }, { time = 1 }]
[[generate]]
shape = "cloth"
columns = 8
rows = 8
spacing = 0.1
origin = [0, 0.9, 0]
mass = 0.01
pinned = "none"
tear_stretch = 1.4
compliance = { structural = 1e-5, shear = 1e-4 }
bending = 0.02
[[bend]]
particles = [0, 2, 3]
rigidity = 0.01
[[constraint]]
particles = [0, 2]
[[constraint]]
particles = [1, 9]
tear_distance = 0.3
compliance = 1e-3
[[collider]]
shape = "plane"
normal = [0, 1, 0]
offset = -0.1
friction = 0.4
[[collider]]
shape = "box"
center = [0.35, 0.2, 0.3]
half_extents = [0.1, 0.1, 0.1]
angular_velocity = [0, 2, 0]
[[collider]]
shape = "sphere"
center = [0.35, 0.5, -0.3]
radius = 0.1
[[collider]]
shape = "sphere"
center = [0.35, 0.6, 0.2]
radius = 0.1
body = { mass = 0.05, inertia = [0.0002, 0.0002, 0.0002] }
"#;

/// Every kind of command. The tests below refer to the lines by step.
pub(super) const COMMANDS: &str = r#"
    {"step":3,"kind":"push","center":[0.3,0.5,0],"radius":0.3,"delta":[0,0,0.02],"limit":0.01}
    {"step":5,"kind":"cut","constraint":40}
    {"step":7,"kind":"cut_radius","center":[0.7,0.2,0],"radius":0.12}
    {"step":9,"kind":"cut_segment","from":[-0.05,0.4,0],"to":[0.25,0.4,0],"direction":[0,0,1]}
    {"step":11,"kind":"move_anchor","anchor":0,"translation":[0.05,0,0.05]}
    {"step":13,"kind":"move_collider","collider":2,"translation":[0,0,0.4],"rotation":[0,0,1,1]}
    {"step":12,"kind":"move_collider","collider":1,"translation":[0,0.1,0],"over_s":0.3}
    {"step":14,"kind":"drive_body","collider":3,"translation":[0,0,-0.15],"velocity":[0,0,-1]}
    {"step":15,"kind":"grab","particle":60,"target":[0.5,0.2,0.3],"over_s":0.1}
    {"step":17,"kind":"move","particle":60,"target":[0.5,0.5,0.8]}
    {"step":19,"kind":"pause"}
    {"step":20,"kind":"resume"}
    {"step":21,"kind":"step","count":3}
    {"step":22,"kind":"load","scene":"rope"}
    {"step":30,"kind":"set","parameter":"gravity","value":[0,-5,0]}
    {"step":31,"kind":"set","parameter":"gravity","value":null}
    {"step":32,"kind":"set","parameter":"damping","value":0.5}
    {"step":33,"kind":"set","parameter":"damping","value":null}
    {"step":34,"kind":"set","parameter":"wind.velocity","value":[3,0,0]}
    {"step":35,"kind":"set","parameter":"wind.velocity","value":null}
    {"step":36,"kind":"set","parameter":"wind.drag","value":0.2}
    {"step":37,"kind":"set","parameter":"wind.drag","value":null}
    {"step":38,"kind":"set","parameter":"substeps","value":3}
    {"step":39,"kind":"set","parameter":"iterations","value":2}
    {"step":40,"kind":"set","parameter":"relaxation","value":0.9}
    {"step":41,"kind":"set","parameter":"max_stretch","value":1.2}
    {"step":42,"kind":"set","parameter":"max_stretch","value":null}
    {"step":43,"kind":"set","parameter":"tear_stretch","value":3}
    {"step":44,"kind":"set","parameter":"tear_stretch","value":null}
    {"step":45,"kind":"set","parameter":"tear_distance","value":2}
    {"step":46,"kind":"set","parameter":"tear_distance","value":null}
    {"step":47,"kind":"set","parameter":"tear_force","value":300}
    {"step":48,"kind":"set","parameter":"tear_force","value":null}
    {"step":49,"kind":"set","parameter":"max_speed","value":200}
    {"step":50,"kind":"set","parameter":"time_scale","value":0.5}
    {"step":51,"kind":"set","parameter":"compliance","value":1e-4,"constraint_kind":"structural"}
    {"step":52,"kind":"set","parameter":"compliance","value":1e-5}
    {"step":53,"kind":"set","parameter":"stiffness","value":0.5}
    {"step":54,"kind":"set","parameter":"bending","value":0.001}
    {"step":54,"kind":"set","parameter":"bending","value":0.03,"block":0}
    {"step":55,"kind":"set","parameter":"contact.thickness","value":0.05}
    {"step":56,"kind":"set","parameter":"contact.friction","value":0.5}
    {"step":56,"kind":"set","parameter":"friction","value":0.125}
    {"step":57,"kind":"set","parameter":"friction","value":0.75,"collider":1}
    {"step":57,"kind":"set","parameter":"restitution","value":0.5,"collider":0}
    {"step":58,"kind":"set","parameter":"contact.thickness","value":null}
    {"step":58,"kind":"follow","object":"particle","object_index":60,"path":[{"time":0,"translation":[0.5,0.5,0.8]},{"time":0.5,"translation":[0.6,0.5,0.8]}]}
    {"step":58,"kind":"follow","object":"anchor","object_index":0,"path":[{"time":0.05,"translation":[0,0.1,0]},{"time":0.1,"translation":[0,0,0],"rotation":[0,0,0.1,1]},{"time":0.15,"translation":[0,0.1,0]},{"time":0.2,"translation":[0,0,0]},{"time":0.25,"translation":[0,0,0.1]}]}
    {"step":59,"kind":"follow","object":"collider","object_index":2,"path":[{"time":1,"translation":[0,0,0.2]}]}
    {"step":60,"kind":"release","particle":60}
    {"step":61,"kind":"mark","text":"the sleeve slips"}
    {"step":61,"kind":"mark","text":""}
    {"step":62,"kind":"grab","particle":61,"target":[0.5,0.2,0.3],"client_id":9}
    {"step":66,"kind":"release","particle":61,"client_id":8}
    {"step":67,"kind":"release","particle":61,"client_id":8,"force":true}
    {"step":70,"kind":"pin","particle":33}
    {"step":80,"kind":"unpin","particle":33}
    {"step":90,"kind":"cut","constraint":7}
    {"step":90,"kind":"reset"}
    {"step":90,"kind":"cut","constraint":9}
    {"step":95,"kind":"set","parameter":"gravity","value":[0,-3,0],"client_id":7}
    {"step":100,"kind":"rewind","to_step":64}
    {"step":100,"kind":"pin","particle":35}
    {"step":104,"kind":"rewind","to_step":102}
    {"step":106,"kind":"rewind","to_step":0}
    {"step":108,"kind":"rewind","to_step":108}
    {"step":109,"kind":"rewind","back_steps":3}
    {"step":110,"kind":"restore","contents":"motion","state_hash":"0000000000000000"}
"#;
pub(super) const STEPS: u64 = 130;

pub(super) fn job(commands: &str) -> Job {
    job_of(SCENE, commands)
}

pub(super) fn job_of(scene: &str, commands: &str) -> Job {
    let scene = Scene::from_toml(scene, "proof").unwrap();
    Job::new(scene, parse_commands(commands, "test").unwrap(), STEPS)
}

/// Collects the values that `pick` returns for the messages of a recording.
pub(super) fn collect<T>(file: &[u8], mut pick: impl FnMut(&Message) -> Option<T>) -> Vec<T> {
    let mut values = Vec::new();
    rebuild(file, |message| {
        values.extend(pick(&message));
        Some(message)
    });
    values
}

fn outcomes(file: &[u8]) -> Vec<OutcomeRow> {
    collect(file, |message| match message {
        Message::Outcome(row) => Some(row.clone()),
        _ => None,
    })
}

#[test]
fn every_kind_of_command_is_recorded_verified_and_repeated_from_its_log() {
    let (file, summary) = record(&job(COMMANDS));
    let (report, _) = check(&file);
    assert_eq!(report.to_string(), format!("{STEPS} steps bit-identical (0..={STEPS})"));
    assert!(record(&job(COMMANDS)).0 == file, "equal inputs give equal files");

    let rows = outcomes(&file);
    let rejected = rows.iter().filter(|row| !row.is_applied());
    let rejected: Vec<_> = rejected.map(|row| (row.step, row.reason.as_str())).collect();
    let expected = [
        // A load belongs to another file, and this scene has no stiffness.
        (22, "no_effect_here"),
        (53, "no_effect_here"),
        // A mark without a text.
        (61, "out_of_range"),
        (66, "grabbed_by_other"),
        // A rewind goes to an earlier step that it names, and a restore needs a state.
        (108, "out_of_range"),
        (109, "no_effect_here"),
        (110, "no_effect_here"),
    ];
    assert_eq!(rejected, expected);
    for ActionInfo { name: kind, .. } in ACTIONS {
        assert!(COMMANDS.contains(&format!("\"kind\":\"{kind}\"")), "{kind} is not proved");
    }

    let lines: Vec<_> = rows.iter().map(|row| serde_json::to_string(row).unwrap()).collect();
    let (again, repeated) = record(&job(&lines.join("\n")));
    assert_eq!(repeated, summary);
    assert!(again == file, "the log reproduces its recording");
}

#[test]
fn every_parameter_is_proved() {
    let set = |(step, info): (u64, &ParameterInfo)| {
        let (name, value) = (info.name, info.default);
        json!({ "step": step, "kind": "set", "parameter": name, "value": value }).to_string()
    };
    let lines: Vec<_> = (1..).zip(&PARAMETERS).map(set).collect();
    let (report, _) = check(&record(&job(&lines.join("\n"))).0);
    assert_eq!(report.verdict, Verdict::Identical, "{report}");
}

#[test]
fn a_request_to_stop_interrupts_the_verification_within_a_step() {
    let (file, _) = record(&job(COMMANDS));
    let log = LogReader::new(file.as_slice()).unwrap();
    let report = verify(log, ALL, &AtomicBool::new(true), |_| {}).unwrap();
    assert_eq!((report.verdict, report.steps_identical), (Verdict::Interrupted, 0));
}

#[test]
fn every_missing_command_is_reported() {
    let (file, _) = record(&job(COMMANDS));
    let rows = outcomes(&file);
    for missing in rows.iter().filter(|row| row.is_applied()) {
        let without = rebuild(&file, |message| match message {
            Message::Outcome(row) if row.index == missing.index => None,
            other => Some(other),
        });
        let (report, _) = check(&without);
        assert_eq!(report.verdict, Verdict::OutcomeLogIncomplete, "{missing:?}");
        assert_eq!(report.step, Some(missing.step), "{missing:?}");
    }
}

#[test]
fn a_removed_command_with_a_renumbered_log_is_reported_where_it_shows() {
    let (file, _) = record(&job(COMMANDS));
    // The remaining outcomes are renumbered, as a forger would do.
    for left_out in [3, 5, 7, 9, 11, 13, 15, 30, 34, 38, 51, 70, 95] {
        let mut removed = None;
        let forged = rebuild(&file, |message| match message {
            Message::Outcome(row) if row.step == left_out && row.is_applied() => {
                removed = Some(row.index);
                None
            }
            Message::Outcome(mut row) => {
                row.index -= u64::from(removed.is_some());
                Some(Message::Outcome(row))
            }
            Message::Step(mut row) => {
                row.outcome_count -= u64::from(removed.is_some());
                Some(Message::Step(row))
            }
            other => Some(other),
        });
        let (report, _) = check(&forged);
        assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(left_out)), "{report}");
    }
}

#[test]
fn a_load_that_was_rejected_or_ended_the_file_is_not_a_divergence() {
    let (file, _) = record(&job(COMMANDS));
    let refused = rebuild(&file, |message| match message {
        Message::Outcome(mut row) if row.step == 22 => {
            row.reason = "out_of_range".to_owned();
            Some(Message::Outcome(row))
        }
        other => Some(other),
    });
    assert_eq!(check(&refused).0.verdict, Verdict::Identical);
    // The snapshot that shows a load belongs to another file.
    let ended = rebuild(&file, |message| match message {
        Message::Outcome(mut row) if row.step == 22 => {
            (row.status, row.reason) = ("applied".to_owned(), String::new());
            Some(Message::Outcome(row))
        }
        other => (other.step() < 22).then_some(other),
    });
    assert_eq!(check(&ended).0.to_string(), "21 steps bit-identical (0..=21)");
}

#[test]
fn wrong_values_are_rejected_with_their_reason_and_change_nothing() {
    let wrong = [
        (r#""kind":"pin","particle":66"#, "unknown_particle"),
        (r#""kind":"release","particle":5"#, "not_grabbed"),
        (r#""kind":"grab","particle":5,"target":["nan",0,0]"#, "non_finite"),
        (r#""kind":"grab","particle":5,"target":[2e7,0,0]"#, "out_of_range"),
        (r#""kind":"push","center":[0,0,0],"radius":-1,"delta":[0,0,0]"#, "out_of_range"),
        (r#""kind":"push","center":[0,0,0],"radius":1,"delta":["inf",0,0]"#, "non_finite"),
        (r#""kind":"push","center":[0,0,0],"radius":1,"delta":[0,0,0],"limit":-1"#, "out_of_range"),
        (r#""kind":"cut","constraint":4000"#, "unknown_constraint"),
        (r#""kind":"cut","constraint":40"#, "already_torn"),
        (r#""kind":"cut_radius","center":[0,"nan",0],"radius":1"#, "non_finite"),
        (r#""kind":"cut_radius","center":[0,0,0],"radius":-1"#, "out_of_range"),
        (r#""kind":"cut_segment","from":[0,0,0],"to":[1,0,0],"direction":[0,0,0]"#, "out_of_range"),
        (r#""kind":"move_anchor","anchor":1,"translation":[0,0,0]"#, "unknown_anchor"),
        (
            r#""kind":"move_anchor","anchor":0,"translation":[0,0,0],"rotation":[0,0,0,0]"#,
            "out_of_range",
        ),
        (r#""kind":"move_collider","collider":4,"translation":[0,0,0]"#, "unknown_collider"),
        (r#""kind":"move_collider","collider":0,"translation":["inf",0,0]"#, "non_finite"),
        (r#""kind":"drive_body","collider":4,"translation":[0,0,0]"#, "unknown_collider"),
        (r#""kind":"drive_body","collider":2,"translation":[0,0,0]"#, "no_effect_here"),
        (
            r#""kind":"drive_body","collider":3,"translation":[0,0,0],"velocity":[2e7,0,0]"#,
            "out_of_range",
        ),
        (
            r#""kind":"drive_body","collider":3,"translation":[0,0,0],"torque":[0,0,1e30]"#,
            "out_of_range",
        ),
        (
            r#""kind":"drive_body","collider":3,"translation":[0,0,0],"torque":["nan",0,0]"#,
            "non_finite",
        ),
        (r#""kind":"set","parameter":"colour","value":1"#, "unknown_parameter"),
        (r#""kind":"set","parameter":"gravity","value":1"#, "out_of_range"),
        (r#""kind":"set","parameter":"gravity","value":["nan",0,0]"#, "non_finite"),
        (r#""kind":"set","parameter":"substeps","value":1.5"#, "out_of_range"),
        (r#""kind":"set","parameter":"substeps","value":null"#, "out_of_range"),
        (r#""kind":"set","parameter":"max_stretch","value":0.5"#, "out_of_range"),
        (r#""kind":"set","parameter":"time_scale","value":0"#, "out_of_range"),
        (r#""kind":"set","parameter":"stiffness","value":0.5"#, "no_effect_here"),
        (
            r#""kind":"set","parameter":"damping","value":1,"constraint_kind":"bend""#,
            "out_of_range",
        ),
        (
            r#""kind":"set","parameter":"compliance","value":1,"constraint_kind":"silk""#,
            "out_of_range",
        ),
        (r#""kind":"load","scene":"curtain""#, "no_effect_here"),
        (r#""kind":"unknown","number":99"#, "no_effect_here"),
    ];
    let cut = r#"{"step":1,"kind":"cut","constraint":40}"#;
    let (clean, _) = record(&job(cut));
    let lines = wrong.map(|(fields, _)| format!("{{\"step\":2,{fields}}}"));
    let (file, _) = record(&job(&format!("{cut}\n{}", lines.join("\n"))));
    let rows = outcomes(&file);
    assert_eq!(rows.len(), wrong.len() + 1);
    for (row, (fields, reason)) in rows[1..].iter().zip(wrong) {
        assert_eq!((row.status.as_str(), row.reason.as_str()), ("rejected", reason), "{fields}");
    }
    let hashes = |file: &[u8]| {
        collect(file, |message| match message {
            Message::Step(row) => Some(row.state_hash),
            _ => None,
        })
    };
    assert_eq!(hashes(&file), hashes(&clean));
    assert_eq!(check(&file).0.verdict, Verdict::Identical);
}
