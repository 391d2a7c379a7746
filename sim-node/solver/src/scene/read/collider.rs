//! The table `[[collider]]`.

use std::ops::Range;

use serde::Deserialize;
use sim_types::{ColliderShape, NumberRange};

use super::anchor::FileWaypoint;
use super::body::FileBody;
use super::collider_path::ColliderPath;
use super::mesh::MeshKeys;
use super::reader::{ANGULAR_VELOCITY, Reader, SIZE};
use super::value::{
    Number, Quaternion, Spanned, Table, TableKeys, Tables, Vector, Word, append_elements,
    element_count,
};
use crate::checks::is_near;
use crate::contacts::mesh::collision_mesh::remove_slivers;
use crate::contacts::mesh::inside::{SolidFlaw, find_flaw, remove_collapsed};
use crate::scene::definition::anchor::Waypoint;
use crate::scene::definition::collider::{ColliderGeometry, ColliderMesh, SceneCollider};
use crate::scene::error::SceneError;
use crate::scene::mesh::{Mesh, fan};

/// The keys of all shapes. The keys of each shape are checked later.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FileCollider {
    shape: Option<Word>,
    restitution: Option<Number>,
    friction: Option<Number>,
    velocity: Option<Vector>,
    angular_velocity: Option<Vector>,
    normal: Option<Vector>,
    offset: Option<Number>,
    center: Option<Vector>,
    half_extents: Option<Vector>,
    rotation: Option<Quaternion>,
    radius: Option<Number>,
    a: Option<Vector>,
    b: Option<Vector>,
    min: Option<Vector>,
    max: Option<Vector>,
    path: Option<Spanned<ColliderPath>>,
    repeat: Option<Spanned<bool>>,
    file: Option<Word>,
    vertices: Option<Spanned<Vec<Vector>>>,
    faces: Option<Spanned<Vec<Vec<i64>>>>,
    scale: Option<Number>,
    distance: Option<Number>,
    solid: Option<Spanned<bool>>,
    body: Option<Spanned<Table<FileBody>>>,
}

impl TableKeys for FileCollider {}

/// Range of the distance that particles keep from a mesh.
const DISTANCE: NumberRange = NumberRange { min: 0.0, text: "0 to 1e7", ..NumberRange::COORDINATE };

/// Returns the keys of a shape beside those of all shapes.
fn keys(shape: ColliderShape) -> &'static [&'static str] {
    match shape {
        ColliderShape::Plane => &["normal", "offset"],
        ColliderShape::Box => &["center", "half_extents", "rotation", "angular_velocity", "body"],
        ColliderShape::Sphere => &["center", "radius", "body"],
        ColliderShape::Capsule => &["a", "b", "radius", "body"],
        ColliderShape::Bounds => &["min", "max"],
        ColliderShape::Mesh => &[
            "path",
            "file",
            "vertices",
            "faces",
            "scale",
            "center",
            "rotation",
            "distance",
            "solid",
            "angular_velocity",
            "body",
        ],
    }
}

impl FileCollider {
    /// The lists that a text can give in parts.
    pub(super) const LISTS: [&str; 2] = ["vertices", "faces"];

    /// Appends the lists of a part of the table.
    pub(super) fn append(&mut self, part: Self) {
        append_elements(self.vertices.as_mut(), part.vertices);
        append_elements(self.faces.as_mut(), part.faces);
    }

    /// Returns the size of the lists in memory.
    pub(super) fn lists_size_bytes(&self) -> usize {
        let faces = self.faces.iter().flat_map(Spanned::get_ref);
        element_count(self.vertices.as_ref()) * size_of::<Vector>()
            + self.points().map_or(0, |points| size_of_val(points.as_slice()))
            + faces.map(|face| size_of_val(face) + size_of_val(face.as_slice())).sum::<usize>()
    }

    /// Returns the file of a mesh: `file`, or a text as `path`.
    fn mesh_file(&self) -> Option<Word> {
        let path = || self.path.as_ref().and_then(ColliderPath::file);
        self.file.as_ref().map(|file| file.with(file.get_ref().clone())).or_else(path)
    }

    /// Returns the points in time.
    fn points(&self) -> Option<&Tables<FileWaypoint>> {
        self.path.as_ref().and_then(ColliderPath::points)
    }

    /// Returns the places of the keys that belong to single shapes.
    fn shape_keys(&self) -> [(&'static str, Option<Range<usize>>); 19] {
        fn span<T>(value: Option<&Spanned<T>>) -> Option<Range<usize>> {
            value.map(Spanned::span)
        }
        [
            ("angular_velocity", span(self.angular_velocity.as_ref())),
            ("normal", span(self.normal.as_ref())),
            ("offset", span(self.offset.as_ref())),
            ("center", span(self.center.as_ref())),
            ("half_extents", span(self.half_extents.as_ref())),
            ("rotation", span(self.rotation.as_ref())),
            ("radius", span(self.radius.as_ref())),
            ("a", span(self.a.as_ref())),
            ("b", span(self.b.as_ref())),
            ("min", span(self.min.as_ref())),
            ("max", span(self.max.as_ref())),
            ("path", span(self.path.as_ref()).filter(|_| self.points().is_none())),
            ("file", span(self.file.as_ref())),
            ("vertices", span(self.vertices.as_ref())),
            ("faces", span(self.faces.as_ref())),
            ("scale", span(self.scale.as_ref())),
            ("distance", span(self.distance.as_ref())),
            ("solid", span(self.solid.as_ref())),
            ("body", span(self.body.as_ref())),
        ]
    }
}

impl Reader<'_> {
    /// Checks a table `[[collider]]`.
    pub(super) fn collider(
        &self,
        index: usize,
        table: &Spanned<Table<FileCollider>>,
    ) -> Result<SceneCollider, SceneError> {
        let field = |key: &str| format!("collider[{index}].{key}");
        let file = table.get_ref();
        let fields = ColliderFields { reader: self, field: &field, file, span: table.span() };
        let number_or_zero = |key: &str, number: &Option<Number>, range| {
            number.as_ref().map_or(Ok(0.0), |number| self.ranged(&field(key), number, range))
        };
        let shape = fields.geometry()?;
        let is_mesh = matches!(shape, ColliderGeometry::Mesh { .. });
        let body = file.body.as_ref().map(|table| self.body(&field, table)).transpose()?;
        if body.is_some() {
            self.refuse_motion(&field, file, "a body has no motion of its own")?;
        }
        let path = self.collider_path(&field, file)?;
        if let Some(given) = file.path.as_ref().filter(|_| body.is_some() && !path.is_empty()) {
            let problem = "a body has no motion of its own (allowed: no points)";
            return self.error(given.span(), &field("path"), problem);
        }
        Ok(SceneCollider {
            shape,
            restitution: number_or_zero("restitution", &file.restitution, NumberRange::SHARE)?,
            friction: number_or_zero("friction", &file.friction, NumberRange::AT_LEAST_ZERO)?,
            velocity: self.vector_or(&field("velocity"), file.velocity.as_ref(), [0.0; 3])?,
            angular_velocity: self.angular_velocity(&field, file.angular_velocity.as_ref())?,
            mesh: is_mesh.then(|| fields.mesh()).transpose()?,
            body,
            repeat: self.repeat(&field("repeat"), file.repeat.as_ref(), path.len())?,
            path,
        })
    }

    /// Returns the points of a path, which takes the place of a velocity. Bounds do not rotate.
    fn collider_path(
        &self,
        field: &impl Fn(&str) -> String,
        file: &FileCollider,
    ) -> Result<Vec<Waypoint>, SceneError> {
        let Some(points) = file.points() else { return Ok(Vec::new()) };
        let path = self.path(&field("path"), points)?;
        self.refuse_motion(field, file, "a collider with a path has no velocity beside it")?;
        let is_bounds = file
            .shape
            .as_ref()
            .is_some_and(|shape| shape.get_ref() == ColliderShape::Bounds.name());
        let is_turned = |point: &Waypoint| point.rotation[..3] != [0.0; 3];
        let turned = path.iter().position(is_turned).filter(|_| is_bounds);
        if let Some(index) = turned {
            let (key, span) = (format!("path[{index}].rotation"), points[index].span());
            let problem = "bounds do not rotate (allowed: [0, 0, 0, 1])";
            return self.error(span, &field(&key), problem);
        }
        Ok(path)
    }

    /// Refuses a velocity, for the reason given.
    fn refuse_motion(
        &self,
        field: &impl Fn(&str) -> String,
        file: &FileCollider,
        reason: &str,
    ) -> Result<(), SceneError> {
        let keys = [("velocity", &file.velocity), ("angular_velocity", &file.angular_velocity)];
        for (key, value) in keys {
            let moving = value
                .as_ref()
                .filter(|value| value.get_ref().iter().any(|number| *number.get_ref() != 0.0));
            if let Some(value) = moving {
                let problem = format!("{reason} (allowed: [0, 0, 0])");
                return self.error(value.span(), &field(key), problem);
            }
        }
        Ok(())
    }

    /// Returns an angular velocity; by default 0. In 2-D a box rotates about z only.
    fn angular_velocity(
        &self,
        field: &impl Fn(&str) -> String,
        vector: Option<&Vector>,
    ) -> Result<[f32; 3], SceneError> {
        let Some(vector) = vector else { return Ok([0.0; 3]) };
        let field = field("angular_velocity");
        let mut axes = [0.0; 3];
        for (axis, number) in axes.iter_mut().zip(vector.get_ref().iter()) {
            *axis = self.ranged(&field, number, ANGULAR_VELOCITY)?;
        }
        if self.is_planar && axes[..2] != [0.0; 2] {
            let problem = "rotates out of the plane (allowed: [0, 0, z] in 2 dimensions)";
            return self.error(vector.span(), &field, problem);
        }
        Ok(axes)
    }
}

/// The keys of one collider.
struct ColliderFields<'r, 't, F> {
    reader: &'r Reader<'t>,
    field: &'r F,
    file: &'r FileCollider,
    span: Range<usize>,
}

impl<F: Fn(&str) -> String> ColliderFields<'_, '_, F> {
    fn geometry(&self) -> Result<ColliderGeometry, SceneError> {
        let file = self.file;
        let shapes = ColliderShape::ALL.map(|shape| (shape.name(), shape));
        let allowed = shapes.map(|(name, _)| name).join(", ");
        let shape = self.required("shape", file.shape.as_ref(), &allowed)?;
        let shape = self.reader.word(&(self.field)("shape"), shape, &shapes)?;
        self.check_keys(shape)?;
        match shape {
            ColliderShape::Plane => Ok(ColliderGeometry::Plane {
                normal: self.normal()?,
                offset: self.number("offset", file.offset.as_ref(), NumberRange::COORDINATE)?,
            }),
            ColliderShape::Box => Ok(ColliderGeometry::Box {
                center: self.vector("center", file.center.as_ref())?,
                half_extents: self.half_extents()?,
                rotation: self
                    .reader
                    .rotation(&(self.field)("rotation"), file.rotation.as_ref())?,
            }),
            ColliderShape::Sphere => Ok(ColliderGeometry::Sphere {
                center: self.vector("center", file.center.as_ref())?,
                radius: self.number("radius", file.radius.as_ref(), SIZE)?,
            }),
            ColliderShape::Capsule => Ok(ColliderGeometry::Capsule {
                a: self.vector("a", file.a.as_ref())?,
                b: self.vector("b", file.b.as_ref())?,
                radius: self.number("radius", file.radius.as_ref(), SIZE)?,
            }),
            ColliderShape::Bounds => self.bounds(),
            ColliderShape::Mesh => self.mesh_geometry(),
        }
    }

    fn mesh_geometry(&self) -> Result<ColliderGeometry, SceneError> {
        let (file, reader) = (self.file, self.reader);
        if reader.is_planar {
            let problem = "a mesh needs 3 dimensions (allowed: all other shapes)";
            return reader.error(self.span.clone(), &(self.field)("shape"), problem);
        }
        let distance = file
            .distance
            .as_ref()
            .map(|number| reader.ranged(&(self.field)("distance"), number, DISTANCE));
        Ok(ColliderGeometry::Mesh {
            center: reader.vector_or(&(self.field)("center"), file.center.as_ref(), [0.0; 3])?,
            rotation: reader.rotation(&(self.field)("rotation"), file.rotation.as_ref())?,
            distance: distance.transpose()?.unwrap_or(0.0),
        })
    }

    /// Returns the triangles of a mesh, scaled and without slivers.
    fn mesh(&self) -> Result<ColliderMesh, SceneError> {
        let (file, reader) = (self.file, self.reader);
        if let Some(path) = file.path.as_ref().filter(|_| file.file.is_some())
            && file.points().is_none()
        {
            let problem = "the mesh has a file already (allowed: a list of points in time)";
            return reader.error(path.span(), &(self.field)("path"), problem);
        }
        let mesh = reader.mesh(&MeshKeys {
            path: file.mesh_file().as_ref(),
            vertices: file.vertices.as_ref(),
            faces: file.faces.as_ref(),
            span: self.span.clone(),
            field: &|key| self.mesh_field(key),
            parse: Mesh::surface_from_obj,
        })?;
        let scale = file.scale.as_ref();
        let scale = scale.map(|number| reader.ranged(&(self.field)("scale"), number, SIZE));
        let scale = scale.transpose()?.unwrap_or(1.0);
        let scaled = mesh.vertices.iter().map(|vertex| vertex.map(|axis| axis * scale));
        let mut mesh = ColliderMesh {
            vertices: scaled.collect(),
            triangles: mesh.faces.iter().flat_map(|face| fan(face)).collect(),
            is_solid: file.solid.as_ref().is_some_and(|solid| *solid.get_ref()),
        };
        let collapsed_count = if mesh.is_solid { remove_collapsed(&mut mesh) } else { 0 };
        let flaw = if mesh.is_solid { find_flaw(&mesh) } else { None };
        let sliver_count = remove_slivers(&mut mesh);
        if let Some(far) = mesh.vertices.iter().find(|vertex| !is_near(*vertex)) {
            let problem = format!("reach {far:?} (allowed: -1e7 to 1e7)");
            return self.wrong_mesh("vertices", problem);
        }
        if mesh.triangles.is_empty() {
            let problem = "have no triangle with an area (allowed: at least one)";
            return self.wrong_mesh("faces", problem.to_owned());
        }
        if mesh.is_solid {
            self.check_solid(flaw, sliver_count)?;
        }
        let sliver_count = sliver_count + collapsed_count;
        if sliver_count > 0 {
            let triangles = if sliver_count == 1 { "triangle is" } else { "triangles are" };
            let field = (self.field)("mesh");
            let field = field.trim_end_matches(".mesh");
            reader.warnings.borrow_mut().push(format!(
                "{field}: {sliver_count} {triangles} too narrow for a contact and omitted"
            ));
        }
        Ok(mesh)
    }

    /// Refuses a solid whose triangles do not enclose it.
    fn check_solid(&self, flaw: Option<SolidFlaw>, sliver_count: usize) -> Result<(), SceneError> {
        let problem = match flaw {
            Some(SolidFlaw::OpenEdge { ends: [from, to], counts: [forth, back] }) => {
                let cause = match forth + back {
                    1 => "belongs to one triangle only".to_owned(),
                    2 => "joins two triangles of opposite winding".to_owned(),
                    count => format!("belongs to {count} triangles"),
                };
                format!("the mesh is not closed: the edge from {from:?} to {to:?} {cause}")
            }
            Some(SolidFlaw::Flat(vertex)) => {
                format!("the part of the mesh with the vertex {vertex:?} encloses no volume")
            }
            Some(SolidFlaw::Reversed(vertex)) => format!(
                "the part of the mesh with the vertex {vertex:?} faces inwards and another part outwards, or the \
                 other way round"
            ),
            None if sliver_count > 0 => {
                format!(
                    "{sliver_count} of its triangles are too narrow for a contact; merge their vertices"
                )
            }
            None => return Ok(()),
        };
        let file = self.file;
        let path = file.mesh_file().map(|path| format!("{}: ", path.get_ref())).unwrap_or_default();
        let problem = format!(
            "{path}{problem} (allowed: false, or a closed mesh of consistent winding; vertices at the same position \
             are one)"
        );
        let span = file.solid.as_ref().map_or_else(|| self.span.clone(), Spanned::span);
        self.reader.error(span, &(self.field)("solid"), problem)
    }

    /// The field of a key of a mesh, whose path can also have the key `file`.
    fn mesh_field(&self, key: &str) -> String {
        let has_file = key == "path" && self.file.file.is_some();
        (self.field)(if has_file { "file" } else { key })
    }

    /// Reports a wrong mesh at its path, or at a key of a mesh that is written out.
    fn wrong_mesh<T>(&self, key: &str, problem: String) -> Result<T, SceneError> {
        let file = self.file;
        if let Some(path) = file.mesh_file() {
            let problem = format!("{}: its {key} {problem}", path.get_ref());
            return self.reader.error(path.span(), &self.mesh_field("path"), problem);
        }
        let place = match key {
            "vertices" => file.vertices.as_ref().map(Spanned::span),
            _ => file.faces.as_ref().map(Spanned::span),
        };
        self.reader.error(place.unwrap_or(self.span.clone()), &(self.field)(key), problem)
    }

    /// Refuses the keys of other shapes.
    fn check_keys(&self, shape: ColliderShape) -> Result<(), SceneError> {
        let own = keys(shape);
        for (key, span) in self.file.shape_keys() {
            let Some(span) = span.filter(|_| !own.contains(&key)) else { continue };
            let owners = ColliderShape::ALL.into_iter().filter(|one| keys(*one).contains(&key));
            let owners: Vec<_> = owners.map(ColliderShape::name).collect();
            let problem = format!(
                "unknown key of the shape {}, a key of {} (allowed: {} and the keys of every shape)",
                shape.name(),
                owners.join(", "),
                own.join(", ")
            );
            return self.reader.error(span, &(self.field)(key), problem);
        }
        Ok(())
    }

    fn required<'f, T>(
        &self,
        key: &str,
        value: Option<&'f T>,
        allowed: &str,
    ) -> Result<&'f T, SceneError> {
        self.reader.required(value, self.span.clone(), &(self.field)(key), allowed)
    }

    fn number(
        &self,
        key: &str,
        value: Option<&Number>,
        range: NumberRange,
    ) -> Result<f32, SceneError> {
        let value = self.required(key, value, range.text)?;
        self.reader.ranged(&(self.field)(key), value, range)
    }

    fn vector(&self, key: &str, value: Option<&Vector>) -> Result<[f32; 3], SceneError> {
        let value = self.required(key, value, "three numbers")?;
        self.reader.vector(&(self.field)(key), value)
    }

    fn normal(&self) -> Result<[f32; 3], SceneError> {
        let file = self.required("normal", self.file.normal.as_ref(), "three numbers")?;
        self.reader.direction(&(self.field)("normal"), file)
    }

    /// Returns the number of axes along which a solid has an extent.
    fn axis_count(&self) -> usize {
        if self.reader.is_planar { 2 } else { 3 }
    }

    fn half_extents(&self) -> Result<[f32; 3], SceneError> {
        let key = "half_extents";
        let file = self.required(key, self.file.half_extents.as_ref(), "three numbers > 0")?;
        let extents = self.vector(key, Some(file))?;
        let smallest = extents[..self.axis_count()].iter().copied().fold(f32::INFINITY, f32::min);
        if smallest > 0.0 {
            return Ok(extents);
        }
        let problem = format!("{smallest} is out of range (allowed: numbers > 0)");
        self.reader.error(file.span(), &(self.field)(key), problem)
    }

    fn bounds(&self) -> Result<ColliderGeometry, SceneError> {
        let min = self.vector("min", self.file.min.as_ref())?;
        let file = self.required("max", self.file.max.as_ref(), "three numbers above min")?;
        let max = self.vector("max", Some(file))?;
        if (0..self.axis_count()).all(|axis| min[axis] < max[axis]) {
            return Ok(ColliderGeometry::Bounds { min, max });
        }
        let problem = "is not above min (allowed: greater on every axis)";
        self.reader.error(file.span(), &(self.field)("max"), problem)
    }
}
