//! The kinds of constraints.

use serde::{Deserialize, Serialize};

/// The role of a constraint in its scene.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum ConstraintKind {
    /// Joins direct neighbours.
    #[default]
    Structural = 0,
    /// Crosses a cell diagonally.
    Shear = 1,
    /// Joins second neighbours.
    Bend = 2,
    /// Acts only while it is longer than its rest length.
    Tether = 3,
}

impl ConstraintKind {
    /// All kinds, by number.
    pub const ALL: [Self; 4] = [Self::Structural, Self::Shear, Self::Bend, Self::Tether];

    /// Returns the kind with this number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }

    /// Returns the kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Name in scenes, commands and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Structural => "structural",
            Self::Shear => "shear",
            Self::Bend => "bend",
            Self::Tether => "tether",
        }
    }
}
