//! Colliders: solids and meshes that particles bounce off and slide along.

use std::collections::BTreeMap;

use sim_types::{ColliderFields, ColliderShape, NumberRange};

use super::anchor::{NO_ROTATION, Waypoint, check_path};
use crate::fields::{At, Fields, MASS, NamedKeys, SIZE, SceneTable, TableShape, printed};
use crate::lists::{print_lists, print_points};
use crate::mesh::source::read_mesh;
use crate::mesh::{Mesh, fan};

/// A moment of inertia.
const INERTIA: NumberRange = NumberRange { text: "1e-38 to 1e38 kg unit^2", ..MASS };
/// Moments of inertia that a solid cannot have are refused up to this share, for rounded numbers.
const ROUNDING: f32 = 1e-3;
/// A component of an angular velocity.
const ANGULAR_VELOCITY: NumberRange =
    NumberRange { min: -1e4, max: 1e4, text: "-1e4 to 1e4 rad/s", ..NumberRange::COORDINATE };
/// Range of the distance that particles keep from a mesh.
const DISTANCE: NumberRange = NumberRange { min: 0.0, text: "0 to 1e7", ..NumberRange::COORDINATE };

/// A solid or mesh that particles bounce off and slide along.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneCollider {
    /// Shape, size and pose at load.
    pub shape: ColliderGeometry,
    /// Fraction of the approach speed that a particle keeps, 0..=1.
    pub restitution: f32,
    /// Coulomb's coefficient, >= 0.
    pub friction: f32,
    /// In unit/s.
    pub velocity: [f32; 3],
    /// About the center of a box or mesh, in rad/s; 0 for all other shapes.
    pub angular_velocity: [f32; 3],
    /// Starts the path again when it ends.
    pub repeat: bool,
    /// The triangles of a mesh. All other shapes have none.
    pub mesh: Option<ColliderMesh>,
    /// The rigid body that another program moves.
    pub body: Option<ColliderBody>,
    /// Poses over time, relative to the pose at load, in place of a velocity. The collider moves linearly between them,
    /// and stands still before the first and after the last.
    pub path: Vec<Waypoint>,
}

impl SceneCollider {
    /// Returns a collider with the defaults.
    pub(crate) fn blank(shape: ColliderGeometry) -> Self {
        Self {
            shape,
            restitution: 0.0,
            friction: 0.0,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            repeat: false,
            mesh: None,
            body: None,
            path: Vec::new(),
        }
    }

    /// Walks the keys of a mesh. A text as `path` is its file.
    fn mesh_fields(&mut self, fields: &mut Fields<'_>) {
        let has_file = fields.get("file").is_some();
        let has_points = fields.get("path").is_some() && !has_path_of_file(fields);
        if has_file && has_path_of_file(fields) {
            let problem = "the mesh has a file already (allowed: a list of points in time)";
            fields.error("path", problem);
        }
        let file = if has_file || has_points { "file" } else { "path" };
        let scale = fields.get("scale").and_then(|at| at.number(SIZE)).unwrap_or(1.0);
        let mut mesh = self.mesh.take().unwrap_or_default();
        fields.value("vertices", &mut mesh.vertices, |_| None, |list| printed(&print_points(list)));
        let print =
            |list: &Vec<[u32; 3]>| printed(&print_lists(list.iter().map(<[u32; 3]>::as_slice)));
        fields.value("faces", &mut mesh.triangles, |_| None, print);
        fields.flag("solid", &mut mesh.is_solid, false);
        if let Some(Mesh { mut vertices, faces, .. }) =
            read_mesh(fields, file, Mesh::surface_from_obj)
        {
            vertices.as_flattened_mut().iter_mut().for_each(|axis| *axis *= scale);
            mesh.vertices = vertices;
            mesh.triangles = faces.iter().flat_map(|face| fan(face)).collect();
        }
        self.mesh = Some(mesh);
    }

    /// Refuses a velocity beside a body or a path, a path of a body, and bounds that rotate.
    fn check_motion(&self, fields: &Fields<'_>) {
        let reason = match self {
            Self { body: Some(_), .. } => "a body has no motion of its own",
            Self { path, .. } if !path.is_empty() => {
                "a collider with a path has no velocity beside it"
            }
            _ => return,
        };
        let velocities = [("velocity", self.velocity), ("angular_velocity", self.angular_velocity)];
        for (key, _) in velocities.into_iter().filter(|(_, velocity)| *velocity != [0.0; 3]) {
            fields.error(key, format!("{reason} (allowed: [0, 0, 0])"));
        }
        if self.body.is_some() && !self.path.is_empty() {
            fields.error("path", format!("{reason} (allowed: no points)"));
        }
        let turned = self.path.iter().position(|point| point.rotation[..3] != [0.0; 3]);
        let is_bounds = matches!(self.shape, ColliderGeometry::Bounds { .. });
        if let Some(index) = turned.filter(|_| is_bounds) {
            let problem = "bounds do not rotate (allowed: [0, 0, 0, 1])";
            fields.error_in("path", index, "rotation", problem);
        }
    }
}

impl SceneTable for SceneCollider {
    fn fields(&mut self, fields: &mut Fields<'_>) {
        use ColliderGeometry::{Bounds, Box, Mesh, Plane};
        let problem_count = fields.problem_count();
        if !fields.shape(&mut self.shape) {
            return;
        }
        self.shape.walk(fields);
        fields.number("restitution", &mut self.restitution, NumberRange::SHARE);
        fields.number("friction", &mut self.friction, NumberRange::AT_LEAST_ZERO);
        fields.vector("velocity", &mut self.velocity);
        if matches!(self.shape, Box { .. } | Mesh { .. }) {
            let print = |velocity: &[f32; 3]| printed(velocity).filter(|_| *velocity != [0.0; 3]);
            fields.value("angular_velocity", &mut self.angular_velocity, read_turn, print);
        }
        fields.flag("repeat", &mut self.repeat, false);
        if matches!(self.shape, Mesh { .. }) {
            self.mesh_fields(fields);
        }
        if !matches!(self.shape, Plane { .. } | Bounds { .. }) {
            fields.optional_table("body", &mut self.body);
        }
        if !matches!(self.shape, Mesh { .. }) || !has_path_of_file(fields) {
            fields.tables("path", &mut self.path, &Waypoint::default());
        }
        if fields.problem_count() == problem_count {
            check_path(fields, &self.path, self.repeat);
            self.check_motion(fields);
        }
    }
}

/// Returns `true` if the key `path` names a file, in place of a list of points in time.
fn has_path_of_file(fields: &Fields<'_>) -> bool {
    fields.find("path").is_some_and(|path| path.as_list().is_none())
}

/// Reads an angular velocity. In 2-D a box rotates about z only.
fn read_turn(at: At<'_>) -> Option<[f32; 3]> {
    let [x, y, z] = at.numbers()?;
    let [x, y, z] = [x, y, z].map(|axis| axis.number(ANGULAR_VELOCITY));
    let axes = [x?, y?, z?];
    if at.reader.is_planar.get() && axes[..2] != [0.0; 2] {
        return at.error("rotates out of the plane (allowed: [0, 0, z] in 2 dimensions)");
    }
    Some(axes)
}

/// Mass of a rigid body that another program moves. Its center of mass is the center of the collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColliderBody {
    /// In kg, > 0.
    pub mass: f32,
    /// Principal moments of inertia in kg unit^2, > 0: about the own axes of a box or mesh, and about the
    /// axes of the scene at load for a sphere or capsule.
    pub inertia: [f32; 3],
}

impl Default for ColliderBody {
    fn default() -> Self {
        Self { mass: 1.0, inertia: [1.0; 3] }
    }
}

impl SceneTable for ColliderBody {
    const FORM: &'static str = "a table { mass, inertia }";

    fn fields(&mut self, fields: &mut Fields<'_>) {
        fields.require("mass", MASS.text);
        fields.number("mass", &mut self.mass, MASS);
        fields.require("inertia", "three numbers > 0");
        let read = |at: At<'_>| {
            let [x, y, z] = at.numbers()?.map(|moment| moment.number(INERTIA));
            Some([x?, y?, z?])
        };
        fields.value("inertia", &mut self.inertia, read, printed);
        let [x, y, z] = self.inertia;
        let largest = x.max(y).max(z);
        let is_planar = fields.is_planar();
        // No moment exceeds the sum of the others. In 2 dimensions only the last one matters.
        if !is_planar && largest > (1.0 + ROUNDING) * (x + y + z - largest) {
            let problem =
                "no solid has these moments of inertia (allowed: none above the sum of the others)";
            fields.error("inertia", problem);
        }
    }
}

/// The triangles of a mesh, relative to its center and before its rotation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ColliderMesh {
    /// Positions, with the scale of the scene file applied.
    pub vertices: Vec<[f32; 3]>,
    /// Corners of each triangle, as indices of vertices. Either side can be touched, unless the mesh is solid.
    pub triangles: Vec<[u32; 3]>,
    /// True if the triangles enclose a solid, which particles inside leave.
    pub is_solid: bool,
}

/// Meshes by the index of their collider.
pub type ColliderMeshes = BTreeMap<usize, ColliderMesh>;

/// Shape, size and pose of a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ColliderGeometry {
    /// A half-space.
    Plane {
        /// Points out of the solid. It is normalised on use.
        normal: [f32; 3],
        /// Particles are free where normal x >= offset.
        offset: f32,
    },
    /// A solid box. A particle inside leaves it through the nearest face.
    Box {
        /// Center.
        center: [f32; 3],
        /// Half of the edge lengths along the box's own axes, > 0; in 2-D the z component is 0.
        half_extents: [f32; 3],
        /// Quaternion x, y, z, w. It is normalised on use.
        rotation: [f32; 4],
    },
    /// A solid sphere.
    Sphere {
        /// Center.
        center: [f32; 3],
        /// > 0.
        radius: f32,
    },
    /// All points within `radius` of a segment.
    Capsule {
        /// First end of the segment.
        a: [f32; 3],
        /// Second end of the segment.
        b: [f32; 3],
        /// > 0.
        radius: f32,
    },
    /// A box that particles stay inside.
    Bounds {
        /// Lowest coordinates.
        min: [f32; 3],
        /// Highest coordinates, above the lowest on each axis except z in 2-D.
        max: [f32; 3],
    },
    /// Triangles with two sides, open or closed. A particle stays on the side on which it is.
    Mesh {
        /// Position of the mesh's own origin, about which it rotates.
        center: [f32; 3],
        /// Quaternion x, y, z, w. It is normalised on use.
        rotation: [f32; 4],
        /// Distance that particles keep from the triangles, >= 0.
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

impl ColliderGeometry {
    fn walk(&mut self, fields: &mut Fields<'_>) {
        let is_planar = fields.is_planar();
        let axis_count = if is_planar { 2 } else { 3 };
        match self {
            Self::Plane { normal, offset } => {
                fields.require("normal", "three numbers");
                let read = |at: At<'_>| at.vector().and_then(|_| at.normal());
                fields.value("normal", normal, read, printed);
                fields.require("offset", NumberRange::COORDINATE.text);
                fields.number("offset", offset, NumberRange::COORDINATE);
            }
            Self::Box { center, half_extents, rotation } => {
                fields.point("center", center);
                fields.require("half_extents", "three numbers > 0");
                let read = |at: At<'_>| {
                    let extents = at.vector()?;
                    let wrong = extents[..axis_count].iter().find(|extent| **extent <= 0.0);
                    let Some(extent) = wrong else { return Some(extents) };
                    at.error(format!("{extent} is out of range (allowed: numbers > 0)"))
                };
                fields.value("half_extents", half_extents, read, printed);
                fields.rotation("rotation", rotation);
            }
            Self::Sphere { center, radius } => {
                fields.point("center", center);
                fields.size("radius", radius);
            }
            Self::Capsule { a, b, radius } => {
                fields.point("a", a);
                fields.point("b", b);
                fields.size("radius", radius);
            }
            Self::Bounds { min, max } => {
                let problem_count = fields.problem_count();
                fields.point("min", min);
                fields.require("max", "three numbers above min");
                fields.vector("max", max);
                let is_above = (0..axis_count).all(|axis| min[axis] < max[axis]);
                if !is_above && fields.problem_count() == problem_count {
                    let problem = "is not above min (allowed: greater on every axis)";
                    fields.error("max", problem);
                }
            }
            Self::Mesh { center, rotation, distance } => {
                if is_planar {
                    let problem = "a mesh needs 3 dimensions (allowed: all other shapes)";
                    fields.error("shape", problem);
                }
                fields.vector("center", center);
                fields.rotation("rotation", rotation);
                fields.number("distance", distance, DISTANCE);
            }
        }
    }
}

impl TableShape for ColliderGeometry {
    fn word(&self) -> &'static str {
        self.fields().shape.name()
    }

    fn blanks() -> Vec<Self> {
        let (zero, rotation) = ([0.0; 3], NO_ROTATION);
        vec![
            Self::Plane { normal: [0.0, 1.0, 0.0], offset: 0.0 },
            Self::Box { center: zero, half_extents: [1.0; 3], rotation },
            Self::Sphere { center: zero, radius: 1.0 },
            Self::Capsule { a: zero, b: zero, radius: 1.0 },
            Self::Bounds { min: zero, max: [1.0; 3] },
            Self::Mesh { center: zero, rotation, distance: 0.0 },
        ]
    }

    fn keys() -> Vec<NamedKeys> {
        let blanks = Self::blanks().into_iter();
        let keys = |shape: Self| NamedKeys::new(shape.word(), &mut SceneCollider::blank(shape));
        blanks.map(keys).collect()
    }
}
