//! The row of `/colliders`, with the key names of a scene file, and what it has of a scene.

use std::fmt::Write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sim_messages::{ColliderShape, ColliderState, PlainF32};
use sim_solver::Scene;
use sim_solver::scene::{ColliderMesh, SceneCollider};
use xxhash_rust::xxh3::xxh3_64;

/// Three numbers, which JSON stores bit for bit.
type Vector = [PlainF32; 3];

/// All colliders in their poses after a step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CollidersRow {
    /// The colliders have these poses from the end of this step to the next row.
    pub step: u64,
    /// By collider index.
    pub colliders: Vec<ColliderRow>,
}

/// One collider. Its keys are those of its shape.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColliderRow {
    /// The shape and its pose.
    #[serde(flatten)]
    #[schemars(with = "ShapeSchema")]
    pub shape: ShapeRow,
    /// Ratio of the separation speed to the approach speed, 0..=1.
    #[schemars(with = "f32")]
    pub restitution: PlainF32,
    /// Coefficient of friction.
    #[schemars(with = "f32")]
    pub friction: PlainF32,
    /// In m/s.
    #[schemars(with = "[f32; 3]")]
    pub velocity: Vector,
    /// Boxes and meshes only: about the center, in rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<[f32; 3]>")]
    pub angular_velocity: Option<Vector>,
    /// The properties that a node does not publish. Only recordings have them.
    #[serde(flatten)]
    pub details: ColliderDetails,
}

/// The properties of a collider that are fixed at load.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColliderDetails {
    /// Meshes only: name of the attachment with the triangles, an OBJ file with the scale applied.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<String>,
    /// Meshes only: true if the triangles enclose a solid, which particles inside leave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid: Option<bool>,
    /// The rigid body that another program moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<ColliderBodyRow>,
}

/// Mass of a rigid body.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ColliderBodyRow {
    /// In kg.
    #[schemars(with = "f32")]
    pub mass: PlainF32,
    /// Principal moments of inertia, in kg m^2.
    #[schemars(with = "[f32; 3]")]
    pub inertia: Vector,
}

/// The shape and pose of a collider, in m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum ShapeRow {
    /// A half-space. The free side is normal·x >= offset.
    Plane {
        /// Unit vector.
        normal: Vector,
        /// Distance of the surface from the origin, along the normal.
        offset: PlainF32,
    },
    /// A solid box.
    Box {
        /// Center.
        center: Vector,
        /// Half the side lengths, along the box's own axes.
        half_extents: Vector,
        /// Quaternion x, y, z, w.
        rotation: [PlainF32; 4],
    },
    /// A solid sphere.
    Sphere {
        /// Center.
        center: Vector,
        /// > 0.
        radius: PlainF32,
    },
    /// All points within a radius of a segment.
    Capsule {
        /// One end of the segment.
        a: Vector,
        /// The other end.
        b: Vector,
        /// > 0.
        radius: PlainF32,
    },
    /// A box that particles stay inside.
    Bounds {
        /// Lowest coordinates.
        min: Vector,
        /// Highest coordinates.
        max: Vector,
    },
    /// The triangles of the collider with this index in the scene.
    Mesh {
        /// Center.
        center: Vector,
        /// Quaternion x, y, z, w.
        rotation: [PlainF32; 4],
        /// Distance that particles keep from the triangles.
        distance: PlainF32,
    },
}

/// The schema of a shape: the keys of all shapes, because viewers accept no alternatives.
#[derive(JsonSchema)]
#[allow(dead_code, reason = "only its schema is used")]
struct ShapeSchema {
    shape: ShapeName,
    #[schemars(skip_serializing_if = "Option::is_none")]
    normal: Option<[f32; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    offset: Option<f32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    center: Option<[f32; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    half_extents: Option<[f32; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    rotation: Option<[f32; 4]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    radius: Option<f32>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    a: Option<[f32; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    b: Option<[f32; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    min: Option<[f32; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    max: Option<[f32; 3]>,
    #[schemars(skip_serializing_if = "Option::is_none")]
    distance: Option<f32>,
}

/// The names of the shapes.
#[derive(JsonSchema)]
#[schemars(rename_all = "lowercase")]
#[allow(dead_code, reason = "only its schema is used")]
enum ShapeName {
    Plane,
    Box,
    Sphere,
    Capsule,
    Bounds,
    Mesh,
}

impl CollidersRow {
    /// Returns the row of a published list, or `None` if it has an unknown shape.
    pub fn new(step: u64, colliders: &[ColliderState]) -> Option<Self> {
        let colliders = colliders.iter().map(ColliderRow::new).collect::<Option<_>>()?;
        Some(Self { step, colliders })
    }

    /// Returns the row with the details of the colliders, by index.
    #[must_use]
    pub fn with_details(mut self, details: &[ColliderDetails]) -> Self {
        for (collider, details) in self.colliders.iter_mut().zip(details) {
            collider.details = details.clone();
        }
        self
    }

    /// Returns the list as it was published.
    pub fn states(&self) -> Vec<ColliderState> {
        self.colliders.iter().map(ColliderRow::state).collect()
    }
}

impl ColliderRow {
    fn new(state: &ColliderState) -> Option<Self> {
        let shape = ColliderShape::from_number(state.shape)?;
        let angular_velocity = plain(state.angular_velocity);
        let turns = matches!(shape, ColliderShape::Box | ColliderShape::Mesh);
        Some(Self {
            shape: ShapeRow::new(shape, state),
            restitution: PlainF32(state.restitution),
            friction: PlainF32(state.friction),
            velocity: plain(state.velocity),
            angular_velocity: turns.then_some(angular_velocity),
            details: ColliderDetails::default(),
        })
    }

    fn state(&self) -> ColliderState {
        ColliderState {
            restitution: self.restitution.0,
            friction: self.friction.0,
            velocity: raw(self.velocity),
            angular_velocity: self.angular_velocity.map(raw).unwrap_or_default(),
            ..self.shape.state()
        }
    }
}

impl ShapeRow {
    fn new(shape: ColliderShape, state: &ColliderState) -> Self {
        let (center, radius) = (plain(state.center), PlainF32(state.radius));
        let (a, b) = (plain(state.a), plain(state.b));
        let rotation = state.rotation.map(PlainF32);
        match shape {
            ColliderShape::Plane => {
                Self::Plane { normal: plain(state.normal), offset: PlainF32(state.offset) }
            }
            ColliderShape::Box => {
                Self::Box { center, half_extents: plain(state.half_extents), rotation }
            }
            ColliderShape::Sphere => Self::Sphere { center, radius },
            ColliderShape::Capsule => Self::Capsule { a, b, radius },
            ColliderShape::Bounds => Self::Bounds { min: a, max: b },
            ColliderShape::Mesh => Self::Mesh { center, rotation, distance: radius },
        }
    }

    fn state(&self) -> ColliderState {
        let with =
            |shape: ColliderShape| ColliderState { shape: shape as u32, ..Default::default() };
        match *self {
            Self::Plane { normal, offset } => ColliderState {
                normal: raw(normal),
                offset: offset.0,
                ..with(ColliderShape::Plane)
            },
            Self::Box { center, half_extents, rotation } => ColliderState {
                center: raw(center),
                half_extents: raw(half_extents),
                rotation: rotation.map(|number| number.0),
                ..with(ColliderShape::Box)
            },
            Self::Sphere { center, radius } => ColliderState {
                center: raw(center),
                radius: radius.0,
                ..with(ColliderShape::Sphere)
            },
            Self::Capsule { a, b, radius } => ColliderState {
                a: raw(a),
                b: raw(b),
                radius: radius.0,
                ..with(ColliderShape::Capsule)
            },
            Self::Bounds { min, max } => {
                ColliderState { a: raw(min), b: raw(max), ..with(ColliderShape::Bounds) }
            }
            Self::Mesh { center, rotation, distance } => ColliderState {
                center: raw(center),
                rotation: rotation.map(|number| number.0),
                radius: distance.0,
                ..with(ColliderShape::Mesh)
            },
        }
    }
}

fn plain(vector: [f32; 3]) -> Vector {
    vector.map(PlainF32)
}

fn raw(vector: Vector) -> [f32; 3] {
    vector.map(|number| number.0)
}

/// The meshes and details of the colliders of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneColliders {
    /// The meshes, each once.
    pub files: Vec<MeshFile>,
    /// By collider.
    pub details: Vec<ColliderDetails>,
}

/// A mesh as an OBJ file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MeshFile {
    /// The XXH3-64 of the text as 16 hex digits, and `.obj`.
    pub name: String,
    /// Vertices relative to the center of the collider and before its rotation, with the scale applied, and faces.
    pub text: String,
}

impl SceneColliders {
    /// Returns the colliders of a scene.
    pub fn new(scene: &Scene) -> Self {
        let mut all = Self::default();
        for collider in &scene.colliders {
            let path = collider.mesh.as_ref().map(|mesh| all.add(mesh));
            all.details.push(details(collider, path));
        }
        all
    }

    /// Adds a mesh, unless it is there. Returns the name of its file.
    fn add(&mut self, mesh: &ColliderMesh) -> String {
        let text = obj_text(mesh);
        let name = mesh_file_name(text.as_bytes());
        if self.files.iter().all(|file| file.name != name) {
            self.files.push(MeshFile { name: name.clone(), text });
        }
        name
    }
}

fn details(collider: &SceneCollider, path: Option<String>) -> ColliderDetails {
    ColliderDetails {
        path,
        solid: collider.mesh.as_ref().map(|mesh| mesh.is_solid),
        body: collider.body.map(|body| ColliderBodyRow {
            mass: PlainF32(body.mass),
            inertia: body.inertia.map(PlainF32),
        }),
    }
}

/// Returns the name of a mesh with this content.
pub(crate) fn mesh_file_name(content: &[u8]) -> String {
    format!("{:016x}.obj", xxh3_64(content))
}

fn obj_text(mesh: &ColliderMesh) -> String {
    let mut text = String::new();
    for [x, y, z] in &mesh.vertices {
        let _written = writeln!(text, "v {x} {y} {z}");
    }
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|corner| corner + 1);
        let _written = writeln!(text, "f {a} {b} {c}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One collider of each shape, with every field that the shape uses set.
    fn states() -> Vec<ColliderState> {
        let any = ColliderState {
            restitution: 0.5,
            friction: f32::INFINITY,
            velocity: [0.1, -0.0, 1e-40],
            ..ColliderState::default()
        };
        let with = |shape: ColliderShape| ColliderState { shape: shape as u32, ..any };
        vec![
            ColliderState { normal: [0.0, 1.0, 0.0], offset: -0.25, ..with(ColliderShape::Plane) },
            ColliderState {
                center: [1.0, 2.0, 3.0],
                half_extents: [0.5; 3],
                rotation: [0.0, 0.6, 0.0, 0.8],
                angular_velocity: [0.0, 0.0, 2.0],
                ..with(ColliderShape::Box)
            },
            ColliderState { center: [0.1; 3], radius: 0.3, ..with(ColliderShape::Sphere) },
            ColliderState { a: [0.1; 3], b: [0.2; 3], radius: 0.3, ..with(ColliderShape::Capsule) },
            ColliderState { a: [-1.0; 3], b: [1.0; 3], ..with(ColliderShape::Bounds) },
            ColliderState {
                center: [1.0, 2.0, 3.0],
                rotation: [0.0, 0.6, 0.0, 0.8],
                radius: 0.005,
                angular_velocity: [0.0, 0.0, 2.0],
                ..with(ColliderShape::Mesh)
            },
        ]
    }

    #[test]
    fn each_shape_has_only_its_own_keys() {
        let row = CollidersRow::new(7, &states()).unwrap();
        let lines: Vec<_> =
            row.colliders.iter().map(|one| serde_json::to_string(one).unwrap()).collect();
        insta::assert_snapshot!(lines.join("\n"), @r#"
        {"shape":"plane","normal":[0.0,1.0,0.0],"offset":-0.25,"restitution":0.5,"friction":"inf","velocity":[0.1,-0.0,1e-40]}
        {"shape":"box","center":[1.0,2.0,3.0],"half_extents":[0.5,0.5,0.5],"rotation":[0.0,0.6,0.0,0.8],"restitution":0.5,"friction":"inf","velocity":[0.1,-0.0,1e-40],"angular_velocity":[0.0,0.0,2.0]}
        {"shape":"sphere","center":[0.1,0.1,0.1],"radius":0.3,"restitution":0.5,"friction":"inf","velocity":[0.1,-0.0,1e-40]}
        {"shape":"capsule","a":[0.1,0.1,0.1],"b":[0.2,0.2,0.2],"radius":0.3,"restitution":0.5,"friction":"inf","velocity":[0.1,-0.0,1e-40]}
        {"shape":"bounds","min":[-1.0,-1.0,-1.0],"max":[1.0,1.0,1.0],"restitution":0.5,"friction":"inf","velocity":[0.1,-0.0,1e-40]}
        {"shape":"mesh","center":[1.0,2.0,3.0],"rotation":[0.0,0.6,0.0,0.8],"distance":0.005,"restitution":0.5,"friction":"inf","velocity":[0.1,-0.0,1e-40],"angular_velocity":[0.0,0.0,2.0]}
        "#);
    }

    #[test]
    fn colliders_survive_a_round_trip_through_json_bit_for_bit() {
        let text = serde_json::to_string(&CollidersRow::new(7, &states()).unwrap()).unwrap();
        assert!(text.starts_with(r#"{"step":7,"colliders":[{"shape":"plane","#), "{text}");
        let read: CollidersRow = serde_json::from_str(&text).unwrap();
        let (read, written) = (read.states(), states());
        assert_eq!(
            bytemuck::cast_slice::<_, u8>(&read),
            bytemuck::cast_slice::<ColliderState, u8>(&written)
        );
    }

    #[test]
    fn an_unknown_shape_makes_no_row() {
        let state = ColliderState { shape: 6, ..ColliderState::default() };
        assert_eq!(CollidersRow::new(7, &[state]), None);
    }
}

#[cfg(test)]
mod scene_colliders_tests {
    use super::*;

    #[test]
    fn equal_meshes_are_one_file_with_the_hash_of_its_content() {
        let collider = |center: &str, x: &str| {
            format!(
                "[[collider]]\nshape = \"mesh\"\ncenter = {center}\nscale = 2\n\
                 vertices = [[{x}, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n"
            )
        };
        let text = format!(
            "version = 1\n{}{}{}",
            collider("[0, 0, 0]", "0.1"),
            collider("[0, 5, 0]", "0.1"),
            collider("[0, 9, 0]", "0.2")
        );
        let scene = Scene::from_toml(&text, "test").unwrap();
        let SceneColliders { files, details } = SceneColliders::new(&scene);
        let texts: Vec<_> = files.iter().map(|file| file.text.as_str()).collect();
        assert_eq!(
            texts,
            ["v 0.2 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n", "v 0.4 0 0\nv 2 0 0\nv 0 2 0\nf 1 2 3\n"]
        );
        for file in &files {
            assert_eq!(file.name, format!("{:016x}.obj", xxh3_64(file.text.as_bytes())));
        }
        let paths: Vec<_> = details.iter().map(|one| one.path.as_deref()).collect();
        let [first, second] = [&files[0], &files[1]].map(|file| Some(file.name.as_str()));
        assert_eq!(paths, [first, first, second]);
        let empty = Scene::from_toml("version = 1", "test").unwrap();
        assert_eq!(SceneColliders::new(&empty), SceneColliders::default());
    }
}
