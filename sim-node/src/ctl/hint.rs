//! Advice on an outcome that does not explain itself.

use std::time::Duration;

use sim_contract::{
    Action, Client, OffMeaning, Outcome, PARAMETERS, Parameter, ParameterInfo, Reason, ValueForm,
};

/// Cause or remedy of a rejection, to print behind its reason; may be empty.
pub(super) fn for_rejection(action: &Action, outcome: &Outcome) -> String {
    let Some(reason) = outcome.reason() else { return String::new() };
    match (action, reason) {
        (Action::Set { .. }, Reason::UnknownParameter) => {
            format!(" (allowed: {})", PARAMETERS.map(|info| info.name).join(", "))
        }
        (Action::Set { parameter, .. }, Reason::OutOfRange) => {
            Parameter::from_name(parameter.as_str())
                .map_or_else(String::new, |known| format!(" (allowed: {})", allowed(known.info())))
        }
        (Action::Set { .. }, Reason::NoEffectHere) => {
            " (method \"xpbd\" has compliance, method \"pbd\" has stiffness)".to_owned()
        }
        (Action::Grab { .. } | Action::Move { .. }, Reason::OutOfRange) => {
            " (allowed: coordinates within 1e7, z 0 in 2-D, --over 0 to 0.25)".to_owned()
        }
        (Action::Load { .. }, Reason::NoEffectHere) => {
            " (the scene runs at another rate than the node, or needs more memory than is \
             available; see the node's messages)"
                .to_owned()
        }
        (Action::Load { .. }, Reason::OutOfRange) => {
            " (the node cannot read that scene; see its messages)".to_owned()
        }
        (Action::Step { .. }, Reason::NoEffectHere) => " (the node is not paused)".to_owned(),
        (Action::Step { .. }, Reason::OutOfRange) => " (allowed: 1 or more)".to_owned(),
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
    if parameter.as_str() != Parameter::WindVelocity.name() {
        return None;
    }
    // Without an answer there is no advice; the command was applied all the same.
    if client.surface(timeout).ok()??.triangles.is_empty() {
        return Some("this has no effect: the scene has no surface");
    }
    let is_still = client.parameters(timeout).ok()??.values.wind_drag == 0.0;
    is_still.then_some("this has no effect while wind_drag is 0 (see `ctl set wind_drag`)")
}

/// Allowed values of a parameter, in words.
fn allowed(info: &ParameterInfo) -> String {
    let values = match info.form {
        ValueForm::Vector => format!("three numbers, each {}, z 0 in 2-D", info.range.text),
        ValueForm::Number | ValueForm::Whole => info.range.text.to_owned(),
    };
    let off = match info.off {
        OffMeaning::Zero => ", or off for 0",
        OffMeaning::NoLimit => ", or off for no limit",
        OffMeaning::NotAllowed | OffMeaning::OwnOfEach => "",
    };
    let kind = if info.is_per_kind { ", for one --kind or all" } else { "" };
    format!("{values}{off}{kind}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_allowed_values_name_range_off_and_kind() {
        let text = |parameter: Parameter| allowed(parameter.info());
        assert_eq!(text(Parameter::Substeps), "a whole number from 1 to 1000");
        assert_eq!(text(Parameter::TearForce), "a number > 0, or off for no limit");
        assert_eq!(text(Parameter::Stiffness), "0 to 1, for one --kind or all");
        let gravity = "three numbers, each -1e7 to 1e7, z 0 in 2-D, or off for 0";
        assert_eq!(text(Parameter::Gravity), gravity);
    }
}
