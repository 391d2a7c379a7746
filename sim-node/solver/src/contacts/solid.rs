//! Solids: where a path through a collider leaves it.

pub(crate) mod lane_solid;
pub(crate) mod solid_box;

use std::sync::Arc;

use glam::{Quat, Vec3};
use lane_solid::{HalfSpace, LaneSolid, SolidSphere};
use solid_box::{FaceHit, SolidBox};

use super::colliders::Collider;
use super::contact_substep::ContactSubstep;
use super::hit::Hit;
use super::mesh::PlacedMesh;
use super::mesh::collision_mesh::CollisionMesh;
use super::path::SubstepPath;
use super::placed_frame::PlacedFrame;
use super::placed_shape::PlacedShape;
use super::zone::Zone;

/// A convex solid, a half-space or a mesh, at its pose at the end of a substep.
#[derive(Debug, Clone)]
pub(crate) enum Solid {
    HalfSpace(HalfSpace),
    Sphere(SolidSphere),
    Capsule {
        ends: [Vec3; 2],
        radius: f32,
    },
    /// `before` is the pose at the start of the substep.
    Box {
        solid: SolidBox,
        now: PlacedFrame,
        before: PlacedFrame,
    },
    Mesh(PlacedMesh),
}

/// Returns the solids of a collider: one half-space for each face of bounds, one solid for any
/// other shape.
pub(crate) fn solids(collider: &Collider, substep: &ContactSubstep) -> [Option<Solid>; 6] {
    let one = |solid| [Some(solid), None, None, None, None, None];
    let before = || match collider.shape_at(substep.interval.start) {
        PlacedShape::Box { center, rotation, .. } | PlacedShape::Mesh { center, rotation, .. } => {
            PlacedFrame::new(center, rotation)
        }
        other => PlacedFrame::new(other.center(), Quat::IDENTITY),
    };
    match collider.shape_at(substep.interval.end) {
        PlacedShape::Plane { normal, offset } => {
            one(Solid::HalfSpace(HalfSpace { normal, offset }))
        }
        PlacedShape::Sphere { center, radius } => {
            one(Solid::Sphere(SolidSphere { center, radius, pole: Vec3::Y }))
        }
        PlacedShape::Capsule { a, b, radius } => one(Solid::Capsule { ends: [a, b], radius }),
        PlacedShape::Box { center, half_extents, rotation } => one(Solid::Box {
            solid: SolidBox::new(half_extents.to_array(), substep.axis_count(), center),
            now: PlacedFrame::new(center, rotation),
            before: before(),
        }),
        PlacedShape::Mesh { center, rotation, distance } => {
            let now = PlacedFrame::new(center, rotation);
            let place = |mesh: &Arc<CollisionMesh>| {
                PlacedMesh::new(mesh.clone(), [before(), now], distance)
            };
            let mesh = collider.mesh.as_ref().map(|mesh| Solid::Mesh(place(mesh)));
            [mesh, None, None, None, None, None]
        }
        PlacedShape::Bounds { min, max } => {
            let faces = |axis: usize, normal: Vec3| {
                let face = |normal, offset| Solid::HalfSpace(HalfSpace { normal, offset });
                let (low, high) = (face(normal, min[axis]), face(-normal, -max[axis]));
                if axis < substep.axis_count() { [Some(low), Some(high)] } else { [None, None] }
            };
            let [a, b] = faces(0, Vec3::X);
            let [c, d] = faces(1, Vec3::Y);
            let [e, f] = faces(2, Vec3::Z);
            [a, b, c, d, e, f]
        }
    }
}

impl Solid {
    /// Finds where a particle leaves the solid, if its path ends inside or, for a box, passes
    /// through. See [`PlacedMesh`] for the contacts of meshes.
    #[inline(always)]
    pub(crate) fn hit(&self, path: &SubstepPath) -> Option<Hit> {
        match self {
            Self::HalfSpace(half_space) => half_space.hit(&path.into()).to_hit(),
            Self::Sphere(sphere) => sphere.hit(&path.into()).to_hit(),
            Self::Capsule { ends, radius } => hit_capsule(path, *ends, *radius),
            Self::Box { solid, now, before } => {
                let (start, end) = (before.local(path.start), now.local_end(path));
                let FaceHit { face, depth } = solid.hit(start.to_array(), end.to_array())?;
                Some(Hit { normal: now.unit_to_scene(face.normal()), depth })
            }
            Self::Mesh(_) => None,
        }
    }

    /// Zone outside of which no path hits the solid.
    pub(crate) fn zone(&self) -> Zone {
        let reach = self.reach();
        match self {
            Self::HalfSpace(HalfSpace { normal, offset }) => {
                Zone::Below { normal: *normal, offset: *offset }
            }
            Self::Sphere(SolidSphere { center, radius, .. }) => {
                Zone::around([*center; 2], Vec3::splat(*radius), reach)
            }
            Self::Capsule { ends, radius } => Zone::around(*ends, Vec3::splat(*radius), reach),
            Self::Box { solid, now, before } => {
                let extents = Vec3::from_array(solid.extents);
                // A box that turns stays within its bounding sphere.
                let is_turned = now.is_turned || before.is_turned;
                let mut distance = if is_turned { Vec3::splat(extents.length()) } else { extents };
                if solid.axis_count == 2 {
                    distance.z = f32::INFINITY;
                }
                Zone::around([now.center, before.center], distance, reach)
            }
            Self::Mesh(mesh) => mesh.zone(),
        }
    }

    /// Magnitude of its coordinates, which bounds their rounding.
    pub(crate) fn reach(&self) -> f32 {
        match self {
            Self::HalfSpace(HalfSpace { offset, .. }) => offset.abs(),
            Self::Sphere(SolidSphere { center, radius, .. }) => center.abs().element_sum() + radius,
            Self::Capsule { ends: [a, b], radius } => {
                a.abs().element_sum() + b.abs().element_sum() + radius
            }
            Self::Box { solid, .. } => solid.reach,
            Self::Mesh(mesh) => mesh.reach(),
        }
    }
}

#[inline(never)]
fn hit_capsule(path: &SubstepPath, [a, b]: [Vec3; 2], radius: f32) -> Option<Hit> {
    let axis = b - a;
    let square = axis.dot(axis);
    let along =
        if square > 0.0 { (path.start + path.displacement - a).dot(axis) / square } else { 0.0 };
    let share = along.clamp(0.0, 1.0);
    // Perpendicular to the axis, and within the plane of a 2-D scene.
    let across = Vec3::new(-axis.y, axis.x, 0.0);
    let has_side = across.dot(across) >= f32::MIN_POSITIVE;
    let pole = if has_side { across.normalize() } else { Vec3::X };
    SolidSphere { center: a + axis * share, radius, pole }.hit(&path.into()).to_hit()
}
