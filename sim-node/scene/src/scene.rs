//! The definition of a scene, its text, and what it generates: every name that a program needs.

pub use crate::definition::anchor::{SceneAnchor, Waypoint};
pub use crate::definition::bending::{MeshBending, Rigidity, SheetBending};
pub use crate::definition::collider::{
    ColliderBody, ColliderGeometry, ColliderMesh, ColliderMeshes, SceneCollider,
};
pub use crate::definition::element::{
    BendParticles, KindSoftness, Limits, SceneBend, SceneConstraint, SceneParticle, Softness,
};
pub use crate::definition::settings::{
    ConstraintOrder, ContactMode, ContactSettings, PASSES_MAX, RATE_HZ_MAX, SolverSettings,
    TETHERS_MAX, Up, Wind,
};
pub use crate::definition::{SCENE_VERSION, Scene, SceneCounts};
pub use crate::error::{SceneError, SceneProblem};
pub use crate::generate::bridge::Bridge;
pub use crate::generate::cloth::{Cloth, Diagonals};
pub use crate::generate::obj::Obj;
pub use crate::generate::pinned::Pinned;
pub use crate::generate::ragdoll::Ragdoll;
pub use crate::generate::rope::Rope;
pub use crate::generate::web::Web;
pub use crate::generate::{Generator, Shape};
pub use crate::memory::{NotEnoughMemory, check_memory};
pub use crate::mesh::details::{FaceDetails, NameRun};
pub use crate::mesh::pins::check_pin_expression;
pub use crate::mesh::{Mesh, ParsedMesh};
pub use crate::poses::ScenePoses;
pub use crate::source::{LoadError, is_path};
