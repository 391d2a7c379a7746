//! Colliders: solids and meshes that particles bounce off and slide along.

use std::collections::BTreeMap;

use serde::Serialize;
use sim_types::{ColliderFields, ColliderShape};

use super::anchor::Waypoint;
use super::decimal;

/// A solid or mesh that particles bounce off and slide along.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SceneCollider {
    /// Shape, size and pose at load.
    #[serde(flatten)]
    pub shape: ColliderGeometry,
    /// Fraction of the approach speed that a particle keeps, 0..=1.
    #[serde(with = "decimal::number")]
    pub restitution: f32,
    /// Coulomb's coefficient, >= 0.
    #[serde(with = "decimal::number")]
    pub friction: f32,
    /// In unit/s.
    #[serde(with = "decimal::vector")]
    pub velocity: [f32; 3],
    /// About the center of a box or mesh, in rad/s; 0 for all other shapes.
    #[serde(with = "decimal::vector", skip_serializing_if = "is_zero")]
    pub angular_velocity: [f32; 3],
    /// Starts the path again when it ends.
    #[serde(skip_serializing_if = "is_false")]
    pub repeat: bool,
    /// The triangles of a mesh. All other shapes have none.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<ColliderMesh>,
    /// The rigid body that another program moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<ColliderBody>,
    /// Poses over time, relative to the pose at load, in place of a velocity. The collider moves linearly between them,
    /// and stands still before the first and after the last.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<Waypoint>,
}

/// Mass of a rigid body that another program moves. Its center of mass is the center of the collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ColliderBody {
    /// In kg, > 0.
    #[serde(with = "decimal::number")]
    pub mass: f32,
    /// Principal moments of inertia in kg unit^2, > 0: about the own axes of a box or mesh, and about the
    /// axes of the scene at load for a sphere or capsule.
    #[serde(with = "decimal::vector")]
    pub inertia: [f32; 3],
}

/// The triangles of a mesh, relative to its center and before its rotation.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ColliderMesh {
    /// Positions, with the scale of the scene file applied.
    #[serde(serialize_with = "decimal::vectors::serialize")]
    pub vertices: Vec<[f32; 3]>,
    /// Corners of each triangle, as indices of vertices. Either side can be touched, unless the mesh is solid.
    #[serde(rename = "faces")]
    pub triangles: Vec<[u32; 3]>,
    /// True if the triangles enclose a solid, which particles inside leave.
    #[serde(rename = "solid", skip_serializing_if = "is_false")]
    pub is_solid: bool,
}

/// Meshes by the index of their collider.
pub type ColliderMeshes = BTreeMap<usize, ColliderMesh>;

/// Decides whether to write the key, which only boxes and meshes accept.
fn is_zero(vector: &[f32; 3]) -> bool {
    *vector == [0.0; 3]
}

/// Decides whether to write a key that is false by default.
#[allow(clippy::trivially_copy_pass_by_ref, reason = "the signature that serde requires")]
fn is_false(value: &bool) -> bool {
    !*value
}

/// Shape, size and pose of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum ColliderGeometry {
    /// A half-space.
    Plane {
        /// Points out of the solid. It is normalised on use.
        #[serde(with = "decimal::vector")]
        normal: [f32; 3],
        /// Particles are free where normal x >= offset.
        #[serde(with = "decimal::number")]
        offset: f32,
    },
    /// A solid box. A particle inside leaves it through the nearest face.
    Box {
        /// Center.
        #[serde(with = "decimal::vector")]
        center: [f32; 3],
        /// Half of the edge lengths along the box's own axes, > 0; in 2-D the z component is 0.
        #[serde(with = "decimal::vector")]
        half_extents: [f32; 3],
        /// Quaternion x, y, z, w. It is normalised on use.
        #[serde(with = "decimal::quaternion")]
        rotation: [f32; 4],
    },
    /// A solid sphere.
    Sphere {
        /// Center.
        #[serde(with = "decimal::vector")]
        center: [f32; 3],
        /// > 0.
        #[serde(with = "decimal::number")]
        radius: f32,
    },
    /// All points within `radius` of a segment.
    Capsule {
        /// First end of the segment.
        #[serde(with = "decimal::vector")]
        a: [f32; 3],
        /// Second end of the segment.
        #[serde(with = "decimal::vector")]
        b: [f32; 3],
        /// > 0.
        #[serde(with = "decimal::number")]
        radius: f32,
    },
    /// A box that particles stay inside.
    Bounds {
        /// Lowest coordinates.
        #[serde(with = "decimal::vector")]
        min: [f32; 3],
        /// Highest coordinates, above the lowest on each axis except z in 2-D.
        #[serde(with = "decimal::vector")]
        max: [f32; 3],
    },
    /// Triangles with two sides, open or closed. A particle stays on the side on which it is.
    Mesh {
        /// Position of the mesh's own origin, about which it rotates.
        #[serde(with = "decimal::vector")]
        center: [f32; 3],
        /// Quaternion x, y, z, w. It is normalised on use.
        #[serde(with = "decimal::quaternion")]
        rotation: [f32; 4],
        /// Distance that particles keep from the triangles, >= 0.
        #[serde(with = "decimal::number")]
        distance: f32,
    },
}

impl ColliderGeometry {
    /// Returns the shape, size and pose as plain numbers, as programs publish and record them.
    pub fn fields(&self) -> ColliderFields {
        let new = ColliderFields::new;
        match *self {
            Self::Plane { normal, offset } => {
                ColliderFields { normal, offset, ..new(ColliderShape::Plane) }
            }
            Self::Box { center, half_extents, rotation } => {
                ColliderFields { center, half_extents, rotation, ..new(ColliderShape::Box) }
            }
            Self::Sphere { center, radius } => {
                ColliderFields { center, radius, ..new(ColliderShape::Sphere) }
            }
            Self::Capsule { a, b, radius } => {
                ColliderFields { a, b, radius, ..new(ColliderShape::Capsule) }
            }
            Self::Bounds { min, max } => {
                ColliderFields { a: min, b: max, ..new(ColliderShape::Bounds) }
            }
            Self::Mesh { center, rotation, distance: radius } => {
                ColliderFields { center, rotation, radius, ..new(ColliderShape::Mesh) }
            }
        }
    }
}
