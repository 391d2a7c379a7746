//! Forces: recorded on request, for each step, and compared with the simulation.

use std::sync::atomic::AtomicBool;

use crate::log::{ContentSelection, ForcesRow, LogOptions, LogWriter, Message, SceneColliders};
use sim_messages::PlainF32;
use sim_solver::Solver;

use super::commands::{COMMANDS, STEPS, collect, job};
use super::{check, finish, rebuild, record};
use crate::simulation::{States, simulate};
use crate::verification::Verdict;

/// Records the scene with every feature, on a number of threads.
fn record_forces(threads: usize) -> Vec<u8> {
    let job = job(COMMANDS);
    let mut solver = Solver::new(&job.scene);
    solver.set_threads(threads);
    solver.compute_forces(true);
    let (run, scene) = (job.description(&solver), job.scene.to_toml());
    let selection = ContentSelection { has_forces: true, ..ContentSelection::default() };
    let options = LogOptions { selection, ..LogOptions::default() };
    let mut log = LogWriter::create(Vec::new(), options, &run, scene.as_bytes(), 0).unwrap();
    log.describe_colliders(&SceneColliders::new(&job.scene)).unwrap();
    simulate(&job, States::first(solver), Some(&mut log), &AtomicBool::new(false), |_| {}).unwrap();
    finish(log, 0)
}

fn rows(file: &[u8]) -> Vec<ForcesRow> {
    collect(file, |message| match message {
        Message::Forces(row) => Some(row.clone()),
        _ => None,
    })
}

#[test]
fn each_step_has_its_forces_with_the_same_bytes_for_any_number_of_threads() {
    let file = record_forces(1);
    let rows = rows(&file);
    let steps: Vec<_> = rows.iter().map(|row| row.step).collect();
    assert_eq!(steps, (1..=STEPS).collect::<Vec<_>>());
    assert!(rows.iter().all(|row| (row.colliders.len(), row.anchors.len()) == (4, 1)));
    let has_force = |one: &[PlainF32; 3]| one.iter().any(|number| number.0 != 0.0);
    assert!(rows.iter().any(|row| row.colliders.iter().any(|one| has_force(&one.impulse))));
    assert!(rows.iter().any(|row| has_force(&row.anchors[0].impulse)));
    assert!(rows.iter().all(|row| row.particles.starts_with(&[0, 1])), "the anchored particles");
    assert_eq!(record_forces(2), file);
    let (report, _) = check(&file);
    assert_eq!(report.verdict, Verdict::Identical, "{report}");
}

#[test]
fn forces_change_no_other_message() {
    let (without, _) = record(&job(COMMANDS));
    let messages = |file: &[u8]| {
        collect(file, |message| (!matches!(message, Message::Forces(_))).then(|| message.clone()))
    };
    let file = record_forces(1);
    assert_eq!(messages(&file), messages(&without));
    assert!(rows(&without).is_empty());
}

#[test]
fn changed_forces_are_reported_with_their_step() {
    type Change = fn(&mut ForcesRow);
    let changes: [(Change, &str); 6] = [
        (|row| row.colliders[1].impulse[0].0 += 0.5, "collider 1 ["),
        (|row| row.colliders[2].angular_impulse[2].0 += 0.5, "collider 2 ["),
        (|row| row.colliders[0].contacts += 1, " contacts, simulated collider 0"),
        (|row| row.anchors[0].impulse[1].0 += 0.5, "anchor 0 ["),
        (|row| row.impulses[1][2].0 += 0.5, "particle 1 ["),
        (|row| _ = row.impulses.pop(), "differ in number"),
    ];
    let file = record_forces(1);
    for (change, text) in changes {
        let changed = rebuild(&file, |message| match message {
            Message::Forces(mut row) if row.step == 60 => {
                change(&mut row);
                Some(Message::Forces(row))
            }
            other => Some(other),
        });
        let (report, _) = check(&changed);
        assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(60)), "{report}");
        assert!(report.to_string().contains(text), "{report}");
    }
}

#[test]
fn forces_of_a_part_of_a_run_are_compared() {
    let file = record_forces(1);
    // A recorder that joins the forces later than everything else.
    let late = rebuild(&file, |message| match message {
        Message::Forces(row) if row.step < 40 => None,
        other => Some(other),
    });
    assert_eq!(rows(&late).len() as u64, STEPS - 39);
    let (report, _) = check(&late);
    assert_eq!(report.verdict, Verdict::Identical, "{report}");
}
