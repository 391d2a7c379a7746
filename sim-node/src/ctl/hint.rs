//! What to do about a rejected command, where its reason alone does not tell.

use sim_contract::{
    Action, OffMeaning, Outcome, PARAMETERS, Parameter, ParameterInfo, Reason, ValueForm,
};

/// Words behind the reason, or none.
pub(super) fn of(action: &Action, outcome: &Outcome) -> String {
    let Some(reason) = Reason::from_name(outcome.reason_name()) else { return String::new() };
    match (action, reason) {
        (Action::Set { .. }, Reason::UnknownParameter) => {
            format!(" (allowed: {})", PARAMETERS.map(|info| info.name).join(", "))
        }
        (Action::Set { parameter, .. }, Reason::OutOfRange) => {
            Parameter::from_name(parameter.as_str())
                .map_or_else(String::new, |known| format!(" (allowed: {})", allowed(known.info())))
        }
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
