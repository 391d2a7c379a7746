//! Explanations of rejected commands.

use std::time::Duration;

use sim_contract::{
    Action, Client, OffMeaning, Outcome, PARAMETERS, Parameter, Reason, STEP_WORK_MAX,
};
use sim_solver::Scene;

use crate::args::allowed_values_of;

/// Explains a rejection: the meaning of its reason, and the remedy in parentheses where one is known.
/// Returns `None` if the reason is unknown.
pub(super) fn explain(client: &mut Client, timeout: Duration, outcome: &Outcome) -> Option<String> {
    let reason = outcome.reason()?;
    Some(match remedy(client, timeout, outcome, reason) {
        Some(remedy) => format!("{reason} ({remedy})"),
        None => reason.to_string(),
    })
}

/// Remedy of a rejection. Without an answer of the node, only a remedy that needs none.
fn remedy(
    client: &mut Client,
    timeout: Duration,
    outcome: &Outcome,
    reason: Reason,
) -> Option<String> {
    let action = &outcome.command.action();
    let mut status = || client.status(timeout).ok().flatten();
    let count = match reason {
        Reason::UnknownParticle => status()?.particle_count as usize,
        Reason::UnknownConstraint => status()?.constraint_count as usize,
        Reason::UnknownAnchor => anchor_count(client, timeout)?,
        Reason::UnknownCollider => client.colliders(timeout).ok()?.colliders.len(),
        Reason::UnknownStep if is_before_run(action, outcome.step) => {
            return Some(age_of_run(outcome.step, status()?.rate_hz));
        }
        _ => {
            let of_replay = remedy_of_replay(action, reason);
            let mut is_replay = || status().is_some_and(|status| status.is_replay());
            return of_replay.filter(|_| is_replay()).or_else(|| fixed_remedy(action, reason));
        }
    };
    Some(allowed_indices(count))
}

/// Returns `true` if a rewind, rejected before `step` was made, asks for a time before the run.
fn is_before_run(action: &Action, step: u64) -> bool {
    let Action::Rewind { to_step: None, back_steps: Some(back_steps) } = action else {
        return false;
    };
    u64::from(*back_steps) >= step
}

/// Remedy of a rewind to a time before the run.
fn age_of_run(step: u64, rate_hz: u32) -> String {
    let seconds = step.saturating_sub(1) as f64 / f64::from(rate_hz);
    format!("the run is only {seconds:.2} s old; `ctl rewind --to-step 0` goes to its start")
}

/// Remedy of a rejection by a replay, where it is not that of a node.
fn remedy_of_replay(action: &Action, reason: Reason) -> Option<String> {
    let remedy = match (reason, action) {
        (Reason::NoEffectHere, Action::Step { .. }) => return None,
        (Reason::NoEffectHere, _) => {
            "a recording accepts only pause, resume, step, rewind and set time_scale"
        }
        (Reason::OutOfRange, Action::Rewind { .. }) => "allowed: a step of the recording",
        (Reason::OutOfRange, Action::Step { count }) if *count > 0 => {
            "the replay stands at its last snapshot; `ctl rewind` goes back"
        }
        (Reason::OutOfRange, Action::Set { .. }) => "allowed: 0.01 to 100",
        _ => return None,
    };
    Some(remedy.to_owned())
}

/// Number of anchors, which only the scene names.
fn anchor_count(client: &mut Client, timeout: Duration) -> Option<usize> {
    let scene = client.scene(timeout).ok()??;
    Some(Scene::from_toml(&scene, "scene").ok()?.anchors.len())
}

fn allowed_indices(count: usize) -> String {
    match count {
        0 => "it has none".to_owned(),
        1 => "allowed: 0".to_owned(),
        count => format!("allowed: 0 to {}", count - 1),
    }
}

/// Remedy that follows from the command alone.
fn fixed_remedy(action: &Action, reason: Reason) -> Option<String> {
    let remedy = match reason {
        Reason::UnknownParameter => {
            return Some(format!("allowed: {}", PARAMETERS.map(|info| info.name).join(", ")));
        }
        Reason::OutOfRange => return Some(format!("allowed: {}", allowed_values(action)?)),
        Reason::NonFinite if has_no_limit(action) => "allowed: finite numbers, or off for no limit",
        Reason::NonFinite => "allowed: finite numbers",
        Reason::AlreadyTorn => "`ctl reset` restores it",
        Reason::NotGrabbed => "`ctl grab` grabs it",
        Reason::GrabbedByOther => "`ctl release --force` ends that grab",
        Reason::NoEffectHere => missing_condition(action)?,
        Reason::UnknownStep => {
            "older states have made room for newer ones, or belong to another scene: a larger \
             `sim-node run --history` keeps more"
        }
        Reason::InvalidState => "see the node's messages",
        Reason::UnknownParticle
        | Reason::UnknownConstraint
        | Reason::UnknownAnchor
        | Reason::UnknownCollider => return None,
    };
    Some(remedy.to_owned())
}

/// Returns `true` if a parameter of this action can be without a limit, which scenes write as `inf`.
fn has_no_limit(action: &Action) -> bool {
    let Action::Set { parameter, .. } = action else { return false };
    Parameter::from_name(parameter.as_str())
        .is_some_and(|parameter| parameter.info().off == OffMeaning::NoLimit)
}

/// Condition under which a command has an effect.
fn missing_condition(action: &Action) -> Option<&'static str> {
    Some(match action {
        Action::Set { parameter, .. } if parameter.as_str() == Parameter::Bending.name() => {
            "the scene has no bends; a scene has them with the key bending of a generated cloth, rope or \
             mesh, or with [[bend]]"
        }
        Action::Set { .. } => "method \"xpbd\" has compliance, method \"pbd\" has stiffness",
        Action::Step { .. } => "the node is not paused",
        Action::Load { .. } => "it needs more memory than is available; see the node's messages",
        Action::Rewind { .. } => "the node keeps no history; start it without --history 0",
        Action::Pin { .. }
        | Action::Unpin { .. }
        | Action::Grab { .. }
        | Action::Move { .. }
        | Action::Release { .. } => "the particle is frozen; `ctl reset` restores it",
        _ => return None,
    })
}

/// Allowed values of a command, in words.
fn allowed_values(action: &Action) -> Option<String> {
    let values = match action {
        Action::Set { parameter, constraint_kind, .. } => {
            let info = Parameter::from_name(parameter.as_str())?.info();
            let kind =
                if constraint_kind.is_some() && !info.is_per_kind { ", no --kind" } else { "" };
            let work = match info.parameter {
                Parameter::Substeps | Parameter::Iterations => format!(
                    ", with substeps x (constraints x iterations + particles x (colliders + 1)) at \
                     most {STEP_WORK_MAX}"
                ),
                _ => String::new(),
            };
            return Some(format!("{}{work}{kind}", allowed_values_of(info)));
        }
        Action::Grab { .. } | Action::Move { .. } => {
            "coordinates within 1e7, z 0 in 2-D, --over 0 to 0.25"
        }
        Action::Push { .. } => {
            "coordinates and --delta within 1e7, z 0 in 2-D, --radius 0 to 1e7, --limit 0 or more"
        }
        Action::CutRadius { .. } => "coordinates within 1e7, z 0 in 2-D, --radius 0 to 1e7",
        Action::CutSegment { .. } => {
            "coordinates within 1e7, --direction not 0; in 2-D, z of --from and --to 0"
        }
        Action::MoveAnchor { .. } => {
            "coordinates within 1e7, --rotation not 0; in 2-D, z 0 and a rotation about z"
        }
        Action::MoveCollider { .. } => {
            "coordinates within 1e7, --rotation not 0; in 2-D, z 0 and a rotation about z; for \
             bounds, no rotation"
        }
        Action::Load { .. } => "a scene that the node can read; see its messages",
        Action::Step { .. } => "1 or more",
        Action::Mark { .. } => "a text that is not empty",
        Action::Rewind { .. } => "a step of this run that the node has made",
        _ => return None,
    };
    Some(values.to_owned())
}

#[cfg(test)]
mod tests {
    use sim_contract::{ConstraintKind, KindFilter, ParameterValue, Text};

    use super::*;

    #[test]
    fn a_kind_for_a_parameter_without_kinds_is_named() {
        let action = Action::Set {
            parameter: Text::cut("damping"),
            value: ParameterValue::Number(1.0),
            constraint_kind: Some(KindFilter::Known(ConstraintKind::Bend)),
        };
        let remedy = fixed_remedy(&action, Reason::OutOfRange).unwrap();
        assert_eq!(remedy, "allowed: a number >= 0, or off for 0, no --kind");
    }

    #[test]
    fn a_rewind_before_the_run_is_told_from_one_to_a_state_that_is_gone() {
        let back = |back_steps| Action::Rewind { to_step: None, back_steps: Some(back_steps) };
        // Before step 240 the newest state is that of step 239.
        assert!(is_before_run(&back(240), 240) && !is_before_run(&back(239), 240));
        assert!(!is_before_run(&Action::Rewind { to_step: Some(500), back_steps: None }, 240));
        assert!(age_of_run(241, 240).starts_with("the run is only 1.00 s old; "));
    }

    #[test]
    fn every_action_that_can_be_out_of_range_names_its_values() {
        for action in Action::samples() {
            let is_checked = !matches!(
                action,
                Action::Pin { .. }
                    | Action::Unpin { .. }
                    | Action::Release { .. }
                    | Action::Pause
                    | Action::Resume
                    | Action::Reset
                    | Action::Cut { .. }
                    | Action::Restore { .. }
                    | Action::Unknown { .. }
            );
            let remedy = fixed_remedy(&action, Reason::OutOfRange);
            assert_eq!(remedy.is_some(), is_checked, "{action:?}");
        }
    }

    #[test]
    fn allowed_indices_end_before_the_count() {
        assert_eq!(allowed_indices(0), "it has none");
        assert_eq!(allowed_indices(1), "allowed: 0");
        assert_eq!(allowed_indices(168), "allowed: 0 to 167");
    }
}
