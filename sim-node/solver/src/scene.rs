//! Scenes: what is simulated, as checked data and as TOML text.
//!
//! [`Scene`] is the complete effective scene, every default filled in; `Model` is what it expands
//! to: every particle, constraint and triangle.

mod anchor;
mod check;
mod collider;
mod decimal;
mod error;
mod file;
mod generate;
mod limits;
mod model;
mod obj;
mod pins;
mod read;
mod read_generator;
mod read_mesh;
mod warnings;
mod wind;

use serde::{Deserialize, Serialize};

use sim_types::{ConstraintKind, Method};

pub use anchor::{SceneAnchor, Waypoint};
pub use collider::{ColliderShape, SceneCollider};
pub use error::SceneError;
pub use generate::{
    Bridge, Cloth, Diagonals, Generator, KindSoftness, Obj, PerKind, Pinned, Ragdoll, Rope, Shape,
    Web,
};
pub use limits::Limits;
pub(crate) use model::Model;
pub use obj::{Mesh, ReadMesh};
pub use wind::Wind;

/// Most particles, and most constraints, of a scene: their indices are exact in f32.
pub const ELEMENTS_MAX: u32 = 1 << 24;

/// The version of the scene format.
pub const SCENE_VERSION: u32 = 1;

/// A checked scene with every default filled in.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    /// [`SCENE_VERSION`].
    pub version: u32,
    /// Name; the stem of the file unless given.
    pub name: String,
    /// What positions are relative to, in `unit`.
    pub origin: [f64; 3],
    /// 2 or 3; in 2-D z stays 0 bit for bit.
    pub dimensions: u32,
    /// Which axis points up; it changes the drawing only.
    pub up: Up,
    /// Unit of length; it changes the labels only.
    pub unit: String,
    /// Acceleration in unit/s^2.
    #[serde(with = "decimal::vector")]
    pub gravity: [f32; 3],
    /// How it is solved.
    pub solver: SolverSettings,
    /// The air, if it is felt.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wind: Option<Wind>,
    /// The explicit particles; they come first.
    #[serde(rename = "particle")]
    pub particles: Vec<SceneParticle>,
    /// The explicit constraints; they come first, and may use generated particles.
    #[serde(rename = "constraint")]
    pub constraints: Vec<SceneConstraint>,
    /// What particles bounce off and slide on, in the order in which they act.
    #[serde(rename = "collider")]
    pub colliders: Vec<SceneCollider>,
    /// Particles that follow a moving frame.
    #[serde(rename = "anchor")]
    pub anchors: Vec<SceneAnchor>,
    /// Generators of more particles and constraints, in order.
    #[serde(rename = "generate")]
    pub generators: Vec<Generator>,
    /// What was found in the files that it names: a sentence each.
    #[serde(skip)]
    pub findings: Vec<String>,
}

/// Which axis points up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Up {
    /// y, the default.
    #[default]
    #[serde(rename = "y")]
    Y,
    /// Down the y axis, as on a screen.
    #[serde(rename = "-y")]
    MinusY,
    /// z.
    #[serde(rename = "z")]
    Z,
}

/// How a scene is solved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SolverSettings {
    /// Steps per second, 1..=100000; default 240.
    pub rate_hz: u32,
    /// Substeps of a step, 1..=1000; default 4.
    pub substeps: u32,
    /// Passes over the constraints in a substep, 1..=1000; default 1. More substeps are nearly
    /// always better than more iterations at the same cost.
    pub iterations: u32,
    /// What softness means; default xpbd.
    pub method: Method,
    /// The order of projection; default grouped.
    pub order: ConstraintOrder,
    /// Rate at which velocity decays, in 1/s, >= 0; default 0. Speed under gravity ends at
    /// gravity / damping. Above 1/h nothing moves.
    #[serde(with = "decimal::number")]
    pub damping: f32,
    /// Share of each correction that a pass makes, 0 < w < 2; default 1. Above 1 it is successive
    /// over-relaxation, which pays only with hundreds of iterations.
    #[serde(with = "decimal::number")]
    pub relaxation: f32,
    /// Whether free particles are kept within the length of the shortest rigid path to a fixed
    /// one; default no.
    pub tethers: bool,
    /// Largest speed of a particle in unit/s, > 0; default 10000.
    #[serde(with = "decimal::number")]
    pub max_speed: f32,
    /// When constraints stop stretching, and when they tear; default never.
    #[serde(flatten)]
    pub limits: Limits,
}

/// The range of [`SolverSettings::rate_hz`].
pub const RATE_HZ_MAX: u32 = 100_000;
/// The range of [`SolverSettings::substeps`] and [`SolverSettings::iterations`].
pub const PASSES_MAX: u32 = 1000;

impl Default for SolverSettings {
    fn default() -> Self {
        Self {
            rate_hz: 240,
            substeps: 4,
            iterations: 1,
            method: Method::Xpbd,
            order: ConstraintOrder::Grouped,
            damping: 0.0,
            relaxation: 1.0,
            tethers: false,
            max_speed: 10_000.0,
            limits: Limits::default(),
        }
    }
}

impl SolverSettings {
    /// Length of a substep in seconds: 1 / (`rate_hz` `substeps`), rounded once.
    pub fn h(&self) -> f32 {
        substep_length(self.rate_hz, self.substeps)
    }
}

/// 1 / (`rate_hz` `substeps`) in seconds, rounded once to the solver's f32.
#[allow(clippy::cast_possible_truncation, reason = "the one rounding to the solver's f32")]
pub(crate) fn substep_length(rate_hz: u32, substeps: u32) -> f32 {
    (1.0 / (f64::from(rate_hz) * f64::from(substeps))) as f32
}

/// The order in which constraints are projected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ConstraintOrder {
    /// Groups of constraints that share no particle: stable in small steps.
    #[default]
    Grouped,
    /// As in the file, for lessons and comparisons: gains energy in small steps.
    Listed,
}

/// An explicit particle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SceneParticle {
    /// Relative to the scene's origin.
    #[serde(with = "decimal::vector")]
    pub position: [f32; 3],
    /// In kg, > 0; a pinned one keeps it for a later unpin.
    #[serde(with = "decimal::number")]
    pub mass: f32,
    /// Whether it is held where it stands.
    pub pinned: bool,
    /// Per second; 0 if pinned.
    #[serde(with = "decimal::vector")]
    pub velocity: [f32; 3],
}

/// An explicit constraint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SceneConstraint {
    /// Two different particles.
    pub particles: [u32; 2],
    /// >= 0.
    #[serde(with = "decimal::number")]
    pub rest_length: f32,
    /// What it is for.
    pub kind: ConstraintKind,
    /// How soft it is, in the measure of the scene's method.
    #[serde(flatten)]
    pub softness: Softness,
    /// Limits that it has instead of the scene's; infinity is off.
    #[serde(flatten)]
    pub limits: Limits,
}

/// How soft a constraint is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Softness {
    /// In m/N, >= 0; 0 is rigid (method xpbd).
    Compliance(#[serde(with = "decimal::number")] f32),
    /// 0..=1; 1 is rigid (method pbd).
    Stiffness(#[serde(with = "decimal::number")] f32),
}

impl Softness {
    /// Rigid, in the measure of a method.
    pub fn rigid(method: Method) -> Self {
        match method {
            Method::Xpbd => Self::Compliance(0.0),
            Method::Pbd => Self::Stiffness(1.0),
        }
    }

    /// The bare number.
    pub fn value(self) -> f32 {
        match self {
            Self::Compliance(value) | Self::Stiffness(value) => value,
        }
    }
}

impl Scene {
    /// Reads and checks a scene. `label` is what errors call the text: a file's path, or a name;
    /// its stem is the name of a scene that gives none.
    ///
    /// # Errors
    /// The text is not TOML, or a value is wrong: the error names the line, the field and what is
    /// allowed.
    pub fn from_toml(text: &str, label: &str) -> Result<Self, SceneError> {
        let no_files = |_: &str| Err("no files can be read here".to_owned());
        Self::from_toml_with_files(text, label, &no_files)
    }

    /// As [`Self::from_toml`], for a scene that may name files: `read_file` is given the path as it
    /// stands in the text, relative to the scene's own file, and returns the file's text or what is
    /// wrong. The scene then holds what it read, and needs the files no more.
    ///
    /// # Errors
    /// As [`Self::from_toml`], and what `read_file` says.
    pub fn from_toml_with_files(
        text: &str,
        label: &str,
        read_file: &dyn Fn(&str) -> Result<String, String>,
    ) -> Result<Self, SceneError> {
        read::scene(text, label, read_file)
    }

    /// The complete scene as TOML, every default written out; reading it gives the same scene.
    ///
    /// # Panics
    /// Never: a checked scene has a text.
    #[allow(clippy::expect_used, reason = "numbers, names and lists always have a TOML form")]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scene has a TOML form")
    }

    /// Takes another rate or number of substeps over the scene's own.
    ///
    /// # Errors
    /// Out of range; the text names the field and the range.
    pub fn override_solver(
        &mut self,
        rate_hz: Option<u32>,
        substeps: Option<u32>,
    ) -> Result<(), String> {
        let check = |name, value, max| {
            if (1..=max).contains(&value) {
                Ok(value)
            } else {
                Err(format!("{name}: {value} is out of range (allowed: 1 to {max})"))
            }
        };
        if let Some(rate_hz) = rate_hz {
            self.solver.rate_hz = check("rate", rate_hz, RATE_HZ_MAX)?;
        }
        if let Some(substeps) = substeps {
            self.solver.substeps = check("substeps", substeps, PASSES_MAX)?;
        }
        Ok(())
    }

    /// What works, but probably not as meant: a sentence each.
    pub fn warnings(&self) -> Vec<String> {
        warnings::warnings(self)
    }

    /// Particles, constraints and pinned particles, all generated ones included.
    pub fn counts(&self) -> SceneCounts {
        let model = self.model();
        SceneCounts {
            particles: model.particles.len(),
            constraints: model.constraints.len(),
            pins: model.particles.iter().filter(|particle| particle.pinned).count(),
            triangles: model.triangles.len(),
            colliders: self.colliders.len(),
            anchors: self.anchors.len(),
        }
    }

    pub(crate) fn model(&self) -> Model {
        Model::new(self)
    }
}

/// How big a scene is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct SceneCounts {
    /// Particles.
    pub particles: usize,
    /// Constraints.
    pub constraints: usize,
    /// Pinned particles.
    pub pins: usize,
    /// Triangles of the surface.
    pub triangles: usize,
    /// Colliders.
    pub colliders: usize,
    /// Anchors.
    pub anchors: usize,
}
