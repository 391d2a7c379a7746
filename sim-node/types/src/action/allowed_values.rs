//! The allowed values of parameters and commands, in words for error messages.

use crate::action::{Action, ActionInfo};
use crate::limits::STEP_WORK_MAX;
use crate::parameter::{OffMeaning, Parameter, ParameterValue, Parts};
use crate::reason::Reason;
use crate::text::Text;

/// Allowed contact distances, where the rejected distance is a number > 0. The solver has the limits.
const TOO_MANY_NEIGHBOURS: &str =
    "a smaller distance: at load, particles have too many neighbours within this one";

impl Action {
    /// Returns the values that this action may have, in words, if it was rejected for its values alone.
    pub fn allowed_values(&self, reason: Reason) -> Option<String> {
        match reason {
            Reason::OutOfRange => self.allowed_ranges(),
            Reason::NonFinite if self.has_no_limit() => {
                Some("finite numbers, or off for no limit".to_owned())
            }
            Reason::NonFinite => Some("finite numbers".to_owned()),
            Reason::UnknownParameter => match self {
                Self::Set { parameter, .. } => Some(Parameter::allowed_names(parameter.as_str())),
                _ => None,
            },
            _ => None,
        }
    }

    /// Returns the condition of the scene or its state under which this action has an effect, in words, if it was
    /// rejected for having none.
    pub fn missing_condition(&self) -> Option<&'static str> {
        let is_bending = |parameter: &Text| parameter.as_str() == Parameter::Bending.name();
        let is_per_collider = |parameter: &Text| {
            Parameter::from_name(parameter.as_str())
                .is_some_and(|one| one.info().parts == Parts::Colliders)
        };
        match self {
            Self::Set { parameter, block: Some(_), .. } if is_bending(parameter) => Some(
                "the block has no bends; a generated cloth, rope or mesh has them with the key bending",
            ),
            Self::Set { parameter, .. } if is_bending(parameter) => Some(
                "the scene has no bends; a scene has them with the key bending of a generated cloth, rope or \
                 mesh, or with [[bend]]",
            ),
            Self::Set { parameter, .. } if is_per_collider(parameter) => {
                Some("the scene has no collider; a scene has them with [[collider]]")
            }
            Self::Set { .. } => {
                Some("method \"xpbd\" has compliance, method \"pbd\" has stiffness")
            }
            Self::DriveBody { .. } => Some(
                "the collider is no body; the scene makes it one with body = { mass, inertia }",
            ),
            Self::Follow { append: true, .. } => Some(
                "no motion is under way that could go on; send its first points without append",
            ),
            Self::Pin { .. }
            | Self::Unpin { .. }
            | Self::Grab { .. }
            | Self::Move { .. }
            | Self::Release { .. } => Some("the particle is frozen; a reset restores it"),
            _ => None,
        }
    }

    /// Returns `true` if the parameter of this action can be without a limit, which scenes write as `inf`.
    fn has_no_limit(&self) -> bool {
        let Self::Set { parameter, .. } = self else { return false };
        Parameter::from_name(parameter.as_str())
            .is_some_and(|parameter| parameter.info().off == OffMeaning::NoLimit)
    }

    fn allowed_ranges(&self) -> Option<String> {
        let values = match self {
            Self::Set { parameter, value, constraint_kind, block, collider } => {
                let info = Parameter::from_name(parameter.as_str())?.info();
                let has_kind = constraint_kind.is_some() && info.parts != Parts::Kinds;
                let kind = if has_kind { ", no kind" } else { "" };
                let block = match block {
                    Some(_) if info.parts == Parts::Blocks => {
                        ", for a generated block of the scene, counted from 0"
                    }
                    Some(_) => ", no block",
                    None => "",
                };
                let has_collider = collider.is_some() && info.parts != Parts::Colliders;
                let collider = if has_collider { ", no collider" } else { "" };
                if let (Parameter::ContactThickness, ParameterValue::Number(number)) =
                    (info.parameter, value)
                    && info.range.contains(*number)
                    && kind.len() + block.len() + collider.len() == 0
                {
                    return Some(TOO_MANY_NEIGHBOURS.to_owned());
                }
                let values = info.allowed_values();
                let work = work(info.parameter);
                return Some(format!("{values}{work}{kind}{block}{collider}"));
            }
            _ => ActionInfo::from_name(self.kind_name())?.allowed?,
        };
        Some(values.to_owned())
    }
}

/// The limit on the work of a step, for the parameters that it depends on.
fn work(parameter: Parameter) -> String {
    match parameter {
        Parameter::Substeps | Parameter::Iterations => format!(
            ", with substeps x (constraints x iterations + particles x (colliders + 1)) at most \
             {STEP_WORK_MAX}"
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ConstraintKind, ParameterValue, Part};

    #[test]
    fn a_contact_distance_in_its_range_has_too_many_neighbours() {
        let values = |number| {
            let action = Action::set("contact.thickness", ParameterValue::Number(number));
            action.allowed_values(Reason::OutOfRange).unwrap()
        };
        assert!(values(0.2).starts_with("a smaller distance: "));
        assert_eq!(values(-0.2), "a number > 0, or off for none");
    }

    #[test]
    fn a_kind_for_a_parameter_without_kinds_is_named() {
        let action = Action::set("damping", 1.0).for_part(Part::Kind(ConstraintKind::Bend));
        let values = action.allowed_values(Reason::OutOfRange).unwrap();
        assert_eq!(values, "a number >= 0, or off for 0, no kind");
    }

    #[test]
    fn a_wrong_block_is_named() {
        let values = |name: &str| {
            let action = Action::set(name, 1.0).for_part(Part::Block(9));
            action.allowed_values(Reason::OutOfRange).unwrap()
        };
        assert_eq!(values("damping"), "a number >= 0, or off for 0, no block");
        let blocks = "a number >= 0, for a generated block of the scene, counted from 0";
        assert_eq!(values("bending"), blocks);
    }

    #[test]
    fn a_wrong_collider_is_named() {
        let set = |name: &str| Action::set(name, 2.0).for_part(Part::Collider(9));
        let values = |name: &str| set(name).allowed_values(Reason::OutOfRange).unwrap();
        assert_eq!(values("damping"), "a number >= 0, or off for 0, no collider");
        assert_eq!(values("restitution"), "0 to 1, or off for 0, for one collider or all");
        let condition = set("friction").missing_condition().unwrap();
        assert_eq!(condition, "the scene has no collider; a scene has them with [[collider]]");
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
            let values = action.allowed_values(Reason::OutOfRange);
            assert_eq!(values.is_some(), is_checked, "{action:?}");
        }
    }
}
