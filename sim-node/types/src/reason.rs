//! The reasons for rejecting a command.

use std::error::Error;
use std::fmt;

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

impl Reason {
    /// All reasons, by ascending number.
    pub const ALL: [Self; 13] = [
        Self::NonFinite,
        Self::OutOfRange,
        Self::UnknownParticle,
        Self::UnknownConstraint,
        Self::UnknownAnchor,
        Self::UnknownCollider,
        Self::UnknownParameter,
        Self::AlreadyTorn,
        Self::NotGrabbed,
        Self::GrabbedByOther,
        Self::NoEffectHere,
        Self::UnknownStep,
        Self::InvalidState,
    ];

    /// Returns the reason with this number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| *reason as u32 == number)
    }

    /// Returns the reason with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| reason.name() == name)
    }

    /// Name in outcomes and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::NonFinite => "non_finite",
            Self::OutOfRange => "out_of_range",
            Self::UnknownParticle => "unknown_particle",
            Self::UnknownConstraint => "unknown_constraint",
            Self::UnknownAnchor => "unknown_anchor",
            Self::UnknownCollider => "unknown_collider",
            Self::UnknownParameter => "unknown_parameter",
            Self::AlreadyTorn => "already_torn",
            Self::NotGrabbed => "not_grabbed",
            Self::GrabbedByOther => "grabbed_by_other",
            Self::NoEffectHere => "no_effect_here",
            Self::UnknownStep => "unknown_step",
            Self::InvalidState => "invalid_state",
        }
    }
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
