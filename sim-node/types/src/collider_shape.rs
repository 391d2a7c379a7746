//! The shapes of colliders.

/// Shape of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum ColliderShape {
    /// A solid half space.
    Plane = 0,
    /// A solid box.
    Box = 1,
    /// A solid sphere.
    Sphere = 2,
    /// All points within a radius of a segment.
    Capsule = 3,
    /// A box that particles stay inside.
    Bounds = 4,
    /// Triangles with two sides.
    Mesh = 5,
}

impl ColliderShape {
    /// All shapes, by number.
    pub const ALL: [Self; 6] =
        [Self::Plane, Self::Box, Self::Sphere, Self::Capsule, Self::Bounds, Self::Mesh];

    /// Returns the shape with this number.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }

    /// Returns the shape with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|shape| shape.name() == name)
    }

    /// Name in scenes and logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Box => "box",
            Self::Sphere => "sphere",
            Self::Capsule => "capsule",
            Self::Bounds => "bounds",
            Self::Mesh => "mesh",
        }
    }
}
