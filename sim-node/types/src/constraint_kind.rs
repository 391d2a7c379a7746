//! The kinds of constraints.

use serde::{Deserialize, Serialize};

use crate::names::names;

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

names!(ConstraintKind: Structural = "structural", Shear = "shear", Bend = "bend", Tether = "tether");
