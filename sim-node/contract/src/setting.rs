//! What `set` gives a parameter, and which constraints it is for.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::ConstraintKind;
use crate::plain_number::{number, vector};

/// The new value of a parameter: a number, three numbers or null in JSON.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, three numbers or null")]
pub enum SettingValue {
    /// In the parameter's unit.
    Number(#[serde(with = "number")] f32),
    /// In the parameter's unit, for gravity and the velocity of the wind.
    Vector(#[serde(with = "vector")] [f32; 3]),
    /// Switches the parameter off, where that means something.
    Off,
}

/// The constraints that a parameter is set for. Its JSON form is the kind's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SettingKind {
    /// Those of one kind.
    Known(ConstraintKind),
    /// A kind that this version does not know: the command is rejected, like any wrong value. Its
    /// name is not kept; it is written as "unknown".
    Unknown,
}

impl SettingKind {
    /// The kind of that name.
    pub fn from_name(name: &str) -> Self {
        ConstraintKind::from_name(name).map_or(Self::Unknown, Self::Known)
    }

    /// The kind of that number on the wire.
    pub(crate) fn from_number(number: u32) -> Self {
        ConstraintKind::from_number(number).map_or(Self::Unknown, Self::Known)
    }

    /// Its number on the wire: an unknown one is the one that no version will ever use.
    pub(crate) fn number(self) -> u32 {
        match self {
            Self::Known(kind) => kind as u32,
            Self::Unknown => u32::MAX,
        }
    }

    /// Its name, or "unknown".
    pub fn name(self) -> &'static str {
        match self {
            Self::Known(kind) => kind.name(),
            Self::Unknown => "unknown",
        }
    }
}

impl Serialize for SettingKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for SettingKind {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer).map(|name| Self::from_name(&name))
    }
}
