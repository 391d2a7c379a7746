//! Colliders: what particles bounce off and slide on.

use std::ops::Range;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::check::{Range32, Reader};
use super::file::{Number, Vector};
use super::{SceneError, decimal};

/// What particles bounce off and slide on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SceneCollider {
    /// Its form and place at load.
    #[serde(flatten)]
    pub shape: ColliderShape,
    /// Share of the approach speed that a particle keeps, 0..=1.
    #[serde(with = "decimal::number")]
    pub restitution: f32,
    /// Coulomb's coefficient, >= 0.
    #[serde(with = "decimal::number")]
    pub friction: f32,
    /// Per second.
    #[serde(with = "decimal::vector")]
    pub velocity: [f32; 3],
    /// About the center of a box, in rad/s; 0 for all others.
    #[serde(with = "decimal::vector", skip_serializing_if = "is_zero")]
    pub angular_velocity: [f32; 3],
}

/// Only a box has the key.
fn is_zero(vector: &[f32; 3]) -> bool {
    *vector == [0.0; 3]
}

/// The form of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum ColliderShape {
    /// A half-space.
    Plane {
        /// Out of the solid; normalised where it is used.
        #[serde(with = "decimal::vector")]
        normal: [f32; 3],
        /// Free where normal x >= offset.
        #[serde(with = "decimal::number")]
        offset: f32,
    },
    /// A solid box; what is inside leaves it by the nearest face.
    Box {
        /// Its middle.
        #[serde(with = "decimal::vector")]
        center: [f32; 3],
        /// Half of its lengths along its own axes, > 0; in 2-D its z is 0.
        #[serde(with = "decimal::vector")]
        half_extents: [f32; 3],
        /// Quaternion x, y, z, w; normalised where it is used.
        #[serde(with = "decimal::quaternion")]
        rotation: [f32; 4],
    },
    /// A solid ball.
    Sphere {
        /// Its middle.
        #[serde(with = "decimal::vector")]
        center: [f32; 3],
        /// > 0.
        #[serde(with = "decimal::number")]
        radius: f32,
    },
    /// All that is within `radius` of a segment.
    Capsule {
        /// One end of the segment.
        #[serde(with = "decimal::vector")]
        a: [f32; 3],
        /// Its other end.
        #[serde(with = "decimal::vector")]
        b: [f32; 3],
        /// > 0.
        #[serde(with = "decimal::number")]
        radius: f32,
    },
    /// Particles stay inside.
    Bounds {
        /// Lowest coordinates.
        #[serde(with = "decimal::vector")]
        min: [f32; 3],
        /// Highest coordinates; above the lowest, but for z in 2-D.
        #[serde(with = "decimal::vector")]
        max: [f32; 3],
    },
}

/// The keys of all shapes; which of them a shape has is checked below.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FileCollider {
    shape: Spanned<String>,
    restitution: Option<Number>,
    friction: Option<Number>,
    velocity: Option<Vector>,
    angular_velocity: Option<Vector>,
    normal: Option<Vector>,
    offset: Option<Number>,
    center: Option<Vector>,
    half_extents: Option<Vector>,
    rotation: Option<Spanned<[Number; 4]>>,
    radius: Option<Number>,
    a: Option<Vector>,
    b: Option<Vector>,
    min: Option<Vector>,
    max: Option<Vector>,
}

/// The shapes, each with its own keys.
const SHAPES: [(&str, &[&str]); 5] = [
    ("plane", &["normal", "offset"]),
    ("box", &["center", "half_extents", "rotation", "angular_velocity"]),
    ("sphere", &["center", "radius"]),
    ("capsule", &["a", "b", "radius"]),
    ("bounds", &["min", "max"]),
];

impl FileCollider {
    /// Where each of the shapes' own keys stands, if it does.
    fn own_keys(&self) -> [(&'static str, Option<Range<usize>>); 10] {
        let span = |vector: &Option<Vector>| vector.as_ref().map(Spanned::span);
        let number = |number: &Option<Number>| number.as_ref().map(Spanned::span);
        [
            ("angular_velocity", span(&self.angular_velocity)),
            ("normal", span(&self.normal)),
            ("offset", number(&self.offset)),
            ("center", span(&self.center)),
            ("half_extents", span(&self.half_extents)),
            ("rotation", self.rotation.as_ref().map(Spanned::span)),
            ("radius", number(&self.radius)),
            ("a", span(&self.a)),
            ("b", span(&self.b)),
            ("min", span(&self.min).or(span(&self.max))),
        ]
    }
}

impl Reader<'_> {
    /// Checks one `[[collider]]` block.
    pub(super) fn collider(
        &self,
        index: usize,
        file: &FileCollider,
    ) -> Result<SceneCollider, SceneError> {
        let field = |name: &str| format!("collider[{index}].{name}");
        self.check_shape_keys(&field, file)?;
        let number_or_zero = |name: &str, number: &Option<Number>, range| {
            number.as_ref().map_or(Ok(0.0), |number| self.ranged(&field(name), number, range))
        };
        Ok(SceneCollider {
            shape: ColliderFields { reader: self, field: &field, file }.shape()?,
            restitution: number_or_zero("restitution", &file.restitution, Range32::SHARE)?,
            friction: number_or_zero("friction", &file.friction, Range32::AT_LEAST_ZERO)?,
            velocity: self.vector_or(&field("velocity"), file.velocity.as_ref(), [0.0; 3])?,
            angular_velocity: self.angular_velocity(&field, file.angular_velocity.as_ref())?,
        })
    }

    /// Keys of other shapes are as unknown as any other.
    fn check_shape_keys(
        &self,
        field: &impl Fn(&str) -> String,
        file: &FileCollider,
    ) -> Result<(), SceneError> {
        let shape = file.shape.get_ref().as_str();
        let Some((_, own)) = SHAPES.iter().find(|(name, _)| *name == shape) else {
            let names = SHAPES.map(|(name, _)| name).join(", ");
            let problem = format!("there is no shape \"{shape}\" (allowed: {names})");
            return self.error(file.shape.span(), &field("shape"), problem);
        };
        for (key, span) in file.own_keys() {
            let Some(span) = span.filter(|_| !own.contains(&key)) else { continue };
            let problem = format!("unknown field of a {shape} (allowed: {})", own.join(", "));
            return self.error(span, &field(key), problem);
        }
        Ok(())
    }

    /// In 2-D a box turns about z.
    fn angular_velocity(
        &self,
        field: &impl Fn(&str) -> String,
        vector: Option<&Vector>,
    ) -> Result<[f32; 3], SceneError> {
        let Some(vector) = vector else { return Ok([0.0; 3]) };
        let mut axes = [0.0; 3];
        for (axis, number) in axes.iter_mut().zip(vector.get_ref()) {
            *axis = self.ranged(&field("angular_velocity"), number, Range32::ANGULAR_VELOCITY)?;
        }
        if self.is_planar && axes[..2] != [0.0; 2] {
            let problem = "turns out of the plane (allowed: [0, 0, z] in 2 dimensions)".to_owned();
            return self.error(vector.span(), &field("angular_velocity"), problem);
        }
        Ok(axes)
    }
}

/// The keys of one collider.
struct ColliderFields<'r, 't, F> {
    reader: &'r Reader<'t>,
    field: &'r F,
    file: &'r FileCollider,
}

impl<F: Fn(&str) -> String> ColliderFields<'_, '_, F> {
    fn shape(&self) -> Result<ColliderShape, SceneError> {
        let file = self.file;
        match file.shape.get_ref().as_str() {
            "plane" => Ok(ColliderShape::Plane {
                normal: self.normal()?,
                offset: self.number("offset", file.offset.as_ref(), Range32::COORDINATE)?,
            }),
            "box" => Ok(ColliderShape::Box {
                center: self.vector("center", file.center.as_ref())?,
                half_extents: self.half_extents()?,
                rotation: self
                    .reader
                    .rotation(&(self.field)("rotation"), file.rotation.as_ref())?,
            }),
            "sphere" => Ok(ColliderShape::Sphere {
                center: self.vector("center", file.center.as_ref())?,
                radius: self.number("radius", file.radius.as_ref(), Range32::SIZE)?,
            }),
            "capsule" => Ok(ColliderShape::Capsule {
                a: self.vector("a", file.a.as_ref())?,
                b: self.vector("b", file.b.as_ref())?,
                radius: self.number("radius", file.radius.as_ref(), Range32::SIZE)?,
            }),
            _ => self.bounds(),
        }
    }

    fn required<'f, T>(
        &self,
        key: &str,
        value: Option<&'f Spanned<T>>,
    ) -> Result<&'f Spanned<T>, SceneError> {
        let shape = &self.file.shape;
        let missing = || format!("is missing: a {} needs it", shape.get_ref());
        value.ok_or_else(|| self.reader.place.error(shape.span(), &(self.field)(key), missing()))
    }

    fn number(&self, key: &str, value: Option<&Number>, range: Range32) -> Result<f32, SceneError> {
        self.reader.ranged(&(self.field)(key), self.required(key, value)?, range)
    }

    fn vector(&self, key: &str, value: Option<&Vector>) -> Result<[f32; 3], SceneError> {
        self.reader.vector(&(self.field)(key), self.required(key, value)?)
    }

    fn normal(&self) -> Result<[f32; 3], SceneError> {
        let file = self.required("normal", self.file.normal.as_ref())?;
        let normal = self.vector("normal", Some(file))?;
        if normal != [0.0; 3] {
            return Ok(normal);
        }
        let problem = "has no direction (allowed: not all 0)".to_owned();
        self.reader.error(file.span(), &(self.field)("normal"), problem)
    }

    /// The axes that a body has an extent along.
    fn axis_count(&self) -> usize {
        if self.reader.is_planar { 2 } else { 3 }
    }

    fn half_extents(&self) -> Result<[f32; 3], SceneError> {
        let file = self.required("half_extents", self.file.half_extents.as_ref())?;
        let extents = self.vector("half_extents", Some(file))?;
        if extents[..self.axis_count()].iter().all(|extent| *extent > 0.0) {
            return Ok(extents);
        }
        let problem = "an extent is not positive (allowed: numbers > 0)".to_owned();
        self.reader.error(file.span(), &(self.field)("half_extents"), problem)
    }

    fn bounds(&self) -> Result<ColliderShape, SceneError> {
        let min = self.vector("min", self.file.min.as_ref())?;
        let file = self.required("max", self.file.max.as_ref())?;
        let max = self.vector("max", Some(file))?;
        if (0..self.axis_count()).all(|axis| min[axis] < max[axis]) {
            return Ok(ColliderShape::Bounds { min, max });
        }
        let problem = "is not above min (allowed: greater on every axis)".to_owned();
        self.reader.error(file.span(), &(self.field)("max"), problem)
    }
}
