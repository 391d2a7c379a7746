//! The scene file as it is written, before any check: every key optional, every value with its
//! place in the text.

use serde::Deserialize;
use toml::Spanned;

use super::anchor::FileAnchor;
use super::collider::FileCollider;
use super::wind::FileWind;
use sim_types::{ConstraintKind, Method};

use super::{ConstraintOrder, Up};

/// A whole or decimal number.
pub(crate) type Number = Spanned<f64>;
/// Three numbers.
pub(crate) type Vector = Spanned<[Number; 3]>;
/// A whole number; its range is checked later.
pub(crate) type Whole = Spanned<i64>;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileScene {
    pub(crate) version: Whole,
    pub(crate) name: Option<Spanned<String>>,
    pub(crate) origin: Option<Vector>,
    pub(crate) dimensions: Option<Whole>,
    pub(crate) up: Option<Up>,
    pub(crate) unit: Option<String>,
    pub(crate) gravity: Option<Vector>,
    #[serde(default)]
    pub(crate) solver: FileSolver,
    pub(crate) wind: Option<FileWind>,
    #[serde(default)]
    pub(crate) particle: Vec<FileParticle>,
    #[serde(default)]
    pub(crate) constraint: Vec<FileConstraint>,
    #[serde(default)]
    pub(crate) collider: Vec<FileCollider>,
    #[serde(default)]
    pub(crate) anchor: Vec<FileAnchor>,
    #[serde(default)]
    pub(crate) generate: Vec<FileGenerator>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileSolver {
    pub(crate) rate_hz: Option<Whole>,
    pub(crate) substeps: Option<Whole>,
    pub(crate) iterations: Option<Whole>,
    pub(crate) method: Option<Method>,
    pub(crate) order: Option<ConstraintOrder>,
    pub(crate) damping: Option<Number>,
    pub(crate) relaxation: Option<Number>,
    #[serde(default)]
    pub(crate) tethers: bool,
    pub(crate) max_speed: Option<Number>,
    pub(crate) max_stretch: Option<Number>,
    pub(crate) tear_stretch: Option<Number>,
    pub(crate) tear_distance: Option<Number>,
    pub(crate) tear_force: Option<Number>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileParticle {
    pub(crate) position: Vector,
    pub(crate) mass: Option<Number>,
    #[serde(default)]
    pub(crate) pinned: bool,
    pub(crate) velocity: Option<Vector>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileConstraint {
    pub(crate) particles: Spanned<[Whole; 2]>,
    pub(crate) rest_length: Option<Number>,
    #[serde(default)]
    pub(crate) kind: ConstraintKind,
    pub(crate) compliance: Option<Number>,
    pub(crate) stiffness: Option<Number>,
    pub(crate) max_stretch: Option<Number>,
    pub(crate) tear_stretch: Option<Number>,
    pub(crate) tear_distance: Option<Number>,
    pub(crate) tear_force: Option<Number>,
}

/// A generator: the keys of all shapes; which of them a shape has is checked later.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileGenerator {
    pub(crate) shape: Spanned<String>,
    pub(crate) mass: Option<Number>,
    pub(crate) compliance: Option<Spanned<FileSoftness>>,
    pub(crate) stiffness: Option<Spanned<FileSoftness>>,
    pub(crate) tear_stretch: Option<Number>,
    pub(crate) pinned: Option<Spanned<FilePinned>>,
    pub(crate) columns: Option<Whole>,
    pub(crate) rows: Option<Whole>,
    pub(crate) spacing: Option<Number>,
    pub(crate) origin: Option<Vector>,
    pub(crate) right: Option<Vector>,
    pub(crate) down: Option<Vector>,
    pub(crate) links: Option<Spanned<Vec<ConstraintKind>>>,
    pub(crate) diagonals: Option<Whole>,
    pub(crate) count: Option<Whole>,
    pub(crate) from: Option<Vector>,
    pub(crate) to: Option<Vector>,
    pub(crate) center: Option<Vector>,
    pub(crate) radius: Option<Number>,
    pub(crate) spokes: Option<Whole>,
    pub(crate) rings: Option<Whole>,
    pub(crate) normal: Option<Vector>,
    pub(crate) planks: Option<Whole>,
    pub(crate) width: Option<Number>,
    pub(crate) height: Option<Number>,
    pub(crate) path: Option<Spanned<String>>,
    pub(crate) density: Option<Number>,
    pub(crate) vertices: Option<Spanned<Vec<Vector>>>,
    pub(crate) faces: Option<Spanned<Vec<Vec<u32>>>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileSoftness {
    pub(crate) structural: Option<Number>,
    pub(crate) shear: Option<Number>,
    pub(crate) bend: Option<Number>,
}

/// Which particles of a shape are pinned: a word, or a list of indices within the shape.
#[derive(Debug, Deserialize)]
#[serde(untagged, expecting = "expected a word in quotes or a list of indices")]
pub(crate) enum FilePinned {
    Word(String),
    List(Vec<u32>),
}
