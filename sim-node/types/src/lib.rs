//! Plain data shared by all programs of this project: actions and the reasons for rejecting them,
//! kinds of constraints, causes of tears, shapes of colliders, particle flags, the limits of a scene, and
//! the one table of parameters.
//!
//! ```
//! use sim_types::{Action, PARAMETERS, Parameter};
//!
//! let action: Action = serde_json::from_str(r#"{"kind":"pin","particle":3}"#)?;
//! assert_eq!(action, Action::Pin { particle: 3 });
//! let damping = Parameter::from_name("damping").map(Parameter::info);
//! assert_eq!(damping.map(|info| info.unit), Some("1/s"));
//! assert_eq!(PARAMETERS.len(), 20);
//! # Ok::<(), serde_json::Error>(())
//! ```
//!
//! This crate has no behaviour: no solver, no shared memory, no file format.
#![forbid(unsafe_code)]

mod action;
mod collider_shape;
mod constraint_kind;
mod json;
mod limits;
mod method;
mod names;
mod parameter;
mod parameter_values;
mod particle_flags;
mod path_part;
mod range;
mod reason;
mod suggestion;
mod tear_cause;
mod text;

pub use action::{
    ACTIONS, Action, ActionInfo, FieldForm, FieldInfo, GRAB_OVER_S_DEFAULT, KindFilter,
    MovedObject, RestoreContents,
};
pub use collider_shape::{ColliderFields, ColliderShape};
pub use constraint_kind::ConstraintKind;
pub use json::hash as json_hash;
pub use json::non_finite::PlainF32;
pub use limits::{
    CLIENT_ID_END, COLLIDERS_MAX, ELEMENTS_MAX, MOTION_POINTS_MAX, OVER_S_MAX,
    SCENE_SIZE_BYTES_MAX, STEP_WORK_MAX,
};
pub use method::Method;
pub use parameter::{
    Affects, OffMeaning, PARAMETERS, Parameter, ParameterInfo, ParameterValue, Part, Parts, Slider,
    ValueForm,
};
pub use parameter_values::{BlockValue, ParameterValues, SETTINGS_COUNT, Setting};
pub use particle_flags::ParticleFlags;
pub use path_part::{PathError, PathPart, PathPoint, PointFault};
pub use range::{COORDINATE_MAX, NumberRange, allowed_indices};
pub use reason::Reason;
pub use suggestion::{did_you_mean, nearest};
pub use tear_cause::TearCause;
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
