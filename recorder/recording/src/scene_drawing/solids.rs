//! The drawing of the colliders: cubes, spheres, cylinders, triangles, and the edges of bounds.

use sim_messages::{ColliderShape, ColliderState};
use sim_solver::scene::{ColliderMesh, ColliderMeshes};

use crate::log::encoding::protobuf::{Pose, Quaternion, Vector3};
use crate::log::encoding::scene_messages::{
    Color, CubePrimitive, CylinderPrimitive, LINE_LIST, LinePrimitive, Point3, SceneEntity,
    SpherePrimitive, TriangleListPrimitive,
};

/// The origin of the scene.
pub(super) const IDENTITY: Pose = Pose {
    position: Some(Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
    orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
};
const SOLID_COLOR: Color = Color { r: 0.55, g: 0.57, b: 0.6, a: 1.0 };
/// Planes are transparent, because viewers also look at them from below.
const PLANE_COLOR: Color = Color { a: 0.3, ..SOLID_COLOR };
/// Width of the edges of bounds in pixels, at any distance.
const EDGE_WIDTH_PX: f64 = 1.5;
/// Side of a plane as a multiple of the diagonal of the scene.
const PLANE_DIAGONALS: f64 = 10.0;
/// Least side of a plane, in m.
const PLANE_SIDE_MIN: f64 = 10.0;
/// Thickness of a plane, as a part of its side.
const PLANE_THICKNESS: f64 = 1e-4;
/// The corners of bounds that an edge joins. Bit k of a corner selects the upper end of axis k.
const EDGES: [u32; 24] = [0, 1, 2, 3, 4, 5, 6, 7, 0, 2, 1, 3, 4, 6, 5, 7, 0, 4, 1, 5, 2, 6, 3, 7];

type Vector = [f64; 3];

/// The part of a plane that is drawn.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaneExtent {
    /// The square is centered at the point of the plane nearest to this one.
    middle: Vector,
    side: f64,
}

impl PlaneExtent {
    /// Chooses the part of a plane for a scene whose positions lie in this box.
    pub(super) fn around([min, max]: [[f32; 3]; 2]) -> Self {
        let (min, max) = (wide(min), wide(max));
        let diagonal = length(subtract(max, min));
        Self {
            middle: scale(add(min, max), 0.5),
            side: (PLANE_DIAGONALS * diagonal).max(PLANE_SIDE_MIN),
        }
    }
}

impl Default for PlaneExtent {
    fn default() -> Self {
        Self::around([[0.0; 3]; 2])
    }
}

/// Adds the drawing of the colliders, except meshes, to an entity. Any process of the user can publish
/// colliders, so those with an unknown shape or a number that is not finite are left out.
pub(super) fn draw(colliders: &[ColliderState], extent: PlaneExtent, entity: &mut SceneEntity) {
    for collider in colliders.iter().filter(|one| is_finite(one)) {
        let (center, radius) = (wide(collider.center), f64::from(collider.radius));
        let (a, b) = (wide(collider.a), wide(collider.b));
        match ColliderShape::from_number(collider.shape) {
            Some(ColliderShape::Plane) => entity.cubes.push(plane(collider, extent)),
            Some(ColliderShape::Box) => entity.cubes.push(cube(collider)),
            Some(ColliderShape::Sphere) => entity.spheres.push(sphere(center, radius)),
            Some(ColliderShape::Capsule) => {
                entity.spheres.extend([sphere(a, radius), sphere(b, radius)]);
                entity.cylinders.push(cylinder(a, b, radius));
            }
            Some(ColliderShape::Bounds) => entity.lines.push(edges(a, b)),
            Some(ColliderShape::Mesh) | None => {}
        }
    }
}

/// Draws the colliders that are meshes.
pub(super) fn draw_meshes(
    colliders: &[ColliderState],
    meshes: &ColliderMeshes,
) -> Vec<TriangleListPrimitive> {
    let placed = of_meshes(colliders).filter(|(_, collider)| is_finite(collider));
    placed.filter_map(|(index, one)| Some(triangles(one, meshes.get(&index)?))).collect()
}

/// Returns `true` if the meshes of two lists are the same colliders in the same poses.
pub(super) fn have_same_meshes(before: &[ColliderState], now: &[ColliderState]) -> bool {
    let pose = |(index, one): (usize, &ColliderState)| (index, one.center, one.rotation);
    of_meshes(before).map(pose).eq(of_meshes(now).map(pose))
}

fn of_meshes(colliders: &[ColliderState]) -> impl Iterator<Item = (usize, &ColliderState)> {
    let is_mesh = |(_, one): &(usize, &ColliderState)| one.shape == ColliderShape::Mesh as u32;
    colliders.iter().enumerate().filter(is_mesh)
}

fn is_finite(collider: &ColliderState) -> bool {
    let ColliderState { radius, offset, normal, center, half_extents, rotation, a, b, .. } =
        collider;
    let vectors = [normal, center, half_extents, a, b];
    let numbers = vectors.into_iter().flatten().chain(rotation).chain([radius, offset]);
    numbers.into_iter().all(|number| number.is_finite())
}

/// Draws a plane as a thin box whose upper face lies in the plane.
fn plane(collider: &ColliderState, extent: PlaneExtent) -> CubePrimitive {
    let PlaneExtent { middle, side } = extent;
    let (normal, thickness) = (wide(collider.normal), PLANE_THICKNESS * side);
    let depth = f64::from(collider.offset) - dot(normal, middle) - 0.5 * thickness;
    let center = add(middle, scale(normal, depth));
    CubePrimitive {
        pose: Some(pose(center, from_z_to(normal))),
        size: Some(vector([side, side, thickness])),
        color: Some(PLANE_COLOR),
    }
}

fn turned_pose(collider: &ColliderState) -> Pose {
    let [x, y, z, w] = collider.rotation.map(f64::from);
    pose(wide(collider.center), Quaternion { x, y, z, w })
}

fn triangles(collider: &ColliderState, mesh: &ColliderMesh) -> TriangleListPrimitive {
    let points = mesh.vertices.iter().map(|vertex| wide(*vertex));
    TriangleListPrimitive {
        pose: Some(turned_pose(collider)),
        points: points.map(|[x, y, z]| Point3 { x, y, z }).collect(),
        color: Some(SOLID_COLOR),
        indices: mesh.triangles.as_flattened().to_vec(),
    }
}

fn cube(collider: &ColliderState) -> CubePrimitive {
    CubePrimitive {
        pose: Some(turned_pose(collider)),
        size: Some(vector(scale(wide(collider.half_extents), 2.0))),
        color: Some(SOLID_COLOR),
    }
}

fn sphere(center: Vector, radius: f64) -> SpherePrimitive {
    SpherePrimitive {
        pose: Some(Pose { position: Some(vector(center)), ..IDENTITY }),
        size: Some(vector([2.0 * radius; 3])),
        color: Some(SOLID_COLOR),
    }
}

/// Draws the part of a capsule between its spheres. The axis of a cylinder is its z axis.
fn cylinder(a: Vector, b: Vector, radius: f64) -> CylinderPrimitive {
    let axis = subtract(b, a);
    CylinderPrimitive {
        pose: Some(pose(scale(add(a, b), 0.5), from_z_to(axis))),
        size: Some(vector([2.0 * radius, 2.0 * radius, length(axis)])),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(SOLID_COLOR),
    }
}

/// Draws the edges of bounds, because particles are inside.
fn edges(min: Vector, max: Vector) -> LinePrimitive {
    let corner = |bits: u32| {
        let [x, y, z] =
            std::array::from_fn(|axis| if bits >> axis & 1 == 0 { min[axis] } else { max[axis] });
        Point3 { x, y, z }
    };
    LinePrimitive {
        r#type: LINE_LIST,
        pose: Some(IDENTITY),
        thickness: EDGE_WIDTH_PX,
        scale_invariant: true,
        points: (0..8).map(corner).collect(),
        color: Some(SOLID_COLOR),
        indices: EDGES.into(),
    }
}

/// Returns the shortest rotation from z to a direction: (z x d, |d| + z·d), normalised. The opposite
/// direction is a half turn about x, and so is a direction of length 0.
fn from_z_to(direction: Vector) -> Quaternion {
    let [x, y, z] = direction;
    let (qx, qy, w) = (-y, x, length(direction) + z);
    let norm = length([qx, qy, w]);
    if norm == 0.0 {
        return Quaternion { x: 1.0, y: 0.0, z: 0.0, w: 0.0 };
    }
    Quaternion { x: qx / norm, y: qy / norm, z: 0.0, w: w / norm }
}

fn pose(position: Vector, orientation: Quaternion) -> Pose {
    Pose { position: Some(vector(position)), orientation: Some(orientation) }
}

fn vector([x, y, z]: Vector) -> Vector3 {
    Vector3 { x, y, z }
}

fn wide(vector: [f32; 3]) -> Vector {
    vector.map(f64::from)
}

fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

fn subtract(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn scale(vector: Vector, factor: f64) -> Vector {
    vector.map(|axis| axis * factor)
}

fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|axis| a[axis] * b[axis]).sum()
}

fn length(vector: Vector) -> f64 {
    dot(vector, vector).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(collider: ColliderState) -> SceneEntity {
        let bounds = [[-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]];
        let mut entity = SceneEntity::default();
        let mesh = ColliderMesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            is_solid: false,
        };
        draw(&[collider], PlaneExtent::around(bounds), &mut entity);
        entity.triangles = draw_meshes(&[collider], &[(0, mesh)].into());
        entity
    }

    fn with(shape: ColliderShape) -> ColliderState {
        ColliderState { shape: shape as u32, ..ColliderState::default() }
    }

    /// Returns the point of a primitive's own axes in the scene: position + R·point.
    fn placed(pose: Option<Pose>, point: Vector) -> Vector {
        let Pose { position, orientation } = pose.unwrap();
        let (position, q) = (position.unwrap(), orientation.unwrap());
        let u = [q.x, q.y, q.z];
        let cross = |a: Vector, b: Vector| {
            [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
        };
        let (once, twice) = (cross(u, point), cross(u, cross(u, point)));
        let turned: Vector =
            std::array::from_fn(|axis| point[axis] + 2.0 * (q.w * once[axis] + twice[axis]));
        add([position.x, position.y, position.z], turned)
    }

    fn assert_near(found: Vector, expected: Vector) {
        assert!(length(subtract(found, expected)) < 1e-6, "{found:?} instead of {expected:?}");
    }

    #[test]
    fn the_upper_face_of_a_plane_lies_in_the_plane() {
        for normal in [[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]] {
            let offset = -0.25;
            let entity = drawn(ColliderState { normal, offset, ..with(ColliderShape::Plane) });
            let cube = &entity.cubes[0];
            let size = cube.size.unwrap();
            assert!(size.x >= 10.0 && size.y == size.x && size.z < 0.01, "{size:?}");
            for corner in [[0.5, 0.5], [-0.5, 0.5], [0.5, -0.5], [-0.5, -0.5]] {
                let point =
                    placed(cube.pose, [corner[0] * size.x, corner[1] * size.y, 0.5 * size.z]);
                let height = dot(point, wide(normal)) - f64::from(offset);
                assert!(height.abs() < 1e-4, "{normal:?}: a corner at height {height}");
            }
        }
    }

    #[test]
    fn a_box_and_a_sphere_have_the_sizes_of_the_collider() {
        let entity = drawn(ColliderState {
            center: [1.0, 2.0, 3.0],
            half_extents: [0.5, 1.0, 2.0],
            rotation: [0.0, 0.6, 0.0, 0.8],
            ..with(ColliderShape::Box)
        });
        let cube = &entity.cubes[0];
        assert_eq!(cube.size, Some(vector([1.0, 2.0, 4.0])));
        // Rotation about y by the angle a with sin(a / 2) = 0.6: cos a = 0.28, sin a = 0.96.
        assert_near(placed(cube.pose, [1.0, 0.0, 0.0]), [1.28, 2.0, 2.04]);
        let sphere =
            ColliderState { center: [1.0; 3], radius: 0.25, ..with(ColliderShape::Sphere) };
        let entity = drawn(sphere);
        assert_eq!(entity.spheres[0].size, Some(vector([0.5; 3])));
        assert_near(placed(entity.spheres[0].pose, [0.0; 3]), [1.0; 3]);
    }

    #[test]
    fn a_capsule_is_a_cylinder_between_two_spheres() {
        let ends = [
            ([0.0, 0.0, 0.0], [0.0, 3.0, 4.0]),
            ([1.0, 1.0, 1.0], [1.0, 1.0, -1.0]),
            ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]),
        ];
        for (a, b) in ends {
            let entity = drawn(ColliderState { a, b, radius: 0.5, ..with(ColliderShape::Capsule) });
            let (cylinder, spheres) = (&entity.cylinders[0], &entity.spheres);
            let half = 0.5 * cylinder.size.unwrap().z;
            assert_near(placed(cylinder.pose, [0.0, 0.0, -half]), wide(a));
            assert_near(placed(cylinder.pose, [0.0, 0.0, half]), wide(b));
            assert_near(placed(spheres[0].pose, [0.0; 3]), wide(a));
            assert_near(placed(spheres[1].pose, [0.0; 3]), wide(b));
            assert_eq!((cylinder.size.unwrap().x, spheres[0].size.unwrap().x), (1.0, 1.0));
        }
    }

    #[test]
    fn bounds_are_drawn_by_their_twelve_edges() {
        let (a, b) = ([-1.0, -2.0, -3.0], [1.0, 2.0, 3.0]);
        let entity = drawn(ColliderState { a, b, ..with(ColliderShape::Bounds) });
        let line = &entity.lines[0];
        let mut lengths = [0; 3];
        for ends in line.indices.chunks(2) {
            let [from, to] = [ends[0], ends[1]].map(|corner| line.points[corner as usize]);
            let along = [to.x - from.x, to.y - from.y, to.z - from.z];
            let axis = along.iter().position(|one| *one != 0.0).unwrap();
            assert_eq!(along.iter().filter(|one| **one != 0.0).count(), 1);
            assert_eq!(along[axis], 2.0 * f64::from(b[axis]));
            lengths[axis] += 1;
        }
        assert_eq!(lengths, [4, 4, 4]);
    }

    #[test]
    fn the_triangles_of_a_mesh_are_placed_at_its_pose() {
        let center = [0.5, 1.0, 1.5];
        let rotation = [0.0, 0.0, 0.6, 0.8];
        let entity = drawn(ColliderState { center, rotation, ..with(ColliderShape::Mesh) });
        let mesh = &entity.triangles[0];
        assert_eq!(mesh.indices, [0, 1, 2]);
        let Point3 { x, y, z } = mesh.points[1];
        // A turn by 2 acos(0.8) takes x to (0.28, 0.96, 0).
        assert_near(placed(mesh.pose, [x, y, z]), [0.78, 1.96, 1.5]);
    }

    #[test]
    fn a_collider_that_is_unknown_or_not_finite_is_not_drawn() {
        let unknown = ColliderState { shape: 77, ..ColliderState::default() };
        let endless = ColliderState { radius: f32::INFINITY, ..with(ColliderShape::Sphere) };
        let turned = ColliderState { rotation: [f32::NAN; 4], ..with(ColliderShape::Box) };
        for collider in [unknown, endless, turned] {
            assert_eq!(drawn(collider), SceneEntity::default(), "{collider:?}");
        }
    }
}
