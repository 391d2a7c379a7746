//! Settings of the solver, and other choices that hold for a whole scene.

use serde::{Serialize, Serializer};

use super::decimal;
use super::limits::Limits;
use sim_types::{Method, ParameterValues};

/// Largest [`SolverSettings::rate_hz`].
pub const RATE_HZ_MAX: u32 = 100_000;
/// Largest [`SolverSettings::substeps`] and [`SolverSettings::iterations`].
pub const PASSES_MAX: u32 = 1000;
/// Largest [`SolverSettings::tethers`].
pub const TETHERS_MAX: u32 = 4;

/// Axis that points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub enum Up {
    /// y.
    #[default]
    #[serde(rename = "y")]
    Y,
    /// -y, as on a screen.
    #[serde(rename = "-y")]
    MinusY,
    /// z.
    #[serde(rename = "z")]
    Z,
}

impl Up {
    /// The names in a scene.
    pub(crate) const NAMES: [(&'static str, Self); 3] =
        [("y", Self::Y), ("-y", Self::MinusY), ("z", Self::Z)];

    /// Returns the name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Y => "y",
            Self::MinusY => "-y",
            Self::Z => "z",
        }
    }

    /// Returns the axis with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(one, _)| *one == name).map(|(_, up)| *up)
    }
}

/// Order in which constraints are projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ConstraintOrder {
    /// Groups of constraints that share no particle. It is stable with small substeps.
    #[default]
    Grouped,
    /// The order of the file, for lessons and comparisons. It gains energy with small substeps.
    Listed,
}

impl ConstraintOrder {
    /// The names in a scene.
    pub(crate) const NAMES: [(&'static str, Self); 2] =
        [("grouped", Self::Grouped), ("listed", Self::Listed)];
}

/// Settings of the solver.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolverSettings {
    /// Steps per second, 1..=100000; default 240.
    pub rate_hz: u32,
    /// Substeps per step, 1..=1000; default 4.
    pub substeps: u32,
    /// Passes over the constraints in each substep, 1..=1000; default 1. At the same cost, more
    /// substeps are nearly always better than more iterations.
    pub iterations: u32,
    /// Meaning of a constraint's softness; default xpbd.
    pub method: Method,
    /// Order of projection; default grouped.
    pub order: ConstraintOrder,
    /// Decay rate of velocities in 1/s, >= 0; default 0. The terminal speed under gravity is
    /// gravity / damping. From 1/h on, nothing moves.
    #[serde(with = "decimal::number")]
    pub damping: f32,
    /// Fraction of each correction that a pass applies, 0 < w < 2; default 1. Values above 1 are
    /// successive over-relaxation, which pays only with hundreds of iterations.
    #[serde(with = "decimal::number")]
    pub relaxation: f32,
    /// Keeps free particles within the lengths of the shortest rigid paths to their nearest fixed ones:
    /// the number of these, 0..=4; default 0.
    #[serde(serialize_with = "serialize_tethers")]
    pub tethers: u32,
    /// Largest speed of a particle in unit/s, > 0; default 10000.
    #[serde(with = "decimal::number")]
    pub max_speed: f32,
    /// Limits at which constraints stop stretching and tear; default none.
    #[serde(flatten)]
    pub limits: Limits,
}

impl Default for SolverSettings {
    fn default() -> Self {
        let ParameterValues { substeps, iterations, relaxation, damping, max_speed, .. } =
            ParameterValues::DEFAULT;
        Self {
            rate_hz: 240,
            substeps,
            iterations,
            method: Method::Xpbd,
            order: ConstraintOrder::Grouped,
            damping,
            relaxation,
            tethers: 0,
            max_speed,
            limits: Limits::default(),
        }
    }
}

impl SolverSettings {
    /// Returns the length of a substep in seconds: 1 / (`rate_hz` `substeps`), rounded once.
    pub fn h(&self) -> f32 {
        substep_length(self.rate_hz, self.substeps)
    }

    /// Returns `true` if free particles have tethers.
    pub fn has_tethers(&self) -> bool {
        self.tethers > 0
    }
}

/// Serializes 0 as `false` and the maximum as `true`.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde requires")]
fn serialize_tethers<S: Serializer>(count: &u32, serializer: S) -> Result<S::Ok, S::Error> {
    match *count {
        0 | TETHERS_MAX => serializer.serialize_bool(*count > 0),
        _ => serializer.serialize_u32(*count),
    }
}

/// Returns 1 / (`rate_hz` `substeps`) in seconds, rounded once to the solver's f32.
#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the solver's f32")]
pub(crate) fn substep_length(rate_hz: u32, substeps: u32) -> f32 {
    (1.0 / (f64::from(rate_hz) * f64::from(substeps))) as f32
}
