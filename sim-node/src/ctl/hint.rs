//! What to do about a rejected command, where its reason alone does not tell.

use sim_contract::{Action, Outcome, Reason};
use sim_solver::PARAMETERS;

/// Words behind the reason, or none.
pub(super) fn of(action: &Action, outcome: &Outcome) -> String {
    let Some(reason) = Reason::from_name(outcome.reason_name()) else { return String::new() };
    match (action, reason) {
        (Action::Set { .. }, Reason::UnknownParameter) => {
            format!(" (there are {})", PARAMETERS.join(", "))
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

/// The range of a parameter, in words.
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
