//! Rows that only a recording of a node has: it verifies with them, and not with wrong ones.

use crate::log::{LogOptions, LogReader, LogWriter, Message, OutcomeRow, StepRow};
use sim_contract::Action;

use super::commands::{COMMANDS, STEPS, job};
use super::{check, finish, record};
use crate::verification::{Verdict, VerifyReport};

/// Verifies a recording of a node, in which `change` replaces messages.
fn verified(change: impl FnMut(Message) -> Vec<Message>) -> VerifyReport {
    verified_job(COMMANDS, change)
}

fn verified_job(commands: &str, mut change: impl FnMut(Message) -> Vec<Message>) -> VerifyReport {
    let (file, _) = record(&job(commands));
    let mut old = LogReader::new(file.as_slice()).unwrap();
    let (mut run, scene) = (old.run().clone(), old.scene().to_vec());
    run.epoch_ns = 1_700_000_000_000_000_000;
    let mut new = LogWriter::create(Vec::new(), LogOptions::default(), &run, &scene, 0).unwrap();
    while let Some(logged) = old.next_message().unwrap() {
        for message in change(logged.message) {
            new.write(&message, 0).unwrap();
        }
    }
    check(&finish(new, 0)).0
}

#[track_caller]
fn assert_identical(report: &VerifyReport) {
    assert_eq!(report.verdict, Verdict::Identical, "{report}");
    assert_eq!(report.steps_identical, STEPS);
}

#[track_caller]
fn assert_found(report: &VerifyReport, expected: &str) {
    assert_eq!(report.verdict, Verdict::Diverged, "{report}");
    assert!(report.to_string().contains(expected), "no \"{expected}\" in: {report}");
}

/// Changes each row of `/steps`.
fn with_numbers(number: impl Fn(u64) -> u64) -> VerifyReport {
    verified(|message| match message {
        Message::Step(row) => {
            let snapshot_index = Some(u32::try_from(number(row.step) & 0xffff_ffff).unwrap());
            vec![Message::Step(StepRow { snapshot_index, ..row })]
        }
        other => vec![other],
    })
}

#[test]
fn the_numbers_of_snapshots_increase_as_the_end_of_the_file_declares() {
    let report = with_numbers(|step| step + u64::from(u32::MAX) - 9);
    assert_identical(&report);
    assert!(report.not_covered.iter().any(|line| line.contains("snapshot_index in /steps beyond")));
    let at_40 = "step 40 differs: its snapshot_index in /steps is";
    assert_found(&with_numbers(|step| if step < 40 { step } else { step + 1 }), at_40);
    assert_found(&with_numbers(|step| if step < 40 { step } else { step - 1 }), at_40);
    assert_found(&with_numbers(|step| if step < 40 { step + 9 } else { step }), at_40);
}

/// Marks one outcome as that of a connection that has ended.
fn with_disconnected(is_it: impl Fn(&OutcomeRow) -> bool) -> VerifyReport {
    verified(|message| match message {
        Message::Outcome(row) if is_it(&row) => {
            vec![Message::Outcome(OutcomeRow { disconnected: true, ..row })]
        }
        other => vec![other],
    })
}

#[test]
fn only_a_release_can_be_that_of_a_connection_that_has_ended() {
    let report = with_disconnected(|row| row.step == 60);
    assert_identical(&report);
    assert!(report.not_covered.iter().any(|line| line.contains("\"disconnected\" of a release")));
    let is_rejected =
        |row: &OutcomeRow| matches!(row.action, Action::Release { .. }) && !row.is_applied();
    for report in [with_disconnected(is_rejected), with_disconnected(|row| row.step == 70)] {
        assert_found(&report, "it is no release of a node, but \"disconnected\"");
    }
}

#[test]
fn an_unknown_cause_of_a_tear_is_named_as_not_compared() {
    let report = verified(|mut message| {
        if let Message::Tears(row) = &mut message
            && row.step == 5
        {
            row.causes[0] = "unknown".to_owned();
        }
        vec![message]
    });
    assert_identical(&report);
    let words = "the causes of 1 tear, which the recording calls unknown".to_owned();
    assert!(report.not_covered.contains(&words), "{:?}", report.not_covered);
}

#[test]
fn the_keyframe_of_a_paused_node_may_follow_its_snapshot_once() {
    let after_snapshot = |count: usize, is_wrong: bool| {
        let mut kept = None;
        verified(move |message| match message {
            // The keyframe of a command belongs to its step.
            Message::Keyframe { step: 70, mut bytes } => {
                if is_wrong {
                    bytes = kept.take().unwrap();
                }
                kept = Some(bytes);
                Vec::new()
            }
            Message::Keyframe { step: 67, bytes } => {
                kept = Some(bytes.clone());
                vec![Message::Keyframe { step: 67, bytes }]
            }
            Message::Particles { step: 70, particles } => {
                let late = Message::Keyframe { step: 70, bytes: kept.take().unwrap() };
                let late = std::iter::repeat_n(late, count);
                std::iter::once(Message::Particles { step: 70, particles }).chain(late).collect()
            }
            other => vec![other],
        })
    };
    assert_identical(&after_snapshot(1, false));
    assert_found(&after_snapshot(2, false), "step 70 differs: its message on /keyframe");
    assert_found(&after_snapshot(1, true), "step 70 differs: its message on /keyframe has another");
}

#[test]
fn parameters_that_change_twice_before_a_step_are_compared_with_both_commands() {
    // A paused node publishes the parameters after each command.
    let commands = r#"
        {"step":30,"kind":"set","parameter":"damping","value":0.25}
        {"step":30,"kind":"set","parameter":"damping","value":0.5}"#;
    let with_first = |damping: f32, count: usize| {
        verified_job(commands, |message| match message {
            Message::Parameters(row) if row.step == 30 => {
                let mut first = row.clone();
                first.values.damping = damping;
                let first = std::iter::repeat_n(Message::Parameters(first), count);
                first.chain([Message::Parameters(row)]).collect()
            }
            other => vec![other],
        })
    };
    assert_identical(&with_first(0.25, 1));
    assert_found(&with_first(0.25, 2), "step 30 differs: its message on /parameters");
    assert_found(&with_first(0.75, 1), "step 30 differs: /parameters: parameter damping");
}
