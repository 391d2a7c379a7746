//! Explanations of rejected commands, and hints on applied ones that change nothing visible.

use std::time::Duration;

use sim_contract::{Action, Client, Outcome, Parameter, Reason, SnapshotHeader, allowed_indices};
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
    match reason {
        Reason::UnknownAnchor => Some(allowed_indices(anchor_count(client, timeout)?)),
        Reason::UnknownStep if is_before_run(action, outcome.step) => {
            let rate_hz = client.status(timeout).ok().flatten()?.rate_hz;
            let newest = client.latest_snapshot(timeout).ok().flatten()?;
            Some(age_of_run(outcome.step, rate_hz, first_step(newest.header())))
        }
        Reason::UnknownStep => {
            let snapshot = client.latest_snapshot(timeout).ok().flatten()?;
            let remedy = age_of_scene(action, outcome.step, snapshot.header());
            remedy.or_else(|| console_remedy(outcome, reason).map(str::to_owned))
        }
        _ => match console_remedy(outcome, reason) {
            Some(remedy) => Some(remedy.to_owned()),
            None => client.remedy(outcome, timeout),
        },
    }
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

/// Number of anchors, which only the scene names.
fn anchor_count(client: &mut Client, timeout: Duration) -> Option<usize> {
    let scene = client.scene(timeout).ok()??;
    Some(Scene::from_toml(&scene, "scene").ok()?.anchors.len())
}

/// Remedy that names a command of the console or an option of the node.
fn console_remedy(outcome: &Outcome, reason: Reason) -> Option<&'static str> {
    let is_of_replay = outcome.is_of_replay();
    Some(match (reason, outcome.command.action()) {
        (Reason::AlreadyTorn, _) => "`ctl reset` restores it",
        (Reason::NotGrabbed, _) => "`ctl grab` grabs it",
        (Reason::GrabbedByOther, _) => "`ctl release --force` ends that grab",
        (Reason::NoEffectHere, Action::Step { .. }) => "the node runs; `ctl pause` pauses it",
        (
            Reason::NoEffectHere,
            Action::Pin { .. }
            | Action::Unpin { .. }
            | Action::Grab { .. }
            | Action::Move { .. }
            | Action::Release { .. },
        ) if !is_of_replay => "the particle is frozen; `ctl reset` restores it",
        (Reason::OutOfRange, Action::Step { count }) if is_of_replay && count > 0 => {
            "the replay stands at its last snapshot; `ctl rewind` goes back"
        }
        (Reason::UnknownStep, _) => {
            "older states have made room for newer ones, or belong to another scene: a larger \
             `sim-node run --history` keeps more"
        }
        (Reason::InvalidState, _) => "see the node's messages",
        _ => return None,
    })
}

/// Explains an applied command that changes nothing visible.
pub(super) fn hint(
    client: &mut Client,
    timeout: Duration,
    action: &Action,
) -> Option<&'static str> {
    let Action::Set { parameter, .. } = action else { return None };
    match Parameter::from_name(parameter.as_str())? {
        Parameter::WindVelocity => for_wind(client, timeout),
        Parameter::ContactFriction => {
            let values = client.parameters(timeout).ok()??.values;
            let is_off = values.optional(Parameter::ContactThickness).is_none();
            is_off.then_some(
                "this has no effect while contact.thickness is off (see `ctl set contact.thickness`)",
            )
        }
        _ => None,
    }
}

/// Without an answer of the node there is no hint; the command was applied all the same.
fn for_wind(client: &mut Client, timeout: Duration) -> Option<&'static str> {
    if client.surface(timeout).ok()??.triangles.is_empty() {
        return Some("this has no effect: the scene has no surface");
    }
    let is_still = client.parameters(timeout).ok()??.values.number(Parameter::WindDrag) == 0.0;
    is_still.then_some("this has no effect while wind.drag is 0 (see `ctl set wind.drag`)")
}

#[cfg(test)]
mod tests {
    use sim_contract::Command;

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
        let command = Command::new(0, 1, Action::Step { count: 1 });
        let outcome = Outcome::new(0, 1, command, Err(Reason::NoEffectHere));
        let remedy = console_remedy(&outcome, Reason::NoEffectHere);
        assert_eq!(remedy, Some("the node runs; `ctl pause` pauses it"));
    }
}
