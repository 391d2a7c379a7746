//! Words in the fields of actions.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::kinds::ConstraintKind;
use crate::names::names;

/// Object that a command `follow` moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u32)]
pub enum MovedObject {
    /// A particle that the client has grabbed.
    Particle = 0,
    /// An anchor.
    Anchor = 1,
    /// A collider.
    Collider = 2,
}

names!(MovedObject: Particle = "particle", Anchor = "anchor", Collider = "collider");

/// Part of a state that a restore puts in place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(u32)]
pub enum RestoreContents {
    /// The complete state: particles and keyframe.
    State = 1,
    /// Positions and velocities. Everything else stays.
    Motion = 2,
}

names!(RestoreContents: State = "state", Motion = "motion");

/// The kind of constraints that a `set` addresses. Its JSON form is the name of the kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KindFilter {
    /// The constraints of one kind.
    Known(ConstraintKind),
    /// A kind that this version does not know. The command is rejected like any wrong value. The name
    /// is not kept: it is written as "unknown".
    Unknown,
}

impl KindFilter {
    /// Returns the filter for a kind's name.
    pub fn from_name(name: &str) -> Self {
        ConstraintKind::from_name(name).map_or(Self::Unknown, Self::Known)
    }

    /// Returns the filter for a kind's number on the wire.
    pub fn from_number(number: u32) -> Self {
        ConstraintKind::from_number(number).map_or(Self::Unknown, Self::Known)
    }

    /// Number on the wire. An unknown kind has `u32::MAX`, which no version will assign.
    pub fn number(self) -> u32 {
        match self {
            Self::Known(kind) => kind as u32,
            Self::Unknown => u32::MAX,
        }
    }

    /// Name of the kind, or "unknown".
    pub fn name(self) -> &'static str {
        match self {
            Self::Known(kind) => kind.name(),
            Self::Unknown => "unknown",
        }
    }
}

/// Name of all kinds, which is the same as none.
const ALL: &str = "all";

/// Reads the kind of a `set`: no name and "all" are all kinds.
pub(crate) fn kind_or_all<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<KindFilter>, D::Error> {
    let name = Option::<String>::deserialize(deserializer)?;
    Ok(name.filter(|name| name != ALL).map(|name| KindFilter::from_name(&name)))
}

impl Serialize for KindFilter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for KindFilter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(|name| Self::from_name(&name))
    }
}
