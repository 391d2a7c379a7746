//! Scenes: what is simulated, as checked values and as TOML text.
//!
//! [`Scene`] is the complete scene with every default filled in. `Model` is its expansion: every
//! particle, constraint and triangle, including the generated ones.
//!
//! The folders, from the bottom: `definition` has the values, `generate` the shapes that expand to
//! many particles, `read` the way from TOML text to a checked scene.

pub(crate) mod definition;
mod error;
mod generate;
mod memory;
mod mesh;
pub(crate) mod model;
mod poses;
mod read;
mod source;
mod warnings;

pub use definition::anchor::{SceneAnchor, Waypoint};
pub use definition::bending::{BendParticles, MeshBending, Rigidity, SceneBend, SheetBending};
pub use definition::collider::{ColliderGeometry, ColliderMesh, ColliderMeshes, SceneCollider};
pub use definition::element::{SceneConstraint, SceneParticle};
pub use definition::limits::Limits;
pub use definition::settings::{
    ConstraintOrder, PASSES_MAX, RATE_HZ_MAX, SolverSettings, TETHERS_MAX, Up,
};
pub use definition::softness::{KindSoftness, Softness, SoftnessValues};
pub use definition::wind::Wind;
pub use definition::{SCENE_VERSION, Scene, SceneCounts};
pub use error::SceneError;
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
