//! Advice on an outcome, where the outcome alone does not explain itself.

use std::time::Duration;

use sim_contract::{Action, Client, Outcome, Reason};
use sim_solver::PARAMETERS;

/// Cause or remedy of a rejection, to print behind its reason; may be empty.
pub(super) fn for_rejection(action: &Action, outcome: &Outcome) -> String {
    let Some(reason) = Reason::from_name(outcome.reason_name()) else { return String::new() };
    match (action, reason) {
        (Action::Set { .. }, Reason::UnknownParameter) => {
            format!(" (allowed: {})", PARAMETERS.join(", "))
        }
        (Action::Set { parameter, .. }, Reason::OutOfRange) => allowed(parameter.as_str())
            .map_or_else(String::new, |text| format!(" (allowed: {text})")),
        (Action::Set { .. }, Reason::NoEffectHere) => {
            " (compliance belongs to method \"xpbd\", stiffness to \"pbd\")".to_owned()
        }
        (Action::Grab { .. } | Action::Move { .. }, Reason::OutOfRange) => {
            " (allowed: coordinates within 1e7, z 0 in 2-D, --over 0 to 0.25)".to_owned()
        }
        (Action::Load { .. }, Reason::NoEffectHere) => {
            " (the scene runs at another rate than the node, or needs more memory than there is; \
             the node's messages say which)"
                .to_owned()
        }
        (Action::Load { .. }, Reason::OutOfRange) => {
            " (the node cannot read that scene; its messages say why)".to_owned()
        }
        (Action::Step { .. }, Reason::NoEffectHere) => " (the node is not paused)".to_owned(),
        _ => String::new(),
    }
}

/// Explains an applied command that changes nothing visible.
pub(super) fn for_applied(
    client: &mut Client,
    timeout: Duration,
    action: &Action,
) -> Option<&'static str> {
    let Action::Set { parameter, .. } = action else { return None };
    if parameter.as_str() != "wind_velocity" {
        return None;
    }
    // Without an answer there is no advice either; the command was applied all the same.
    let surface = client.surface(timeout).ok()??;
    surface.triangles.is_empty().then_some("this has no effect: the scene has no surface")
}

/// Allowed values of a parameter, in words.
fn allowed(parameter: &str) -> Option<&'static str> {
    Some(match parameter {
        "gravity" | "wind_velocity" => "three numbers within 1e7, z 0 in 2-D, or off for 0 0 0",
        "damping" | "wind_drag" => "a number >= 0, or off for 0",
        "substeps" | "iterations" => "a whole number from 1 to 1000",
        "relaxation" => "more than 0, less than 2",
        "max_stretch" | "tear_stretch" => "more than 1, or off",
        "tear_distance" => "a number >= 0, or off",
        "tear_force" => "a number > 0, or off",
        "max_speed" => "a number > 0",
        "time_scale" => "0.001 to 1000",
        "compliance" => "0 to 1e20, for one --kind or all",
        "stiffness" => "0 to 1, for one --kind or all",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_its_range_in_words() {
        for name in PARAMETERS {
            assert!(allowed(name).is_some(), "{name}");
        }
        assert_eq!(allowed("colour"), None);
    }
}
