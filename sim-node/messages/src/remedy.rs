//! Remedies of rejected commands, for error messages.

use sim_types::{Action, Reason};

use crate::command::Outcome;

impl Outcome {
    /// Returns the remedy of a rejection in words, as far as it follows from the outcome alone: the allowed
    /// values, or the condition under which the command has an effect.
    pub fn remedy(&self) -> Option<String> {
        let (action, reason) = (self.command.action(), self.reason()?);
        let of_replay = || remedy_of_replay(&action, reason);
        if self.is_of_replay()
            && let Some(remedy) = of_replay()
        {
            return Some(remedy.to_owned());
        }
        match reason {
            Reason::NoEffectHere => missing_condition(&action).map(str::to_owned),
            _ => action.allowed_values(reason).map(|values| format!("allowed: {values}")),
        }
    }
}

/// Remedy of a rejection by a replay, where it is not that of a node.
fn remedy_of_replay(action: &Action, reason: Reason) -> Option<&'static str> {
    Some(match (reason, action) {
        (Reason::NoEffectHere, Action::Step { .. }) => return None,
        (Reason::NoEffectHere, _) => {
            "a recording accepts only pause, resume, step, rewind and set time_scale"
        }
        (Reason::OutOfRange, Action::Rewind { .. }) => "allowed: a step of the recording",
        (Reason::OutOfRange, Action::Step { count }) if *count > 0 => {
            "the replay stands at its last snapshot; a rewind goes back"
        }
        (Reason::OutOfRange, Action::Set { .. }) => "allowed: 0.01 to 100",
        _ => return None,
    })
}

/// Condition under which a command has an effect on a node.
fn missing_condition(action: &Action) -> Option<&'static str> {
    match action {
        Action::Step { .. } => Some("the node runs; it makes single steps while it is paused"),
        Action::Load { .. } => {
            Some("it needs more memory than is available; see the node's messages")
        }
        Action::Rewind { .. } => Some("the node keeps no history; start it without --history 0"),
        _ => action.missing_condition(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{Command, OUTCOME_FLAG_CONTROL};

    fn remedy(action: Action, reason: Reason, flags: u32) -> Option<String> {
        let outcome = Outcome::new(0, 1, Command::new(1, 1, action), Err(reason));
        Outcome { flags, ..outcome }.remedy()
    }

    #[test]
    fn a_rejection_names_the_allowed_values_or_the_missing_condition() {
        let set = Action::set("tear_force", -1.0);
        let allowed = "allowed: a number > 0, or off for no limit";
        assert_eq!(remedy(set, Reason::OutOfRange, 0).as_deref(), Some(allowed));
        let frozen = "the particle is frozen; a reset restores it";
        let pin = Action::Pin { particle: 3 };
        assert_eq!(remedy(pin, Reason::NoEffectHere, 0).as_deref(), Some(frozen));
        assert_eq!(remedy(pin, Reason::NotGrabbed, 0), None);
    }

    #[test]
    fn a_replay_names_what_it_accepts() {
        let of_replay = |action, reason| remedy(action, reason, OUTCOME_FLAG_CONTROL).unwrap();
        let pin = of_replay(Action::Pin { particle: 3 }, Reason::NoEffectHere);
        assert!(pin.starts_with("a recording accepts only "), "{pin}");
        let step = of_replay(Action::Step { count: 1 }, Reason::OutOfRange);
        assert_eq!(step, "the replay stands at its last snapshot; a rewind goes back");
        let zero = of_replay(Action::Step { count: 0 }, Reason::OutOfRange);
        assert_eq!(zero, "allowed: 1 or more");
    }
}
