//! Scenes: what is simulated, as checked values and as TOML text.
//!
//! [`Scene`] is the complete scene with every default filled in. `Model` is its expansion: every
//! particle, constraint and triangle, including the generated ones.
//!
//! From the bottom: `document` parses a text into values with their places, `fields` walks the keys of a table to read or to
//! print it, `definition` and `generate` have the tables, each with its keys, and `read` checks what concerns several tables.

pub(crate) mod definition;
mod document;
mod error;
mod fields;
mod generate;
mod lists;
mod memory;
mod mesh;
pub(crate) mod model;
mod poses;
mod read;
mod solids;
mod source;
mod warnings;

pub use definition::anchor::{SceneAnchor, Waypoint};
pub use definition::bending::{MeshBending, Rigidity, SheetBending};
pub use definition::collider::{ColliderGeometry, ColliderMesh, ColliderMeshes, SceneCollider};
pub use definition::element::{
    BendParticles, KindSoftness, Limits, SceneBend, SceneConstraint, SceneParticle, Softness,
};
pub use definition::settings::{
    ConstraintOrder, PASSES_MAX, RATE_HZ_MAX, SolverSettings, TETHERS_MAX, Up, Wind,
};
pub use definition::{SCENE_VERSION, Scene, SceneCounts};
pub use error::{SceneError, SceneProblem};
pub use generate::bridge::Bridge;
pub use generate::cloth::{Cloth, Diagonals};
pub use generate::obj::Obj;
pub use generate::pinned::Pinned;
pub use generate::ragdoll::Ragdoll;
pub use generate::rope::Rope;
pub use generate::web::Web;
pub use generate::{Generator, Shape};
pub use memory::{NotEnoughMemory, check_memory};
pub(crate) use memory::{ThreadedScene, thread_bytes};
pub use mesh::details::{FaceDetails, NameRun};
pub use mesh::pins::check_pin_expression;
pub use mesh::{Mesh, ParsedMesh};
pub use poses::ScenePoses;

pub use source::{LoadError, is_path};
