//! The causes of tears.

use serde::{Deserialize, Serialize};

use crate::names::names;

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

names!(TearCause: Force = "force", Stretch = "stretch", Distance = "distance", Cut = "cut");
