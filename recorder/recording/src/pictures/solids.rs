//! Colliders as shapes, from back to front.

use glam::{DQuat, DVec3};
use sim_solver::scene::ColliderMesh;

use super::camera::Camera;
use super::extent::{Extent, box_corners, mesh_corners, plain};
use super::shape::{Color, Shape, Stroke};
use crate::log::ShapeRow;
use crate::scene_state::SceneState;

const FILL: Color = Color([0xd9, 0xde, 0xe4]);
const OUTLINE: Color = Color([0x8d, 0x98, 0xa5]);
const PLANE_FILL: Color = Color([0xec, 0xec, 0xe6]);
/// In pixels, in a picture of 720 pixels.
const OUTLINE_WIDTH: f64 = 1.2;

/// The faces of a box by axis and side. Each lists corners of an [`Extent`] in order around the face.
const FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
/// The edges of a box.
const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];

/// Returns the shapes of all colliders. Planes are clipped to `room`.
pub(crate) fn shapes(state: &SceneState, camera: &Camera, room: &Extent) -> Vec<Shape> {
    let mut order: Vec<_> = state.colliders().iter().map(|one| &one.shape).enumerate().collect();
    // The sort is stable, so ties keep the order of their index.
    order.sort_by(|(_, one), (_, other)| {
        let [one, other] = [one, other].map(|shape| depth(shape, camera));
        one.0.cmp(&other.0).then(one.1.total_cmp(&other.1))
    });
    let shapes = order.into_iter().flat_map(|(index, shape)| match state.collider_mesh(index) {
        Some(mesh) => mesh_triangles(shape, mesh, camera),
        None => shapes_of(shape, camera, room),
    });
    shapes.collect()
}

/// Returns the sort key of a collider: planes are behind bounds, and both are behind solid shapes,
/// which are sorted by distance.
fn depth(shape: &ShapeRow, camera: &Camera) -> (u8, f64) {
    match shape {
        ShapeRow::Plane { .. } => (0, 0.0),
        ShapeRow::Bounds { .. } => (1, 0.0),
        ShapeRow::Box { center, .. }
        | ShapeRow::Sphere { center, .. }
        | ShapeRow::Mesh { center, .. } => (2, camera.nearness(plain(*center))),
        ShapeRow::Capsule { a, b, .. } => (2, camera.nearness((plain(*a) + plain(*b)) * 0.5)),
    }
}

fn shapes_of(shape: &ShapeRow, camera: &Camera, room: &Extent) -> Vec<Shape> {
    match *shape {
        ShapeRow::Plane { normal, offset } => {
            plane(plain(normal), offset.0.into(), camera, room).into_iter().collect()
        }
        ShapeRow::Box { center, half_extents, rotation } => {
            let corners = box_corners(center, half_extents, rotation);
            let rotation = DQuat::from_array(rotation.map(|one| one.0.into()));
            solid_box(&corners, rotation, camera)
        }
        ShapeRow::Sphere { center, radius } => vec![Shape::Circle {
            center: camera.project(plain(center)),
            radius: camera.pixels(radius.0.into()),
            fill: FILL,
            outline: Some(outline(camera)),
        }],
        ShapeRow::Capsule { a, b, radius } => {
            capsule([plain(a), plain(b)], radius.0.into(), camera)
        }
        ShapeRow::Bounds { min, max } => {
            let corners = Extent { min: plain(min), max: plain(max) }.corners();
            let segment = |edge: [usize; 2]| Shape::Segment {
                ends: edge.map(|corner| camera.project(corners[corner])),
                stroke: outline(camera),
            };
            EDGES.into_iter().map(segment).collect()
        }
        // Its triangles are in the scene.
        ShapeRow::Mesh { .. } => Vec::new(),
    }
}

/// Returns the triangles of a mesh at its pose, from back to front.
fn mesh_triangles(shape: &ShapeRow, mesh: &ColliderMesh, camera: &Camera) -> Vec<Shape> {
    let vertices = mesh_corners(shape, mesh);
    if vertices.is_empty() {
        return Vec::new();
    }
    let corners = |triangle: &[u32; 3]| triangle.map(|corner| vertices[corner as usize]);
    let mut triangles: Vec<_> = mesh.triangles.iter().map(corners).collect();
    let nearness = |corners: &[DVec3; 3]| camera.nearness(corners.iter().sum());
    triangles.sort_by(|one, other| nearness(one).total_cmp(&nearness(other)));
    let polygon = |[a, b, c]: [DVec3; 3]| {
        let fill = FILL.times(camera.brightness((b - a).cross(c - a).normalize_or_zero()));
        // The outline closes the seams between neighbors.
        let outline = Some(Stroke::solid(fill, 0.7));
        Shape::Polygon { corners: [a, b, c].map(|at| camera.project(at)).into(), fill, outline }
    };
    triangles.into_iter().map(polygon).collect()
}

fn outline(camera: &Camera) -> Stroke {
    Stroke::solid(OUTLINE, OUTLINE_WIDTH * camera.line_scale())
}

/// Returns the faces that face the camera. The visible faces of a box never hide each other.
fn solid_box(corners: &[DVec3; 8], rotation: DQuat, camera: &Camera) -> Vec<Shape> {
    let normals = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| rotation * axis);
    let normals = normals.into_iter().flat_map(|normal| [-normal, normal]);
    let visible = FACES.into_iter().zip(normals).filter(|(_, normal)| camera.is_facing(*normal));
    let face = |(face, normal): ([usize; 4], DVec3)| Shape::Polygon {
        corners: face.map(|corner| camera.project(corners[corner])).into(),
        fill: FILL.times(camera.brightness(normal)),
        outline: Some(outline(camera)),
    };
    visible.map(face).collect()
}

/// Draws a capsule as a thick line with round ends, which is its shape from every direction. The
/// outline is a thicker line below it.
fn capsule(ends: [DVec3; 2], radius: f64, camera: &Camera) -> Vec<Shape> {
    let [a, b] = ends.map(|end| camera.project(end));
    let (line, radius) = (outline(camera), camera.pixels(radius));
    if (a - b).length() < 0.01 {
        // Some programs do not draw a line of length 0.
        return vec![Shape::Circle { center: a, radius, fill: FILL, outline: Some(line) }];
    }
    let thick = |color, width| Shape::Segment { ends: [a, b], stroke: Stroke::solid(color, width) };
    let width = 2.0 * radius;
    vec![thick(line.color, width + line.width), thick(FILL, width - line.width)]
}

/// Returns the part of a plane inside the room. It is a line if the plane is seen edge-on.
fn plane(normal: DVec3, offset: f64, camera: &Camera, room: &Extent) -> Option<Shape> {
    let middle = (room.min + room.max) * 0.5;
    let foot = middle - normal * (normal.dot(middle) - offset);
    let (right, up) = normal.any_orthonormal_pair();
    let (right, up) = (right * room.size().length(), up * room.size().length());
    let mut corners =
        vec![foot + right + up, foot - right + up, foot - right - up, foot + right - up];
    for axis in DVec3::AXES {
        corners = clip(&corners, axis, axis.dot(room.max));
        corners = clip(&corners, -axis, -axis.dot(room.min));
    }
    let corners: Vec<_> = corners.into_iter().map(|corner| camera.project(corner)).collect();
    (corners.len() >= 3).then(|| Shape::Polygon {
        corners,
        fill: PLANE_FILL,
        outline: Some(outline(camera)),
    })
}

/// Clips a polygon at `limit` along `axis` (Sutherland and Hodgman 1974).
fn clip(corners: &[DVec3], axis: DVec3, limit: f64) -> Vec<DVec3> {
    let mut kept = Vec::with_capacity(corners.len() + 1);
    let nexts = corners.iter().cycle().skip(1);
    for (corner, next) in corners.iter().zip(nexts) {
        let (from, to) = (axis.dot(*corner) - limit, axis.dot(*next) - limit);
        if from <= 0.0 {
            kept.push(*corner);
        }
        if (from < 0.0 && to > 0.0) || (from > 0.0 && to < 0.0) {
            kept.push(*corner + (*next - *corner) * (from / (from - to)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use sim_messages::PlainF32;
    use sim_solver::scene::Up;

    use super::*;
    use crate::log::{ColliderDetails, ColliderRow, CollidersRow, RecordedState};
    use crate::pictures::{Basis, Size, View};

    const ROOM: Extent = Extent { min: DVec3::NEG_ONE, max: DVec3::ONE };

    /// A unit is 84 pixels long, and (0, 0, 0) is at (100, 100).
    fn camera(view: View) -> Camera {
        Camera::fit(Basis::new(view, Up::Y), &ROOM, Size { width: 200, height: 200 })
    }

    fn drawn(view: View, shape: ShapeRow) -> Vec<Shape> {
        shapes_of(&shape, &camera(view), &ROOM)
    }

    fn cube() -> ShapeRow {
        ShapeRow::Box {
            center: [0.0, 0.0, 0.0].map(PlainF32),
            half_extents: [0.5, 0.5, 0.5].map(PlainF32),
            rotation: [0.0, 0.0, 0.0, 1.0].map(PlainF32),
        }
    }

    fn plane_at(normal: [f32; 3], offset: f32) -> ShapeRow {
        ShapeRow::Plane { normal: normal.map(PlainF32), offset: PlainF32(offset) }
    }

    /// Returns the bounding box of a polygon.
    fn bounding_box(shape: &Shape) -> [DVec2; 2] {
        let Shape::Polygon { corners, .. } = shape else { panic!("{shape:?} is not a polygon") };
        let fold = |pick: fn(DVec2, DVec2) -> DVec2| corners.iter().copied().reduce(pick).unwrap();
        [fold(DVec2::min), fold(DVec2::max)].map(|corner| (corner * 1e6).round() / 1e6)
    }

    #[test]
    fn only_the_visible_faces_of_a_box_are_drawn() {
        for (view, count) in [(View::Front, 1), (View::Side, 1), (View::Top, 1), (View::Iso, 3)] {
            assert_eq!(drawn(view, cube()).len(), count, "{view:?}");
        }
        let face = &drawn(View::Front, cube())[0];
        assert_eq!(bounding_box(face), [DVec2::splat(58.0), DVec2::splat(142.0)]);
    }

    #[test]
    fn the_center_of_each_face_is_in_the_direction_of_its_normal() {
        let corners = ROOM.corners();
        let normals = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [-axis, axis]);
        for (face, normal) in FACES.into_iter().zip(normals) {
            let center = face.iter().map(|corner| corners[*corner]).sum::<DVec3>() / 4.0;
            assert_eq!(center, normal, "{face:?}");
            assert!(EDGES.contains(&[face[0].min(face[1]), face[0].max(face[1])]));
        }
    }

    #[test]
    fn planes_are_clipped_to_the_room_and_are_lines_when_seen_edge_on() {
        let floor = plane_at([0.0, 1.0, 0.0], -0.5);
        let line = bounding_box(&drawn(View::Front, floor)[0]);
        assert_eq!(line, [DVec2::new(16.0, 142.0), DVec2::new(184.0, 142.0)]);
        let area = bounding_box(&drawn(View::Top, floor)[0]);
        assert_eq!(area, [DVec2::splat(16.0), DVec2::splat(184.0)]);
        assert_eq!(drawn(View::Front, plane_at([0.0, 1.0, 0.0], -2.0)), []);
    }

    #[test]
    fn a_capsule_is_a_thick_line_or_a_circle_when_seen_along_its_axis() {
        let capsule = ShapeRow::Capsule {
            a: [-0.5, 0.0, 0.0].map(PlainF32),
            b: [0.5, 0.0, 0.0].map(PlainF32),
            radius: PlainF32(0.25),
        };
        let [Shape::Segment { stroke: below, .. }, Shape::Segment { ends, stroke }] =
            &drawn(View::Front, capsule)[..]
        else {
            panic!("expected two lines")
        };
        assert_eq!(*ends, [DVec2::new(58.0, 100.0), DVec2::new(142.0, 100.0)]);
        assert!((below.width + stroke.width - 84.0).abs() < 1e-9);
        let side = drawn(View::Side, capsule);
        assert!(matches!(side[..], [Shape::Circle { radius: 21.0, .. }]), "{side:?}");
    }

    #[test]
    fn planes_are_behind_bounds_and_bounds_behind_solid_shapes() {
        let bounds = ShapeRow::Bounds { min: [PlainF32(-1.0); 3], max: [PlainF32(1.0); 3] };
        let near =
            ShapeRow::Sphere { center: [0.0, 0.0, 1.0].map(PlainF32), radius: PlainF32(0.5) };
        let collider = |shape| ColliderRow {
            shape,
            restitution: PlainF32(0.0),
            friction: PlainF32(0.0),
            velocity: [PlainF32(0.0); 3],
            angular_velocity: None,
            details: ColliderDetails::default(),
        };
        let colliders = [near, cube(), bounds, plane_at([0.0, 1.0, 0.0], 0.0)].map(collider);
        let colliders = Some(CollidersRow { step: 0, colliders: colliders.into() });
        let recorded = RecordedState { colliders, ..RecordedState::default() };
        let state = SceneState { recorded, ..SceneState::default() };
        let drawn = shapes(&state, &camera(View::Front), &ROOM);
        assert_eq!(drawn.len(), 1 + EDGES.len() + 1 + 1);
        assert!(matches!(drawn[0], Shape::Polygon { fill: PLANE_FILL, .. }));
        assert!(matches!(drawn[1], Shape::Segment { .. }));
        assert!(matches!(drawn[14], Shape::Circle { .. }));
    }
}
