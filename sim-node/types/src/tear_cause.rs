//! The causes of tears.

use serde::{Deserialize, Serialize};

/// Cause of a tear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u32)]
pub enum TearCause {
    /// The constraint's force exceeded `tear_force`.
    Force = 0,
    /// The constraint's length exceeded `tear_stretch` times its rest length.
    Stretch = 1,
    /// The constraint's length exceeded its rest length by more than `tear_distance`.
    Distance = 2,
    /// A command cut the constraint.
    Cut = 3,
}

impl TearCause {
    /// All causes, by number.
    pub const ALL: [Self; 4] = [Self::Force, Self::Stretch, Self::Distance, Self::Cut];

    /// Returns the cause with this number; `None` for a number of another version.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }

    /// Returns the cause with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// Name in logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Stretch => "stretch",
            Self::Distance => "distance",
            Self::Cut => "cut",
        }
    }
}
