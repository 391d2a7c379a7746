//! Plain data shared by all programs of this project: actions and the reasons for rejecting them,
//! kinds of constraints, causes of tears, shapes of colliders, particle flags, the limits of a scene,
//! the one table of parameters, and the flag that requests an end.
//!
//! ```
//! use sim_types::{Action, PARAMETERS, Parameter};
//!
//! let action: Action = serde_json::from_str(r#"{"kind":"pin","particle":3}"#)?;
//! assert_eq!(action, Action::Pin { particle: 3 });
//! let damping = Parameter::from_name("damping").map(Parameter::info);
//! assert_eq!(damping.map(|info| info.unit), Some("1/s"));
//! assert_eq!(PARAMETERS[1].name, "damping");
//! # Ok::<(), serde_json::Error>(())
//! ```
//!
//! This crate has no behaviour: no solver, no shared memory, no file format.
#![forbid(unsafe_code)]

mod action;
mod json;
mod kinds;
mod limits;
mod names;
mod parameter;
mod parameter_values;
mod path_part;
mod reason;
mod stop_flag;
mod suggestion;
mod text;

pub use action::{
    ACTIONS, Action, ActionInfo, FieldForm, FieldInfo, GRAB_OVER_S_DEFAULT, KindFilter,
    MovedObject, RestoreContents,
};
pub use json::PlainF32;
pub use json::hash as json_hash;
pub use kinds::{ColliderFields, ColliderShape, ConstraintKind, Method, ParticleFlags, TearCause};
pub use limits::{
    CLIENT_ID_END, COLLIDERS_MAX, COORDINATE_MAX, ELEMENTS_MAX, MOTION_POINTS_MAX, NumberRange,
    OVER_S_MAX, SCENE_SIZE_BYTES_MAX, STEP_WORK_MAX, allowed_indices,
};
pub use parameter::{
    Affects, OffMeaning, PARAMETERS, Parameter, ParameterInfo, ParameterValue, Part, Parts, Slider,
    ValueForm,
};
pub use parameter_values::{BlockValue, ParameterValues, SETTINGS_COUNT, Setting};
pub use path_part::{PathError, PathPart, PathPoint, PointFault};
pub use reason::Reason;
pub use stop_flag::StopFlag;
pub use suggestion::{did_you_mean, nearest};
pub use text::printable::{printable, printable_line};
pub use text::{Text, TextError};

#[cfg(test)]
mod tests {
    /// Checks that each name and number of an enum converts back to its variant.
    macro_rules! assert_names_and_numbers {
        ($type:ty, $number:ty) => {
            for (number, variant) in <$type>::ALL.into_iter().enumerate() {
                assert_eq!(variant as usize, number);
                assert_eq!(
                    <$type>::from_number(<$number>::try_from(number).unwrap()),
                    Some(variant)
                );
                assert_eq!(<$type>::from_name(variant.name()), Some(variant));
            }
            assert_eq!(<$type>::from_number(<$number>::MAX), None);
            assert_eq!(<$type>::from_name("nonsense"), None);
        };
    }

    #[test]
    fn every_variant_has_one_name_and_one_number() {
        assert_names_and_numbers!(super::ConstraintKind, u32);
        assert_names_and_numbers!(super::ColliderShape, u32);
        assert_names_and_numbers!(super::Method, u32);
        assert_names_and_numbers!(super::TearCause, u32);
    }

    #[test]
    fn every_reason_has_one_name_and_one_number() {
        for reason in super::Reason::ALL {
            assert_eq!(super::Reason::from_number(reason as u32), Some(reason));
            assert_eq!(super::Reason::from_name(reason.name()), Some(reason));
        }
        assert_eq!(super::Reason::from_number(0), None);
    }
}
