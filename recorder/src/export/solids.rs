//! Colliders as shapes, those that hide the most first.

use glam::{DQuat, DVec3};
use recorder::{ColliderRow, ShapeRow};

use super::camera::Camera;
use super::extent::{Extent, box_corners, plain};
use super::shape::{Color, Shape, Stroke};

const FILL: Color = Color([0xd9, 0xde, 0xe4]);
const OUTLINE: Color = Color([0x8d, 0x98, 0xa5]);
const PLANE_FILL: Color = Color([0xec, 0xec, 0xe6]);
/// In pixels of a picture of 720.
const OUTLINE_WIDTH: f64 = 1.2;

/// The faces of a box, as corners of an [`Extent`] in their order around it, by axis and side.
const FACES: [[usize; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
/// Its edges.
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

/// The shapes of all colliders; planes are cut off at `room`.
pub(crate) fn shapes(colliders: &[ColliderRow], camera: &Camera, room: &Extent) -> Vec<Shape> {
    let mut order: Vec<_> = colliders.iter().collect();
    // Stable: ties stay in the order of their index.
    order.sort_by(|one, other| {
        let [one, other] = [one, other].map(|collider| place(&collider.shape, camera));
        one.0.cmp(&other.0).then(one.1.total_cmp(&other.1))
    });
    order.into_iter().flat_map(|collider| shapes_of(&collider.shape, camera, room)).collect()
}

/// Planes are behind bounds, and both are behind what is solid, by its distance.
fn place(shape: &ShapeRow, camera: &Camera) -> (u8, f64) {
    match shape {
        ShapeRow::Plane { .. } => (0, 0.0),
        ShapeRow::Bounds { .. } => (1, 0.0),
        ShapeRow::Box { center, .. } | ShapeRow::Sphere { center, .. } => {
            (2, camera.nearness(plain(*center)))
        }
        ShapeRow::Capsule { a, b, .. } => (2, camera.nearness((plain(*a) + plain(*b)) * 0.5)),
    }
}

fn shapes_of(shape: &ShapeRow, camera: &Camera, room: &Extent) -> Vec<Shape> {
    match *shape {
        ShapeRow::Plane { normal, offset } => {
            plane(plain(normal), offset.0.into(), camera, room).into_iter().collect()
        }
        ShapeRow::Box { center, half_extents, rotation } => {
            let turn = DQuat::from_array(rotation.map(|one| one.0.into()));
            solid_box(&box_corners(center, half_extents, rotation), turn, camera)
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
    }
}

fn outline(camera: &Camera) -> Stroke {
    Stroke::solid(OUTLINE, OUTLINE_WIDTH * camera.line_scale())
}

/// The faces that are seen; those of a box never hide each other.
fn solid_box(corners: &[DVec3; 8], turn: DQuat, camera: &Camera) -> Vec<Shape> {
    let normals = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| turn * axis);
    let normals = normals.into_iter().flat_map(|normal| [-normal, normal]);
    let seen = FACES.into_iter().zip(normals).filter(|(_, normal)| camera.sees(*normal));
    let face = |(face, normal): ([usize; 4], DVec3)| Shape::Polygon {
        corners: face.map(|corner| camera.project(corners[corner])).into(),
        fill: FILL.times(camera.brightness(normal)),
        outline: Some(outline(camera)),
    };
    seen.map(face).collect()
}

/// Seen from anywhere a capsule is a thick line with round ends; its outline is a thicker one
/// below it.
fn capsule(ends: [DVec3; 2], radius: f64, camera: &Camera) -> Vec<Shape> {
    let [a, b] = ends.map(|end| camera.project(end));
    let (line, radius) = (outline(camera), camera.pixels(radius));
    if (a - b).length() < 0.01 {
        // Some programs draw no line without a length.
        return vec![Shape::Circle { center: a, radius, fill: FILL, outline: Some(line) }];
    }
    let thick = |color, width| Shape::Segment { ends: [a, b], stroke: Stroke::solid(color, width) };
    let width = 2.0 * radius;
    vec![thick(line.color, width + line.width), thick(FILL, width - line.width)]
}

/// The part of a plane that is in the room; seen edge-on it is a line.
fn plane(normal: DVec3, offset: f64, camera: &Camera, room: &Extent) -> Option<Shape> {
    let middle = (room.min + room.max) * 0.5;
    let foot = middle - normal * (normal.dot(middle) - offset);
    let (right, up) = normal.any_orthonormal_pair();
    let (right, up) = (right * room.size().length(), up * room.size().length());
    let mut corners =
        vec![foot + right + up, foot - right + up, foot - right - up, foot + right - up];
    for axis in DVec3::AXES {
        corners = cut_off(&corners, axis, axis.dot(room.max));
        corners = cut_off(&corners, -axis, -axis.dot(room.min));
    }
    let corners: Vec<_> = corners.into_iter().map(|corner| camera.project(corner)).collect();
    (corners.len() >= 3).then(|| Shape::Polygon {
        corners,
        fill: PLANE_FILL,
        outline: Some(outline(camera)),
    })
}

/// A polygon without what is beyond `limit` along `axis` (Sutherland and Hodgman 1974).
fn cut_off(corners: &[DVec3], axis: DVec3, limit: f64) -> Vec<DVec3> {
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
    use sim_contract::PlainF32;
    use sim_solver::scene::Up;

    use super::*;
    use crate::export::camera::{Basis, View};
    use crate::export::shape::Size;

    const ROOM: Extent = Extent { min: DVec3::NEG_ONE, max: DVec3::ONE };

    /// 84 pixels are a unit, and (0, 0, 0) is at (100, 100).
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

    /// The box around the corners of a polygon.
    fn frame(shape: &Shape) -> [DVec2; 2] {
        let Shape::Polygon { corners, .. } = shape else { panic!("{shape:?} is no polygon") };
        let fold = |pick: fn(DVec2, DVec2) -> DVec2| corners.iter().copied().reduce(pick).unwrap();
        [fold(DVec2::min), fold(DVec2::max)].map(|corner| (corner * 1e6).round() / 1e6)
    }

    #[test]
    fn of_a_box_the_faces_that_are_seen_are_drawn() {
        for (view, count) in [(View::Front, 1), (View::Side, 1), (View::Top, 1), (View::Iso, 3)] {
            assert_eq!(drawn(view, cube()).len(), count, "{view:?}");
        }
        let face = &drawn(View::Front, cube())[0];
        assert_eq!(frame(face), [DVec2::splat(58.0), DVec2::splat(142.0)]);
    }

    #[test]
    fn the_faces_of_a_box_are_where_their_normals_point() {
        let corners = ROOM.corners();
        let normals = [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [-axis, axis]);
        for (face, normal) in FACES.into_iter().zip(normals) {
            let middle = face.iter().map(|corner| corners[*corner]).sum::<DVec3>() / 4.0;
            assert_eq!(middle, normal, "{face:?}");
            assert!(EDGES.contains(&[face[0].min(face[1]), face[0].max(face[1])]));
        }
    }

    #[test]
    fn planes_end_at_the_room_and_are_lines_from_their_edge() {
        let floor = plane_at([0.0, 1.0, 0.0], -0.5);
        let line = frame(&drawn(View::Front, floor)[0]);
        assert_eq!(line, [DVec2::new(16.0, 142.0), DVec2::new(184.0, 142.0)]);
        let area = frame(&drawn(View::Top, floor)[0]);
        assert_eq!(area, [DVec2::splat(16.0), DVec2::splat(184.0)]);
        assert_eq!(drawn(View::Front, plane_at([0.0, 1.0, 0.0], -2.0)), []);
    }

    #[test]
    fn a_capsule_is_a_line_as_thick_as_it_is_and_from_its_end_a_circle() {
        let capsule = ShapeRow::Capsule {
            a: [-0.5, 0.0, 0.0].map(PlainF32),
            b: [0.5, 0.0, 0.0].map(PlainF32),
            radius: PlainF32(0.25),
        };
        let [Shape::Segment { stroke: below, .. }, Shape::Segment { ends, stroke }] =
            &drawn(View::Front, capsule)[..]
        else {
            panic!("two lines are expected")
        };
        assert_eq!(*ends, [DVec2::new(58.0, 100.0), DVec2::new(142.0, 100.0)]);
        assert!((below.width + stroke.width - 84.0).abs() < 1e-9);
        let side = drawn(View::Side, capsule);
        assert!(matches!(side[..], [Shape::Circle { radius: 21.0, .. }]), "{side:?}");
    }

    #[test]
    fn planes_are_behind_bounds_and_these_behind_what_is_nearer() {
        let bounds = ShapeRow::Bounds { min: [PlainF32(-1.0); 3], max: [PlainF32(1.0); 3] };
        let near =
            ShapeRow::Sphere { center: [0.0, 0.0, 1.0].map(PlainF32), radius: PlainF32(0.5) };
        let collider = |shape| ColliderRow {
            shape,
            restitution: PlainF32(0.0),
            friction: PlainF32(0.0),
            velocity: [PlainF32(0.0); 3],
            angular_velocity: None,
        };
        let colliders = [near, cube(), bounds, plane_at([0.0, 1.0, 0.0], 0.0)].map(collider);
        let drawn = shapes(&colliders, &camera(View::Front), &ROOM);
        assert_eq!(drawn.len(), 1 + EDGES.len() + 1 + 1);
        assert!(matches!(drawn[0], Shape::Polygon { fill: PLANE_FILL, .. }));
        assert!(matches!(drawn[1], Shape::Segment { .. }));
        assert!(matches!(drawn[14], Shape::Circle { .. }));
    }
}
