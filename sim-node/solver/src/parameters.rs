//! What can be changed while a scene runs.

use serde::{Deserialize, Serialize};

use crate::constraints::ConstraintKind;
use crate::scene::{Limits, Method, PASSES_MAX, Range32, Scene, Wind};
use crate::{Rejection, is_near};

/// A new value for a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Setting {
    /// None: no limit, no damping, no wind.
    Off,
    /// A number.
    Number(f32),
    /// Three numbers.
    Vector([f32; 3]),
}

/// The names of everything that [`crate::Solver::set`] knows.
pub const PARAMETERS: [&str; 15] = [
    "gravity",
    "damping",
    "wind_velocity",
    "wind_drag",
    "substeps",
    "iterations",
    "relaxation",
    "max_stretch",
    "tear_stretch",
    "tear_distance",
    "tear_force",
    "max_speed",
    "time_scale",
    "compliance",
    "stiffness",
];

/// The slowest and the fastest pace of a node, as multiples of real time.
const TIME_SCALE: std::ops::RangeInclusive<f32> = 1e-3..=1e3;

/// What can be changed while a scene runs. Part of the state: a keyframe holds it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Parameters {
    pub(crate) gravity: [f32; 3],
    pub(crate) damping: f32,
    pub(crate) relaxation: f32,
    pub(crate) max_speed: f32,
    pub(crate) substeps: u32,
    pub(crate) iterations: u32,
    pub(crate) wind_velocity: [f32; 3],
    pub(crate) wind_drag: f32,
    max_stretch: Option<f32>,
    tear_stretch: Option<f32>,
    tear_distance: Option<f32>,
    tear_force: Option<f32>,
    /// By kind: the softness that all constraints of that kind have instead of their own.
    softness: [Option<f32>; 4],
}

/// What a value is checked against.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Context {
    pub(crate) method: Method,
    pub(crate) is_planar: bool,
}

/// What has to be worked out again after a parameter was set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Affected {
    /// Nothing: the step reads it as it is.
    Nothing,
    /// What constraints derive from it.
    Constraints,
    /// That, and which paths are rigid.
    RigidPaths,
}

impl Parameters {
    pub(crate) fn new(scene: &Scene) -> Self {
        let solver = &scene.solver;
        let limits = solver.limits;
        // Without a block of its own, air is not felt.
        let wind = scene.wind.unwrap_or(Wind { drag: 0.0, ..Wind::default() });
        Self {
            gravity: scene.gravity,
            damping: solver.damping,
            relaxation: solver.relaxation,
            max_speed: solver.max_speed,
            substeps: solver.substeps,
            iterations: solver.iterations,
            wind_velocity: wind.velocity,
            wind_drag: wind.drag,
            max_stretch: limits.max_stretch,
            tear_stretch: limits.tear_stretch,
            tear_distance: limits.tear_distance,
            tear_force: limits.tear_force,
            softness: [None; 4],
        }
    }

    /// The scene's limits as they are now.
    pub(crate) fn limits(&self) -> Limits {
        let Self { max_stretch, tear_stretch, tear_distance, tear_force, .. } = *self;
        Limits { max_stretch, tear_stretch, tear_distance, tear_force }
    }

    /// The softness of a constraint of that kind whose own is `own`.
    pub(crate) fn softness(&self, kind: ConstraintKind, own: f32) -> f32 {
        self.softness[kind as usize].unwrap_or(own)
    }

    /// Sets one parameter; a wrong value changes nothing.
    pub(crate) fn set(
        &mut self,
        name: &str,
        setting: Setting,
        kind: Option<ConstraintKind>,
        context: Context,
    ) -> Result<Affected, Rejection> {
        if !PARAMETERS.contains(&name) {
            return Err(Rejection::UnknownParameter);
        }
        check_finite(setting)?;
        let is_softness = matches!(name, "compliance" | "stiffness");
        if kind.is_some() && !is_softness {
            return Err(Rejection::OutOfRange);
        }
        match name {
            "gravity" => self.gravity = vector(setting, context)?,
            "wind_velocity" => self.wind_velocity = vector(setting, context)?,
            "damping" => self.damping = number_or_zero(setting, Range32::AT_LEAST_ZERO)?,
            "wind_drag" => self.wind_drag = number_or_zero(setting, Range32::AT_LEAST_ZERO)?,
            "relaxation" => self.relaxation = number(setting, Range32::RELAXATION)?,
            "max_speed" => self.max_speed = number(setting, Range32::POSITIVE)?,
            "time_scale" => check_time_scale(setting)?,
            "substeps" => self.substeps = whole(setting)?,
            "iterations" => self.iterations = whole(setting)?,
            "max_stretch" => self.max_stretch = limit(setting, Range32::RATIO)?,
            "tear_stretch" => self.tear_stretch = limit(setting, Range32::RATIO)?,
            "tear_distance" => self.tear_distance = limit(setting, Range32::DISTANCE_LIMIT)?,
            "tear_force" => self.tear_force = limit(setting, Range32::FORCE_LIMIT)?,
            _ => self.set_softness(name, setting, kind, context.method)?,
        }
        Ok(match name {
            "compliance" | "stiffness" => Affected::RigidPaths,
            "substeps" | "iterations" | "relaxation" | "wind_drag" => Affected::Constraints,
            "max_stretch" | "tear_stretch" | "tear_distance" | "tear_force" => {
                Affected::Constraints
            }
            _ => Affected::Nothing,
        })
    }

    fn set_softness(
        &mut self,
        name: &str,
        setting: Setting,
        kind: Option<ConstraintKind>,
        method: Method,
    ) -> Result<(), Rejection> {
        let (own, range) = match method {
            Method::Xpbd => ("compliance", Range32::COMPLIANCE),
            Method::Pbd => ("stiffness", Range32::SHARE),
        };
        // The other one means nothing with this method.
        if name != own {
            return Err(Rejection::NoEffectHere);
        }
        let value = Some(number(setting, range)?);
        match kind {
            Some(kind) => self.softness[kind as usize] = value,
            None => self.softness = [value; 4],
        }
        Ok(())
    }

    /// Whether a scene of that method and dimension can have these.
    pub(crate) fn is_valid(&self, context: Context) -> bool {
        let softness = match context.method {
            Method::Xpbd => Range32::COMPLIANCE,
            Method::Pbd => Range32::SHARE,
        };
        let passes = 1..=PASSES_MAX;
        let is_limit = |limit: Option<f32>, range: Range32| limit.is_none_or(|one| range.has(one));
        is_vector(self.gravity, context)
            && is_vector(self.wind_velocity, context)
            && is_number(self.damping, Range32::AT_LEAST_ZERO)
            && is_number(self.wind_drag, Range32::AT_LEAST_ZERO)
            && is_number(self.relaxation, Range32::RELAXATION)
            && is_number(self.max_speed, Range32::POSITIVE)
            && passes.contains(&self.substeps)
            && passes.contains(&self.iterations)
            && is_limit(self.max_stretch, Range32::RATIO)
            && is_limit(self.tear_stretch, Range32::RATIO)
            && is_limit(self.tear_distance, Range32::DISTANCE_LIMIT)
            && is_limit(self.tear_force, Range32::FORCE_LIMIT)
            && self.softness.iter().all(|one| is_limit(*one, softness))
    }
}

fn check_finite(setting: Setting) -> Result<(), Rejection> {
    let is_finite = match setting {
        Setting::Off => true,
        Setting::Number(number) => number.is_finite(),
        Setting::Vector(vector) => vector.iter().all(|axis| axis.is_finite()),
    };
    if is_finite { Ok(()) } else { Err(Rejection::NonFinite) }
}

fn is_number(number: f32, range: Range32) -> bool {
    number.is_finite() && range.has(number)
}

fn is_vector(vector: [f32; 3], context: Context) -> bool {
    vector.iter().all(|axis| axis.is_finite())
        && is_near(&vector)
        && (!context.is_planar || vector[2] == 0.0)
}

fn number(setting: Setting, range: Range32) -> Result<f32, Rejection> {
    match setting {
        Setting::Number(number) if range.has(number) => Ok(number),
        _ => Err(Rejection::OutOfRange),
    }
}

fn number_or_zero(setting: Setting, range: Range32) -> Result<f32, Rejection> {
    if setting == Setting::Off { Ok(0.0) } else { number(setting, range) }
}

fn limit(setting: Setting, range: Range32) -> Result<Option<f32>, Rejection> {
    if setting == Setting::Off { Ok(None) } else { number(setting, range).map(Some) }
}

fn vector(setting: Setting, context: Context) -> Result<[f32; 3], Rejection> {
    match setting {
        Setting::Off => Ok([0.0; 3]),
        Setting::Vector(vector) if is_vector(vector, context) => Ok(vector),
        _ => Err(Rejection::OutOfRange),
    }
}

fn whole(setting: Setting) -> Result<u32, Rejection> {
    let Setting::Number(number) = setting else { return Err(Rejection::OutOfRange) };
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "compared with the number that it came from"
    )]
    let whole = number as u32;
    if whole as f32 == number && (1..=PASSES_MAX).contains(&whole) {
        Ok(whole)
    } else {
        Err(Rejection::OutOfRange)
    }
}

/// The pace is the node's: here it is only checked, so that it is refused everywhere alike.
fn check_time_scale(setting: Setting) -> Result<(), Rejection> {
    match setting {
        Setting::Number(number) if TIME_SCALE.contains(&number) => Ok(()),
        _ => Err(Rejection::OutOfRange),
    }
}
