//! Softness of constraints: a compliance or a stiffness, depending on the scene's method.

use serde::Serialize;

use super::decimal;
use sim_types::ConstraintKind;
use sim_types::Method;

/// Softness of a constraint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Softness {
    /// In m/N, >= 0; 0 is rigid (method xpbd).
    Compliance(#[serde(with = "decimal::number")] f32),
    /// 0..=1; 1 is rigid (method pbd).
    Stiffness(#[serde(with = "decimal::number")] f32),
}

impl Softness {
    /// Returns the softness with this number in the measure of a method.
    pub fn new(method: Method, value: f32) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(value),
            Method::Pbd => Self::Stiffness(value),
        }
    }

    /// Returns the softness of a rigid constraint in the measure of a method.
    pub fn rigid(method: Method) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(0.0),
            Method::Pbd => Self::Stiffness(1.0),
        }
    }

    /// Returns the bare number.
    pub fn value(self) -> f32 {
        match self {
            Self::Compliance(value) | Self::Stiffness(value) => value,
        }
    }
}

/// Softness of each kind of constraint in a generator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum KindSoftness {
    /// In m/N (method xpbd).
    Compliance(SoftnessValues),
    /// 0..=1 (method pbd).
    Stiffness(SoftnessValues),
}

/// A number for each kind of constraint that generators create.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SoftnessValues {
    /// Of constraints between direct neighbours.
    #[serde(with = "decimal::number")]
    pub structural: f32,
    /// Of constraints along a diagonal.
    #[serde(with = "decimal::number")]
    pub shear: f32,
    /// Of constraints between second neighbours.
    #[serde(with = "decimal::number")]
    pub bend: f32,
}

impl KindSoftness {
    /// Returns the softness of rigid constraints in the measure of a method.
    pub fn rigid(method: Method) -> Self {
        let value = Softness::rigid(method).value();
        Self::new(method, SoftnessValues { structural: value, shear: value, bend: value })
    }

    /// Returns the softness with these numbers in the measure of a method.
    pub fn new(method: Method, values: SoftnessValues) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(values),
            Method::Pbd => Self::Stiffness(values),
        }
    }

    /// Returns the number for a kind of constraint.
    pub(crate) fn value(self, kind: ConstraintKind) -> f32 {
        let (Self::Compliance(values) | Self::Stiffness(values)) = self;
        match kind {
            ConstraintKind::Structural | ConstraintKind::Tether => values.structural,
            ConstraintKind::Shear => values.shear,
            ConstraintKind::Bend => values.bend,
        }
    }
}
