//! Limits at which a constraint stops stretching, and at which it tears.

use serde::Serialize;

use super::decimal;

/// Limits at which a constraint stops stretching, and at which it tears. In the scene's settings
/// `None` is off. In a constraint `None` is the scene's limit, and infinity is off.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Limits {
    /// Largest length / rest length, > 1. It is enforced after the soft passes, at full stiffness.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub max_stretch: Option<f32>,
    /// Length / rest length above which the constraint tears, > 1.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_stretch: Option<f32>,
    /// Length beyond the rest length above which the constraint tears, in the scene's unit, >= 0.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_distance: Option<f32>,
    /// Force above which the constraint tears, in N, > 0.
    #[serde(with = "decimal::optional", skip_serializing_if = "Option::is_none")]
    pub tear_force: Option<f32>,
}

impl Limits {
    /// Returns these limits, with the other's in place of those that are `None`.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            max_stretch: self.max_stretch.or(other.max_stretch),
            tear_stretch: self.tear_stretch.or(other.tear_stretch),
            tear_distance: self.tear_distance.or(other.tear_distance),
            tear_force: self.tear_force.or(other.tear_force),
        }
    }
}
