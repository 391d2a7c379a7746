//! The table `[[collider]]`.

use std::ops::Range;

use serde::Deserialize;
use sim_types::{ColliderShape, NumberRange};

use super::reader::{ANGULAR_VELOCITY, Reader, SIZE};
use super::value::{Number, Quaternion, Spanned, Table, TableKeys, Vector, Word};
use crate::scene::definition::collider::{ColliderGeometry, SceneCollider};
use crate::scene::error::SceneError;

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
}

impl TableKeys for FileCollider {}

/// Returns the keys of a shape beside those of all shapes.
fn keys(shape: ColliderShape) -> &'static [&'static str] {
    match shape {
        ColliderShape::Plane => &["normal", "offset"],
        ColliderShape::Box => &["center", "half_extents", "rotation", "angular_velocity"],
        ColliderShape::Sphere => &["center", "radius"],
        ColliderShape::Capsule => &["a", "b", "radius"],
        ColliderShape::Bounds => &["min", "max"],
    }
}

impl FileCollider {
    /// Returns the places of the keys that belong to single shapes.
    fn shape_keys(&self) -> [(&'static str, Option<Range<usize>>); 11] {
        let vector = |vector: &Option<Vector>| vector.as_ref().map(Spanned::span);
        let number = |number: &Option<Number>| number.as_ref().map(Spanned::span);
        [
            ("angular_velocity", vector(&self.angular_velocity)),
            ("normal", vector(&self.normal)),
            ("offset", number(&self.offset)),
            ("center", vector(&self.center)),
            ("half_extents", vector(&self.half_extents)),
            ("rotation", self.rotation.as_ref().map(Spanned::span)),
            ("radius", number(&self.radius)),
            ("a", vector(&self.a)),
            ("b", vector(&self.b)),
            ("min", vector(&self.min)),
            ("max", vector(&self.max)),
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
        Ok(SceneCollider {
            shape: fields.geometry()?,
            restitution: number_or_zero("restitution", &file.restitution, NumberRange::SHARE)?,
            friction: number_or_zero("friction", &file.friction, NumberRange::AT_LEAST_ZERO)?,
            velocity: self.vector_or(&field("velocity"), file.velocity.as_ref(), [0.0; 3])?,
            angular_velocity: self.angular_velocity(&field, file.angular_velocity.as_ref())?,
        })
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
        }
    }

    /// Refuses the keys of other shapes.
    fn check_keys(&self, shape: ColliderShape) -> Result<(), SceneError> {
        let own = keys(shape);
        for (key, span) in self.file.shape_keys() {
            let Some(span) = span.filter(|_| !own.contains(&key)) else { continue };
            let problem = format!(
                "unknown key of the shape {} (allowed: {} and the keys of every shape)",
                shape.name(),
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
