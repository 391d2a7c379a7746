//! Rows that only a recording of a node has: it verifies with them, and not with wrong ones.

use sim_messages::Parameter;

use crate::log::{LogOptions, LogReader, LogWriter, Message};

use super::commands::{COMMANDS, STEPS, job};
use super::{check, finish, rebuild_with_gaps, record, try_check};
use crate::verification::{Verdict, VerifyReport};

/// Verifies a recording of a node, in which `change` replaces messages.
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

#[test]
fn a_message_behind_the_snapshot_of_its_step_is_refused() {
    let (file, _) = record(&job(COMMANDS));
    let mut kept = None;
    let late = rebuild_with_gaps(&file, 0, |message| match message {
        Message::Keyframe { step: 70, .. } => {
            kept = Some(message);
            Vec::new()
        }
        Message::Particles { step: 70, .. } => [message].into_iter().chain(kept.take()).collect(),
        other => vec![other],
    });
    let error = try_check(&late).unwrap_err().to_string();
    let expected = "the message of step 70 on /keyframe is out of order: it follows step 70";
    assert_eq!(error, expected);
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
                first.values = first.values.with(Parameter::Damping, damping);
                let first = std::iter::repeat_n(Message::Parameters(first), count);
                first.chain([Message::Parameters(row)]).collect()
            }
            other => vec![other],
        })
    };
    assert_identical(&with_first(0.25, 1));
    assert_found(&with_first(0.25, 2), "step 30 differs: /parameters: parameter damping");
    assert_found(&with_first(0.75, 1), "step 30 differs: /parameters: parameter damping");
}
