//! The rows besides the snapshots: tears with their causes, colliders and events match the
//! simulation, and a changed row is reported.

use crate::log::{
    BendColumns, ColliderBodyRow, ColliderDetails, Message, SceneColliders, TearsRow, TopologyRow,
};
use sim_messages::{BlockValue, Parameter, ParticleFlags, PlainF32};
use sim_solver::Scene;

use super::commands::{COMMANDS, SCENE, STEPS, collect, job, job_of};
use super::{check, rebuild, record};
use crate::verification::Verdict;

fn tears(file: &[u8]) -> Vec<TearsRow> {
    collect(file, |message| match message {
        Message::Tears(row) => Some(row.clone()),
        _ => None,
    })
}

#[test]
fn bends_that_are_not_those_of_the_scene_are_found() {
    let (file, _) = record(&job(COMMANDS));
    let changed = |change: fn(&mut BendColumns)| {
        let file = rebuild(&file, |message| match message {
            Message::Topology(mut row) => {
                change(&mut row.bends);
                Some(Message::Topology(row))
            }
            other => Some(other),
        });
        check(&file).0.to_string()
    };
    assert!(!changed(|_| {}).contains("/topology"));
    let changes: [fn(&mut BendColumns); 7] = [
        |bends| bends.particles[4 * 3] ^= 1,
        |bends| bends.coefficients[4 * 3].0 += 0.5,
        |bends| bends.geometry[3].0 += 0.5,
        |bends| bends.rigidity[3].0 += 0.5,
        |bends| bends.rest[3].0 += 0.5,
        |bends| bends.shape[3] += 1,
        |bends| bends.block[3] += 1,
    ];
    for change in changes {
        let report = changed(change);
        assert!(report.contains("/topology: bend 3 is not that of the scene"), "{report}");
    }
    let report = changed(|bends| bends.shape.truncate(3));
    assert!(report.contains("/topology: the columns of its bends differ in length"), "{report}");
}

#[test]
fn tears_are_recorded_with_their_causes_and_start_again_after_a_reset() {
    let (file, _) = record(&job(COMMANDS));
    let rows = tears(&file);
    assert!(rows.iter().all(|row| row.constraints.len() == row.causes.len()));
    let find = |step| rows.iter().find(|row| row.step == step).unwrap();
    assert_eq!(
        (&find(5).constraints[..], &find(5).causes[..]),
        (&[40][..], &["cut".to_owned()][..])
    );
    assert!(find(7).constraints.len() > 1 && find(9).constraints.len() > 1);
    assert_eq!(find(90).constraints, [9], "the reset discards a cut before it");
    let causes: Vec<_> = rows.iter().flat_map(|row| &row.causes).collect();
    for cause in ["cut", "stretch"] {
        assert!(causes.iter().any(|one| *one == cause), "{causes:?}");
    }
    let torn_counts = collect(&file, |message| match message {
        Message::Step(row) => Some(row.torn_count as usize),
        _ => None,
    });
    let mut torn_count = 0;
    for (step, found) in (0_u64..).zip(torn_counts) {
        // A reset, and rewinds, whose rows have all torn constraints of the earlier state.
        torn_count = if [90, 100, 104, 106].contains(&step) { 0 } else { torn_count };
        let new = rows.iter().filter(|row| row.step == step);
        torn_count += new.map(|row| row.constraints.len()).sum::<usize>();
        assert_eq!(found, torn_count, "step {step}");
    }
}

#[test]
fn colliders_are_recorded_when_they_change() {
    let steps_of = |scene: &str, commands: &str| {
        collect(&record(&job_of(scene, commands)).0, |message| match message {
            Message::Colliders(row) => Some(row.step),
            _ => None,
        })
    };
    let all: Vec<_> = (0..=STEPS).collect();
    assert_eq!(steps_of(SCENE, ""), all, "one rotates");
    let still = SCENE.replace("angular_velocity = [0, 2, 0]", "");
    assert_eq!(steps_of(&still, ""), [0]);
    let moved = r#"{"step":20,"kind":"move_collider","collider":2,"translation":[0,0,0.4]}
        {"step":50,"kind":"reset"}"#;
    assert_eq!(steps_of(&still, moved), [0, 20, 21, 50], "it moves, stops, and returns");
    let none = &still[..still.find("[[collider]]").unwrap()];
    assert_eq!(steps_of(none, ""), [] as [u64; 0]);
}

#[test]
fn a_changed_row_of_tears_or_colliders_is_reported_with_its_step() {
    let (file, _) = record(&job(COMMANDS));
    let with = |change: fn(Message) -> Message| check(&rebuild(&file, |one| Some(change(one)))).0;
    let report = with(|message| match message {
        Message::Tears(mut row) if row.step == 5 => {
            row.constraints[0] = 41;
            Message::Tears(row)
        }
        other => other,
    });
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(5)));
    let what = "recorded constraint 41 (cut), simulated constraint 40 (cut)";
    assert!(report.to_string().contains(what), "{report}");
    let report = with(|message| match message {
        Message::Tears(mut row) if row.step == 7 => {
            row.causes[0] = "force".to_owned();
            Message::Tears(row)
        }
        other => other,
    });
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(7)), "{report}");
    let report = with(|message| match message {
        Message::Tears(mut row) if row.step == 9 => {
            row.constraints.truncate(1);
            Message::Tears(row)
        }
        other => other,
    });
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(9)), "{report}");
    let report = with(|message| match message {
        Message::Colliders(mut row) if row.step == 17 => {
            row.colliders[0].friction.0 = 0.5;
            Message::Colliders(row)
        }
        other => other,
    });
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(17)), "{report}");
    assert!(report.to_string().contains("collider 0"), "{report}");
    let report = with(|message| match message {
        Message::Step(mut row) if row.step == 12 => {
            row.torn_count += 1;
            Message::Step(row)
        }
        other => other,
    });
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(12)), "{report}");
    assert!(report.to_string().contains("torn_count"), "{report}");
}

#[test]
fn one_row_may_hold_the_tears_of_several_steps() {
    let (file, _) = record(&job(COMMANDS));
    let mut missed = None;
    let late = rebuild(&file, |message| match message {
        Message::Tears(row) if row.step == 5 => {
            missed = Some(row);
            None
        }
        Message::Tears(mut row) => {
            if let Some(missed) = missed.take() {
                row.constraints.splice(..0, missed.constraints);
                row.causes.splice(..0, missed.causes);
            }
            Some(Message::Tears(row))
        }
        other => Some(other),
    });
    let (report, _) = check(&late);
    assert_eq!(report.verdict, Verdict::Identical, "{report}");
}

#[test]
fn each_time_a_particle_freezes_there_is_an_event() {
    // A constraint that is far too long pushes its ends out of the range of f32.
    let text = "version = 1\n[solver]\nmax_speed = 3e38\n\
        [[particle]]\nposition = [0, 0, 0]\n[[particle]]\nposition = [1, 0, 0]\n\
        [[constraint]]\nparticles = [0, 1]\nrest_length = 1e30\n";
    let (file, _) = record(&job_of(text, r#"{"step":60,"kind":"reset"}"#));
    let events = collect(&file, |message| match message {
        Message::Event(row) => Some((row.step, row.kind.clone(), row.particle)),
        _ => None,
    });
    let mut before = [0; 2];
    let expected = collect(&file, |message| match message {
        Message::Particles { step, particles } => {
            let flags = [0, 1].map(|index: usize| particles[index].flags & ParticleFlags::FROZEN);
            let before = std::mem::replace(&mut before, flags);
            let new = (0..2_u32).filter(|index| {
                let index = *index as usize;
                flags[index] != 0 && before[index] == 0
            });
            Some(new.map(|index| (*step, "frozen".to_owned(), Some(index))).collect::<Vec<_>>())
        }
        _ => None,
    });
    assert_eq!(events, expected.concat());
    assert!(events.iter().any(|(step, ..)| *step < 60), "{events:?}");
    assert!(events.iter().any(|(step, ..)| *step > 60), "{events:?}");
    assert_eq!(check(&file).0.verdict, Verdict::Identical);
}

#[test]
fn a_recording_that_starts_in_a_torn_scene_is_bit_identical() {
    let (file, _) = record(&job(COMMANDS));
    // The constraints that tore before a step.
    let torn = |until: u64| {
        let rows = tears(&file).into_iter().filter(|row| row.step < until);
        rows.flat_map(|row| row.constraints).collect::<Vec<_>>()
    };
    let verify_from = |first_step: u64, torn: Vec<u32>| {
        let part = rebuild(&file, |message| match message {
            Message::Topology(row) => {
                Some(Message::Topology(TopologyRow { torn: torn.clone(), ..row }))
            }
            Message::Surface(row) => Some(Message::Surface(row)),
            other => (other.step() >= first_step).then_some(other),
        });
        check(&part).0
    };
    for first_step in [9, 13] {
        let report = verify_from(first_step, torn(first_step));
        let steps = STEPS - first_step;
        let expected = format!("{steps} steps bit-identical ({first_step}..={STEPS})");
        assert_eq!(report.to_string(), expected);
        let report = verify_from(first_step, Vec::new());
        assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(first_step)));
        assert!(
            report.to_string().contains("torn constraints in /topology and /tears differ"),
            "{report}"
        );
    }
}

#[test]
fn parameters_are_recorded_at_the_start_and_after_each_change() {
    let (file, _) = record(&job(COMMANDS));
    let rows = collect(&file, |message| match message {
        Message::Parameters(row) => Some(row.clone()),
        _ => None,
    });
    assert_eq!(rows[0].step, 0);
    assert_eq!(rows[0].values.optional(Parameter::TearForce), Some(400.0));
    let gravity = |step| {
        let row = rows.iter().rfind(|row| row.step <= step).unwrap();
        row.values.vector(Parameter::Gravity)
    };
    assert_eq!(gravity(29), [0.0, -9.81, 0.0]);
    assert_eq!((rows[1].step, gravity(30)), (30, [0.0, -5.0, 0.0]));
    assert_eq!(gravity(31), [0.0; 3], "off");
    assert_eq!(gravity(90), [0.0, -9.81, 0.0], "a reset");
    assert!(rows.windows(2).all(|pair| pair[0].values != pair[1].values));

    let changed = rebuild(&file, |message| match message {
        Message::Parameters(mut row) if row.step == 32 => {
            row.values = row.values.with(Parameter::Damping, 0.75);
            Some(Message::Parameters(row))
        }
        other => Some(other),
    });
    let (report, _) = check(&changed);
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(32)), "{report}");
    assert!(report.to_string().contains("parameter damping: recorded"), "{report}");
}

#[test]
fn the_bending_of_a_block_that_the_simulation_has_not_is_found() {
    let (file, _) = record(&job(COMMANDS));
    let with_blocks = |blocks: &[BlockValue]| {
        let changed = rebuild(&file, |message| match message {
            Message::Parameters(mut row) if row.step == 54 => {
                assert_eq!(row.values.bending_by_block, [BlockValue { block: 0, value: 0.03 }]);
                row.values.bending_by_block = blocks.to_vec();
                Some(Message::Parameters(row))
            }
            other => Some(other),
        });
        check(&changed).0
    };
    let of = |block, value| BlockValue { block, value };
    for (blocks, text) in [
        (&[][..], "bending of block 0: recorded none, simulated 0.03"),
        (&[of(0, 0.04)], "bending of block 0: recorded 0.04, simulated 0.03"),
        (&[of(0, 0.03), of(1, 0.1)], "bending of block 1: recorded 0.1, simulated none"),
    ] {
        let report = with_blocks(blocks);
        assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(54)), "{report}");
        assert!(report.to_string().contains(text), "{report}");
    }
    assert_eq!(with_blocks(&[of(0, 0.03)]).verdict, Verdict::Identical);
}

/// A triangle of another program, which a body moves, and a particle.
const MESH_SCENE: &str = "version = 1\n[[particle]]\nposition = [0, 1, 0]\n[[collider]]\nshape = \"mesh\"\n\
    vertices = [[0.25, 0, 0], [1, 0, 0], [0, 0, 1]]\nfaces = [[0, 1, 2]]\n\
    body = { mass = 2, inertia = [1, 2, 3] }\n";

#[test]
fn rows_of_colliders_name_the_mesh_and_the_body() {
    let (file, _) = record(&job_of(MESH_SCENE, ""));
    let rows = collect(&file, |message| match message {
        Message::Colliders(row) => Some(row.colliders[0].details.clone()),
        _ => None,
    });
    let scene = Scene::from_toml(MESH_SCENE, "test").unwrap();
    let path = Some(SceneColliders::new(&scene).files[0].name.clone());
    let body = ColliderBodyRow { mass: PlainF32(2.0), inertia: [1.0, 2.0, 3.0].map(PlainF32) };
    let details = ColliderDetails { path, solid: Some(false), body: Some(body) };
    assert!(!rows.is_empty() && rows.iter().all(|one| *one == details), "{rows:?}");
}
