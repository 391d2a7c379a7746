//! The reasons for rejecting a command.

use std::error::Error;
use std::fmt;

use crate::names::names;

/// Reason why a command was rejected. A rejected command changes no bit of the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Reason {
    /// A number is NaN or infinite.
    NonFinite = 1,
    /// A coordinate exceeds 1e7, or a value lies outside its range.
    OutOfRange = 2,
    /// The scene has no such particle.
    UnknownParticle = 3,
    /// The scene has no such constraint.
    UnknownConstraint = 4,
    /// The scene has no such anchor.
    UnknownAnchor = 5,
    /// The scene has no such collider.
    UnknownCollider = 6,
    /// There is no such parameter.
    UnknownParameter = 7,
    /// The constraint is already torn.
    AlreadyTorn = 8,
    /// The particle is not grabbed.
    NotGrabbed = 9,
    /// Another client has grabbed the particle.
    GrabbedByOther = 10,
    /// The command has no effect here: the particle is frozen, the parameter belongs to the other
    /// method, `step` came while the node was running, or a recording is being played.
    NoEffectHere = 11,
    /// No state at or before that step is kept.
    UnknownStep = 12,
    /// A given state is damaged, or does not belong to the scene.
    InvalidState = 13,
}

names! {
    Reason:
    NonFinite = "non_finite",
    OutOfRange = "out_of_range",
    UnknownParticle = "unknown_particle",
    UnknownConstraint = "unknown_constraint",
    UnknownAnchor = "unknown_anchor",
    UnknownCollider = "unknown_collider",
    UnknownParameter = "unknown_parameter",
    AlreadyTorn = "already_torn",
    NotGrabbed = "not_grabbed",
    GrabbedByOther = "grabbed_by_other",
    NoEffectHere = "no_effect_here",
    UnknownStep = "unknown_step",
    InvalidState = "invalid_state",
}

impl fmt::Display for Reason {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::NonFinite => "a number is not finite",
            Self::OutOfRange => "a value is out of its range",
            Self::UnknownParticle => "the scene has no such particle",
            Self::UnknownConstraint => "the scene has no such constraint",
            Self::UnknownAnchor => "the scene has no such anchor",
            Self::UnknownCollider => "the scene has no such collider",
            Self::UnknownParameter => "there is no such parameter",
            Self::AlreadyTorn => "the constraint is already torn",
            Self::NotGrabbed => "the particle is not grabbed",
            Self::GrabbedByOther => "another client has grabbed the particle",
            Self::NoEffectHere => "the command has no effect here",
            Self::UnknownStep => "no state at or before that step is kept",
            Self::InvalidState => "the state is damaged, or does not belong to the scene",
        })
    }
}

impl Error for Reason {}
