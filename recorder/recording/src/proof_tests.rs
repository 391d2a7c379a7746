//! From a scene to a recording and back: equal simulations give equal bytes, an unchanged recording
//! verifies as bit-identical, and every change in a recording is reported at its step.
//!
//! Recordings are built in memory. Changed ones are rebuilt message by message.

mod commands;
mod edits;
mod forces;
mod live;
mod rows;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::complete_state::complete_state;
use crate::log::{
    Closing, Compression, LogEnd, LogOptions, LogReader, LogWriter, Message, OutcomeRow,
    SceneColliders, Tape, TimedCommand, Topic, parse_commands,
};
use sim_messages::{Action, StopFlag};
use sim_solver::{SOLVER_VERSION, Scene, Solver, builtin};

use crate::simulation::{Job, SimulationResult, States, simulate};
use crate::verification::{
    StepGap, StepRange, Verdict, VerifyError, VerifyOptions, VerifyReport, verify,
};

const COMMANDS: &str = r#"
    {"step":10,"kind":"grab","particle":90,"target":[0.5,0.2,0.3],"over_s":0.1}
    {"step":10,"kind":"grab","particle":90,"target":[0,0,0],"client_id":5}
    {"step":14,"kind":"move","particle":90,"target":[0.4,0.25,0.35]}
    {"step":20,"kind":"pause"}
    {"step":50,"kind":"pin","particle":160}
    {"step":70,"kind":"release","particle":90}
    {"step":90,"kind":"unpin","particle":160}
    {"step":100,"kind":"reset"}
    {"step":110,"kind":"pin","particle":4000}
"#;

/// All steps, on one thread.
const ALL: VerifyOptions =
    VerifyOptions { threads: 1, range: StepRange { start: 0, last: u64::MAX } };

fn job(scene: &str, commands: &str, steps: u64) -> Job {
    let scene = Scene::from_toml(builtin::text(scene).unwrap(), scene).unwrap();
    Job::new(scene, parse_commands(commands, "test").unwrap(), steps)
}

fn record(job: &Job) -> (Vec<u8>, SimulationResult) {
    record_with(job, Compression::default())
}

fn record_with(job: &Job, compression: Compression) -> (Vec<u8>, SimulationResult) {
    let solver = Solver::new(&job.scene);
    let (run, scene) = (job.description(&solver), job.scene.to_toml());
    // Small chunks, so that a truncated file still has some.
    let options = LogOptions { compression, chunk_size_bytes: 100_000, ..LogOptions::default() };
    let mut log = LogWriter::create(Vec::new(), options, &run, scene.as_bytes(), 0).unwrap();
    log.describe_colliders(&SceneColliders::new(&job.scene)).unwrap();
    let outcomes =
        simulate(job, States::first(solver), Some(&mut log), &AtomicBool::new(false), |_| {})
            .unwrap();
    (finish(log, 0), outcomes)
}

fn check(file: &[u8]) -> (VerifyReport, Option<LogEnd>) {
    let report = try_check(file).unwrap();
    let end = report.incomplete_end().cloned();
    (report, end)
}

fn try_check(file: &[u8]) -> Result<VerifyReport, VerifyError> {
    verify(LogReader::new(file).unwrap(), ALL, &AtomicBool::new(false), |_| {})
}

/// Rebuilds a recording. `change` returns the new message, or `None` to leave it out.
fn rebuild(file: &[u8], mut change: impl FnMut(Message) -> Option<Message>) -> Vec<u8> {
    let mut old = LogReader::new(file).unwrap();
    let (run, scene) = (old.run().clone(), old.scene().to_vec());
    let options = LogOptions { selection: old.selection(), ..LogOptions::default() };
    let mut new = LogWriter::create(Vec::new(), options, &run, &scene, 0).unwrap();
    while let Some(logged) = old.next_message().unwrap() {
        if let Some(message) = change(logged.message) {
            new.write(&message, logged.log_time_ns).unwrap();
        }
    }
    finish(new, 0)
}

/// Rebuilds a recording that lacks snapshots and declares it. `change` returns the new messages.
fn rebuild_with_gaps(
    file: &[u8],
    missing_count: u64,
    mut change: impl FnMut(Message) -> Vec<Message>,
) -> Vec<u8> {
    let mut old = LogReader::new(file).unwrap();
    let (run, scene) = (old.run().clone(), old.scene().to_vec());
    let options = LogOptions { selection: old.selection(), ..LogOptions::default() };
    let mut new = LogWriter::create(Vec::new(), options, &run, &scene, 0).unwrap();
    while let Some(logged) = old.next_message().unwrap() {
        for message in change(logged.message) {
            new.write(&message, logged.log_time_ns).unwrap();
        }
    }
    finish(new, missing_count)
}

/// Finishes a recording as `simulate` does, except for the reason and the missing snapshots.
fn finish(log: LogWriter<Vec<u8>>, missing_count: u64) -> Vec<u8> {
    let mut closing = Closing { counts: *log.counts(), ..Closing::default() };
    closing.counts.set_received_to_written();
    for topic in [Topic::Steps, Topic::Particles] {
        closing.counts[topic].gaps = missing_count;
    }
    log.finish(&closing).unwrap()
}

#[test]
fn equal_inputs_give_equal_files_and_different_inputs_different_runs() {
    let job_of = |commands| job("curtain", commands, 300);
    let (file, outcomes) = record(&job_of(COMMANDS));
    assert_eq!(record(&job_of(COMMANDS)), (file.clone(), outcomes.clone()));
    assert_eq!((outcomes.applied_count, outcomes.rejected_count), (7, 2));
    let run_id = |file: &[u8]| LogReader::new(file).unwrap().run().run_id;
    let (other, _) = record(&job_of(r#"{"step":10,"kind":"reset"}"#));
    assert_ne!(run_id(&file), run_id(&other));
}

#[test]
fn a_simulated_recording_is_complete_and_bit_identical() {
    for scene in ["curtain", "rope"] {
        let (file, outcomes) = record(&job(scene, COMMANDS, 300));
        let (report, end) = check(&file);
        assert_eq!(report.to_string(), "300 steps bit-identical (0..=300)");
        assert_eq!((report.verdict, end), (Verdict::Identical, None));
        assert_eq!(outcomes.steps, 300);
    }
}

#[test]
fn a_recording_of_the_c_libraries_is_read_and_proved_in_rust() {
    let read = |file: &[u8], is_in_rust| {
        let mut log = LogReader::new(file).unwrap();
        if is_in_rust {
            log.decompress_in_rust();
        }
        let messages: Vec<_> = std::iter::from_fn(|| log.next_message().unwrap()).collect();
        (messages, log.end().cloned().unwrap())
    };
    for compression in [Compression::Lz4, Compression::Zstd, Compression::ZstdSmallest] {
        let (mut file, _) = record_with(&job("curtain", COMMANDS, 200), compression);
        let whole = read(&file, true);
        assert!(whole.0.len() > 400 && whole.1 == LogEnd::Complete);
        assert!(whole == read(&file, false), "{compression:?}");
        let mut log = LogReader::new(file.as_slice()).unwrap();
        log.decompress_in_rust();
        let report = verify(log, ALL, &AtomicBool::new(false), |_| {}).unwrap();
        assert_eq!(report.to_string(), "200 steps bit-identical (0..=200)");
        let middle = file.len() / 2;
        file[middle] ^= 1;
        let (messages, end) = read(&file, true);
        assert!(matches!(end, LogEnd::Damaged { .. }), "{compression:?}: {end}");
        assert!(whole.0.starts_with(&messages));
    }
}

#[test]
fn a_recording_in_memory_is_read_at_any_step() {
    let (file, _) = record(&job("curtain", COMMANDS, 200));
    let mut tape = Tape::of_file(Arc::new(file), None, &mut |_, _| {}).unwrap();
    assert_eq!(tape.last_step(), 200);
    for step in [150, 0, 77] {
        let state = complete_state(&mut tape, step, u64::MAX, &StopFlag::default()).unwrap();
        assert_eq!(state.state_hash, tape.state_at(step).unwrap().row.state_hash);
    }
}

#[test]
fn the_outcomes_of_a_recording_are_a_command_file_that_reproduces_it() {
    let (file, _) = record(&job("curtain", COMMANDS, 200));
    let mut lines = String::new();
    rebuild(&file, |message| {
        if let Message::Outcome(row) = &message {
            lines += &serde_json::to_string(row).unwrap();
            lines += "\n";
        }
        Some(message)
    });
    let (again, _) = record(&job("curtain", &lines, 200));
    assert!(again == file, "the files differ");
}

#[test]
fn commands_are_applied_in_the_order_of_their_index() {
    let pin_then_unpin = r#"
        {"step":5,"kind":"unpin","particle":90,"index":1}
        {"step":5,"kind":"pin","particle":90,"index":0}"#;
    let (_, both) = record(&job("curtain", pin_then_unpin, 50));
    let unpin_then_pin = r#"
        {"step":5,"kind":"unpin","particle":90,"index":0}
        {"step":5,"kind":"pin","particle":90,"index":1}"#;
    let (_, pinned) = record(&job("curtain", unpin_then_pin, 50));
    assert_ne!(both.state_hash, pinned.state_hash);
}

#[test]
fn a_changed_command_is_reported_at_its_step() {
    let (file, _) = record(&job("curtain", COMMANDS, 200));
    let changed = rebuild(&file, |message| match message {
        Message::Outcome(mut row) if row.step == 50 => {
            row.action = Action::Pin { particle: 161 };
            Some(Message::Outcome(row))
        }
        other => Some(other),
    });
    let (report, _) = check(&changed);
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(50)));
    assert!(report.difference.is_some(), "{report}");
}

#[test]
fn a_changed_outcome_is_reported() {
    let (file, _) = record(&job("curtain", COMMANDS, 200));
    let changed = rebuild(&file, |message| match message {
        Message::Outcome(mut row) if row.step == 110 => {
            row.action = Action::Pin { particle: 4 };
            Some(Message::Outcome(row))
        }
        other => Some(other),
    });
    assert_eq!(
        check(&changed).0.to_string(),
        "step 110 differs: /outcomes: outcome 8: recorded rejected unknown_particle, simulated applied  \
         (109 steps before it bit-identical)"
    );
}

#[test]
fn one_flipped_bit_of_a_payload_is_reported_with_its_particle_and_field() {
    let (file, _) = record(&job("curtain", COMMANDS, 100));
    for (at, earlier) in [(0, 0), (37, 36), (100, 99)] {
        let changed = rebuild(&file, |mut message| {
            if let Message::Particles { step, particles } = &mut message
                && *step == at
            {
                let y = &mut particles[77].velocity[1];
                *y = f32::from_bits(y.to_bits() ^ 1);
            }
            Some(message)
        });
        let (report, _) = check(&changed);
        assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(at)));
        assert_eq!(report.steps_identical, earlier);
        let difference = report.difference.unwrap();
        assert_eq!((difference.particle, difference.field), (77, "velocity y"));
    }
}

#[test]
fn a_changed_state_hash_is_reported() {
    let (file, _) = record(&job("curtain", "", 20));
    let changed = rebuild(&file, |mut message| {
        if let Message::Step(row) = &mut message
            && row.step == 7
        {
            row.state_hash ^= 1;
        }
        Some(message)
    });
    let (report, _) = check(&changed);
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(7)));
    assert!(report.to_string().contains("its row in /steps has the hash"), "{report}");
}

#[test]
fn a_keyframe_of_another_state_is_reported() {
    let (file, _) = record(&job("curtain", COMMANDS, 300));
    let mut first = None;
    let changed = rebuild(&file, |message| match message {
        Message::Keyframe { step: 0, bytes } => {
            first = Some(bytes.clone());
            Some(Message::Keyframe { step: 0, bytes })
        }
        Message::Keyframe { step: 240, .. } => {
            Some(Message::Keyframe { step: 240, bytes: first.clone().unwrap() })
        }
        other => Some(other),
    });
    let (report, _) = check(&changed);
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(240)));
}

#[test]
fn a_missing_outcome_is_reported_and_the_solver_is_not_blamed() {
    let (file, _) = record(&job("curtain", COMMANDS, 200));
    for (missing_index, step) in [(0, 10), (4, 50), (8, 110)] {
        let changed = rebuild(&file, |message| match message {
            Message::Outcome(row) if row.index == missing_index => None,
            other => Some(other),
        });
        let (report, _) = check(&changed);
        assert_eq!((report.verdict, report.step), (Verdict::OutcomeLogIncomplete, Some(step)));
        let text = report.to_string();
        assert!(text.starts_with(&format!("outcome log incomplete from step {step}: ")), "{text}");
    }
}

#[test]
fn the_simulation_goes_on_from_the_first_complete_state_after_a_missing_outcome() {
    let (file, _) = record(&job("curtain", COMMANDS, 700));
    let edit = |is_divergent: bool| {
        rebuild(&file, |message| match message {
            Message::Outcome(row) if row.index == 4 => None,
            Message::Particles { step: 600, mut particles } if is_divergent => {
                particles[50].position[0] += 1e-6;
                Some(Message::Particles { step: 600, particles })
            }
            other => Some(other),
        })
    };
    let (report, _) = check(&edit(false));
    assert_eq!((report.verdict, report.step), (Verdict::OutcomeLogIncomplete, Some(50)));
    // The next keyframe after step 50 is that of the next command.
    let [gap] = report.gaps[..] else { panic!("{report}") };
    assert_eq!(gap.from, 50);
    assert!((50..=240).contains(&gap.to), "{report}");
    assert_eq!(report.last_identical_step, Some(700));
    assert_eq!(report.steps_identical, 49 + 700 - gap.to, "{report}");
    let (report, _) = check(&edit(true));
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(600)));
    assert_eq!(report.gaps, [gap], "also where the comparison ends early");
}

#[test]
fn outcomes_out_of_the_order_of_their_index_are_reported() {
    let (file, _) = record(&job("curtain", COMMANDS, 60));
    let swapped = rebuild(&file, |message| match message {
        Message::Outcome(row) if row.step == 10 => {
            Some(Message::Outcome(OutcomeRow { index: 1 - row.index, ..row }))
        }
        other => Some(other),
    });
    let (report, _) = check(&swapped);
    assert_eq!(
        (report.verdict, report.step),
        (Verdict::OutcomeLogIncomplete, Some(10)),
        "{report}"
    );
}

#[test]
fn a_recording_of_one_snapshot_has_no_step_to_compare() {
    let (file, _) = record(&job("curtain", "", 0));
    let (report, _) = check(&file);
    assert_eq!((report.verdict, report.skipped), (Verdict::Identical, None));
    assert_eq!(report.to_string(), "no step to compare after step 0");
}

#[test]
fn a_recording_that_starts_late_and_declares_missing_snapshots_is_bit_identical() {
    let (file, _) = record(&job("curtain", COMMANDS, 400));
    // Of the snapshots from 40 to 400, every fifth one is in the file.
    let missing_count = 72 * 4;
    let partial = |declared_count| {
        rebuild_with_gaps(&file, declared_count, |message| {
            let is_snapshot = matches!(message, Message::Step(_) | Message::Particles { .. });
            let is_left_out = is_snapshot && message.step() % 5 != 0;
            let is_in_file = message.step() >= 37 && !is_left_out;
            if is_in_file { vec![message] } else { Vec::new() }
        })
    };
    let (report, _) = check(&partial(missing_count));
    // The first keyframe is that of the pin at step 50. Every fifth step follows.
    assert_eq!(report.to_string(), "70 steps bit-identical (50..=400)");
    assert_eq!(report.skipped, Some(StepGap { from: 40, to: 45 }));
    let lost = ["/particles", "/steps"].map(|topic| (topic, missing_count));
    assert_eq!(report.lost, BTreeMap::from(lost));
    let (report, _) = check(&partial(missing_count - 1));
    let lost = ["/particles", "/steps"].map(|topic| (topic, missing_count));
    assert_eq!(
        report.lost,
        BTreeMap::from(lost),
        "the numbers in /steps show more than the end says"
    );
}

#[test]
fn a_range_of_steps_is_compared_and_no_others() {
    // One keyframe a second: 0, 240, 480, 720.
    let (file, _) = record(&job("curtain", "", 900));
    let damaged = rebuild(&file, |mut message| {
        if let Message::Particles { step: 600, particles } = &mut message {
            particles[150].position[0] += 1e-6;
        }
        Some(message)
    });
    let verified = |start, last| {
        let options = VerifyOptions { threads: 1, range: StepRange { start, last } };
        let log = LogReader::new(damaged.as_slice()).unwrap();
        verify(log, options, &AtomicBool::new(false), |_| {}).unwrap()
    };
    for (start, last, expected) in [
        (0, 599, Ok((0, 599))),
        (240, 480, Ok((240, 480))),
        (720, u64::MAX, Ok((720, 900))),
        (0, 600, Err(600)),
        (480, 700, Err(600)),
    ] {
        let report = verified(start, last);
        match expected {
            Ok((first, last)) => {
                assert_eq!(report.verdict, Verdict::Identical, "{report}");
                let steps = (report.first_step, report.last_identical_step);
                assert_eq!(steps, (first, Some(last)), "{report}");
                assert_eq!(report.steps_identical, last - first);
            }
            Err(step) => assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(step))),
        }
    }
}

#[test]
fn parts_side_by_side_give_the_report_of_one_thread() {
    let commands = format!(
        r#"{COMMANDS}
        {{"step":700,"kind":"rewind","to_step":120}}"#
    );
    let (file, _) = record(&job("curtain", &commands, 1000));
    let verified = |file: &[u8], threads| {
        let options = VerifyOptions { threads, ..ALL };
        let log = LogReader::new(file).unwrap();
        verify(log, options, &AtomicBool::new(false), |_| {}).unwrap()
    };
    let edited = |flipped_step: u64, damaged_keyframe: u64| {
        rebuild(&file, |mut message| {
            match &mut message {
                Message::Particles { step, particles } if *step == flipped_step => {
                    particles[50].position[0] += 1e-6;
                }
                Message::Keyframe { step, bytes } if *step == damaged_keyframe => bytes.truncate(3),
                _ => {}
            }
            Some(message)
        })
    };
    let never = u64::MAX;
    for (flipped_step, damaged_keyframe, step) in [
        (never, never, None),
        (5, never, Some(5)),
        (never, 480, Some(480)),
        (5, 480, Some(5)),
        (999, 480, Some(480)),
    ] {
        let file = edited(flipped_step, damaged_keyframe);
        let alone = verified(&file, 1);
        assert_eq!(alone.step, step, "{alone}");
        for threads in [0, 2, 3, 8] {
            assert_eq!(verified(&file, threads), alone, "{threads} threads");
        }
    }
}

#[test]
fn a_rewind_to_another_state_than_that_of_its_step_is_reported_from_any_part() {
    let commands = r#"{"step":700,"kind":"rewind","to_step":120}"#;
    let (file, _) = record(&job("curtain", commands, 800));
    let other = rebuild(&file, |message| match message {
        Message::Outcome(row) => {
            let action = Action::Rewind { to_step: Some(119), back_steps: None };
            Some(Message::Outcome(OutcomeRow { action, ..row }))
        }
        other => Some(other),
    });
    let (report, _) = check(&other);
    assert_eq!((report.verdict, report.step), (Verdict::Diverged, Some(700)), "{report}");
    assert!(report.to_string().contains("the state in place is not that of step 119"), "{report}");
    assert_eq!((report.steps_identical, report.last_identical_step), (699, Some(699)));
}

#[test]
fn a_recording_without_a_keyframe_is_an_error() {
    let (file, _) = record(&job("curtain", "", 10));
    let without =
        rebuild(&file, |message| (!matches!(message, Message::Keyframe { .. })).then_some(message));
    let error = try_check(&without).unwrap_err().to_string();
    assert_eq!(error, "has no snapshot with a keyframe to start from");
}

#[test]
fn a_recording_of_another_solver_version_is_refused() {
    let job = job("curtain", "", 1);
    let solver = Solver::new(&job.scene);
    let mut run = job.description(&solver);
    run.solver_version += 1;
    let scene = job.scene.to_toml();
    let log = LogWriter::create(Vec::new(), LogOptions::default(), &run, scene.as_bytes(), 0);
    let file = log.unwrap().finish(&Closing::default()).unwrap();
    let error = try_check(&file).unwrap_err().to_string();
    let found = format!("recorded with solver version {}, but this program", SOLVER_VERSION + 1);
    assert!(error.contains(&found), "{error}");
}

#[test]
fn a_truncated_recording_is_verified_as_far_as_it_goes() {
    let (file, _) = record(&job("curtain", COMMANDS, 400));
    let (report, end) = check(&file[..file.len() / 2]);
    assert_eq!(report.verdict, Verdict::Identical);
    assert!((20..390).contains(&report.steps_identical), "{report}");
    assert!(matches!(end, Some(LogEnd::Truncated { .. })));
}

#[test]
fn commands_beyond_the_end_are_counted() {
    let mut job = job("curtain", COMMANDS, 60);
    assert_eq!(job.commands_beyond_the_end(), 4);
    job.commands.push(TimedCommand {
        step: 61,
        index: None,
        client_id: 0,
        sequence: 0,
        action: Action::Reset,
    });
    assert_eq!(job.commands_beyond_the_end(), 5);
}
