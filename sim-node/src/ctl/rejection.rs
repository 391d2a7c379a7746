//! Explanations of rejected commands.

use std::time::Duration;

use sim_contract::{Action, Client, Outcome, Reason, SnapshotHeader};
use sim_solver::Scene;

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
            let rate_hz = status()?.rate_hz;
            let newest = client.latest_snapshot(timeout).ok().flatten()?;
            return Some(age_of_run(outcome.step, rate_hz, first_step(newest.header())));
        }
        Reason::UnknownStep => {
            let snapshot = client.latest_snapshot(timeout).ok().flatten()?;
            let remedy = age_of_scene(action, outcome.step, snapshot.header());
            return remedy.or_else(|| fixed_remedy(action, reason));
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

/// Remedy of a rewind to a time before the run. The states before `first_step` belong to another scene.
fn age_of_run(step: u64, rate_hz: u32, first_step: u64) -> String {
    let seconds = step.saturating_sub(1) as f64 / f64::from(rate_hz);
    let start = match first_step {
        0 => "`ctl rewind --to-step 0` goes to its start".to_owned(),
        _ => start_of_scene(first_step),
    };
    format!("the run is only {seconds:.2} s old; {start}")
}

/// Returns the step at which the scene began.
fn first_step(newest: &SnapshotHeader) -> u64 {
    newest.step.saturating_sub(newest.scene_step)
}

fn start_of_scene(first: u64) -> String {
    format!(
        "the scene began at step {first} with a load or reset; `ctl rewind --to-step {first}` goes there"
    )
}

/// Remedy of a rewind, rejected before `step` was made, to a time before the scene began.
fn age_of_scene(action: &Action, step: u64, newest: &SnapshotHeader) -> Option<String> {
    let Action::Rewind { to_step, back_steps } = action else { return None };
    let back_steps = back_steps.map(|back_steps| step.saturating_sub(1 + u64::from(back_steps)));
    let first = first_step(newest);
    (to_step.or(back_steps)? < first).then(|| start_of_scene(first))
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
        Reason::OutOfRange | Reason::NonFinite | Reason::UnknownParameter => {
            return Some(format!("allowed: {}", action.allowed_values(reason)?));
        }
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

/// Condition under which a command has an effect.
fn missing_condition(action: &Action) -> Option<&'static str> {
    Some(match action {
        Action::Step { .. } => "the node runs; `ctl pause` pauses it",
        Action::Load { .. } => "it needs more memory than is available; see the node's messages",
        Action::Rewind { .. } => "the node keeps no history; start it without --history 0",
        Action::Pin { .. }
        | Action::Unpin { .. }
        | Action::Grab { .. }
        | Action::Move { .. }
        | Action::Release { .. } => "the particle is frozen; `ctl reset` restores it",
        _ => return action.missing_condition(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rewind_before_the_run_is_told_from_one_to_a_state_that_is_gone() {
        let back = |back_steps| Action::Rewind { to_step: None, back_steps: Some(back_steps) };
        // Before step 240 the newest state is that of step 239.
        assert!(is_before_run(&back(240), 240) && !is_before_run(&back(239), 240));
        assert!(!is_before_run(&Action::Rewind { to_step: Some(500), back_steps: None }, 240));
        let start = "the run is only 1.00 s old; `ctl rewind --to-step 0` goes to its start";
        assert_eq!(age_of_run(241, 240, 0), start);
    }

    #[test]
    fn a_rewind_before_the_run_names_the_first_step_of_a_loaded_scene() {
        assert_eq!(
            age_of_run(241, 240, 200),
            "the run is only 1.00 s old; the scene began at step 200 with a load or reset; `ctl rewind \
             --to-step 200` goes there"
        );
    }

    #[test]
    fn a_rewind_before_the_load_of_the_scene_names_its_first_step() {
        let newest = SnapshotHeader { step: 1020, scene_step: 20, ..SnapshotHeader::default() };
        let remedy = |to_step, back_steps| {
            age_of_scene(&Action::Rewind { to_step, back_steps }, 1021, &newest)
        };
        for (to_step, back_steps) in [(Some(999), None), (None, Some(21)), (None, Some(480))] {
            let remedy = remedy(to_step, back_steps).unwrap();
            assert!(remedy.starts_with("the scene began at step 1000 "), "{remedy}");
            assert!(remedy.contains("`ctl rewind --to-step 1000`"), "{remedy}");
        }
        assert_eq!(remedy(Some(1000), None), None);
        assert_eq!(remedy(None, Some(20)), None);
    }

    #[test]
    fn a_step_of_a_node_that_runs_names_the_pause() {
        let remedy = fixed_remedy(&Action::Step { count: 1 }, Reason::NoEffectHere);
        assert_eq!(remedy.as_deref(), Some("the node runs; `ctl pause` pauses it"));
    }

    #[test]
    fn allowed_indices_end_before_the_count() {
        assert_eq!(allowed_indices(0), "it has none");
        assert_eq!(allowed_indices(1), "allowed: 0");
        assert_eq!(allowed_indices(168), "allowed: 0 to 167");
    }
}
