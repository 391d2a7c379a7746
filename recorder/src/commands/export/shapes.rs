//! Faces of the cloth and of colliders, for formats of meshes.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

use glam::{DQuat, DVec3};
use recording::pictures::{Extent, ExtentTracker};
use recording::{SceneState, ShapeRow};
use sim_contract::{PlainF32, Triangle};
use sim_solver::Scene;
use sim_solver::scene::{NameRun, Obj, Shape};

use super::snapshots::Snapshots;

/// A face of the surface.
#[derive(Debug)]
pub(super) struct Face {
    /// The particles at its corners, in order.
    pub(super) corners: Vec<u32>,
    /// By corner: an index of [`Faces::uvs`]; empty without texture coordinates.
    pub(super) uvs: Vec<u32>,
    /// An index of [`Faces::groups`].
    pub(super) group: Option<u32>,
    /// An index of [`Faces::materials`].
    pub(super) material: Option<u32>,
    /// Its triangles in `/surface`.
    triangles: Range<usize>,
}

/// All faces, in the order of `/surface`.
#[derive(Debug, Default)]
pub(super) struct Faces {
    pub(super) all: Vec<Face>,
    /// Texture coordinates of all meshes.
    pub(super) uvs: Vec<[f32; 2]>,
    /// Names of groups. Groups of the same name in several meshes are one.
    pub(super) groups: Vec<String>,
    /// Names of materials.
    pub(super) materials: Vec<String>,
}

impl Faces {
    pub(super) fn of(snapshots: &Snapshots<'_>) -> anyhow::Result<Self> {
        Ok(Self::new(snapshots.scene, &snapshots.first()?.triangles))
    }

    fn new(scene: Option<&Scene>, triangles: &[Triangle]) -> Self {
        let mut faces = Self::default();
        let mut next = 0;
        for (shape, particles) in scene.into_iter().flat_map(Scene::shapes) {
            let Shape::Obj(mesh) = shape else { continue };
            let is_before = |one: &&Triangle| u64::from(one.corners[0]) < particles.start;
            let before = triangles[next..].iter().take_while(is_before).count();
            faces.add_triangles(next..next + before, triangles);
            let first = u32::try_from(particles.start).unwrap_or(u32::MAX);
            next = faces.add_mesh(mesh, first, next + before, triangles);
        }
        faces.add_triangles(next..triangles.len(), triangles);
        faces
    }

    fn add_triangles(&mut self, range: Range<usize>, triangles: &[Triangle]) {
        for index in range {
            let corners = triangles[index].corners.to_vec();
            let triangles = index..index + 1;
            self.all.push(Face {
                corners,
                uvs: Vec::new(),
                group: None,
                material: None,
                triangles,
            });
        }
    }

    /// Adds the faces of a mesh that begins at a particle and a triangle, as far as their triangles are those
    /// of the recording. Returns the place behind these.
    fn add_mesh(
        &mut self,
        mesh: &Obj,
        first_particle: u32,
        mut next: usize,
        triangles: &[Triangle],
    ) -> usize {
        let first_uv = u32::try_from(self.uvs.len()).unwrap_or(u32::MAX);
        self.uvs.extend_from_slice(&mesh.details.uvs);
        for (index, corners) in mesh.faces.iter().enumerate() {
            let corners: Vec<_> = corners.iter().map(|corner| first_particle + corner).collect();
            let parts = (1..corners.len() - 1)
                .map(|corner| [corners[0], corners[corner], corners[corner + 1]]);
            let range = next..next + corners.len() - 2;
            let recorded = triangles.get(range.clone()).unwrap_or_default();
            if !recorded.iter().map(|one| one.corners).eq(parts) {
                break;
            }
            next = range.end;
            let uvs = mesh.face_uvs(index).iter().map(|uv| first_uv + uv).collect();
            let name = |runs| NameRun::of_face(runs, index);
            let (group, material) = (name(&mesh.details.groups), name(&mesh.details.materials));
            self.all.push(Face {
                corners,
                uvs,
                group: group.map(|name| number(&mut self.groups, name)),
                material: material.map(|name| number(&mut self.materials, name)),
                triangles: range,
            });
        }
        next
    }

    /// Returns the indices of the faces whose triangles are all intact.
    pub(super) fn intact(&self, state: &SceneState) -> Vec<u32> {
        let mut is_intact = vec![false; state.triangles.len()];
        for (triangle, _) in state.intact_triangles() {
            is_intact[triangle] = true;
        }
        let whole = |face: &Face| {
            is_intact.get(face.triangles.clone()).is_some_and(|parts| parts.iter().all(|one| *one))
        };
        (0..).zip(&self.all).filter(|(_, face)| whole(face)).map(|(index, _)| index).collect()
    }
}

/// Returns the number of a name, which is added if it is new.
fn number(names: &mut Vec<String>, name: &str) -> u32 {
    // The faces of a name follow each other, so the last name is the usual one.
    let known = names.iter().rposition(|known| known == name).unwrap_or_else(|| {
        names.push(name.to_owned());
        names.len() - 1
    });
    u32::try_from(known).unwrap_or(u32::MAX)
}

/// Meridians and circles of latitude of a sphere.
const MERIDIANS: u32 = 24;
const LATITUDES: u32 = 12;
/// The faces of a box outwards. The bits of a corner say on which side of x, y and z it lies.
const BOX_FACES: [[u32; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// A collider as a mesh in its own frame. Its front sides face the particles.
#[derive(Debug, Default)]
pub(super) struct Solid {
    pub(super) vertices: Vec<DVec3>,
    pub(super) faces: Vec<Vec<u32>>,
}

/// The pose of a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    pub(super) translation: DVec3,
    pub(super) rotation: DQuat,
}

impl Pose {
    pub(super) fn apply(self, point: DVec3) -> DVec3 {
        self.translation + self.rotation * point
    }
}

/// The colliders of a recording.
#[derive(Debug)]
pub(super) struct Colliders {
    /// The box of the scene, which limits planes.
    room: Extent,
}

impl Colliders {
    /// Returns the colliders, or `None` if there are none.
    pub(super) fn of(snapshots: &Snapshots<'_>) -> anyhow::Result<Option<Self>> {
        let first = snapshots.first()?;
        if first.colliders().is_empty() {
            return Ok(None);
        }
        let mut tracker = ExtentTracker::default();
        let is_plane = |shape: &ShapeRow| matches!(shape, ShapeRow::Plane { .. });
        if first.colliders().iter().any(|one| is_plane(&one.shape)) {
            snapshots.for_each(|state| {
                tracker.add(state);
                Ok(())
            })?;
        }
        Ok(Some(Self { room: tracker.extent() }))
    }

    /// Returns the name of a collider.
    pub(super) fn name(index: usize) -> String {
        format!("collider_{index}")
    }

    /// Returns the mesh and the pose of each collider whose pose is finite and whose triangles are known.
    pub(super) fn solids(&self, state: &SceneState) -> impl Iterator<Item = (usize, Solid, Pose)> {
        let colliders = state.colliders().iter().enumerate();
        colliders.filter_map(move |(index, one)| {
            Some((index, self.solid(state, index)?, self.pose(&one.shape)?))
        })
    }

    /// Returns the pose of a shape, if it is finite.
    pub(super) fn pose(&self, shape: &ShapeRow) -> Option<Pose> {
        let (translation, rotation) = match *shape {
            ShapeRow::Plane { normal, offset } => {
                let normal = plain(normal).try_normalize()?;
                let middle = (self.room.min + self.room.max) * 0.5;
                let height = normal.dot(middle) - f64::from(offset.0);
                (middle - normal * height, DQuat::from_rotation_arc(DVec3::Z, normal))
            }
            ShapeRow::Box { center, rotation, .. } | ShapeRow::Mesh { center, rotation, .. } => {
                (plain(center), quaternion(rotation))
            }
            ShapeRow::Sphere { center, .. } => (plain(center), DQuat::IDENTITY),
            ShapeRow::Capsule { a, b, .. } => {
                let (a, b) = (plain(a), plain(b));
                let axis = (b - a).try_normalize().unwrap_or(DVec3::Y);
                ((a + b) * 0.5, DQuat::from_rotation_arc(DVec3::Y, axis))
            }
            ShapeRow::Bounds { min, max } => ((plain(min) + plain(max)) * 0.5, DQuat::IDENTITY),
        };
        let is_finite = translation.is_finite() && rotation.is_finite();
        is_finite.then_some(Pose { translation, rotation })
    }

    /// Returns the mesh of a collider in its own frame.
    pub(super) fn solid(&self, state: &SceneState, collider: usize) -> Option<Solid> {
        Some(match state.colliders().get(collider)?.shape {
            ShapeRow::Plane { .. } => {
                let size = (self.room.max - self.room.min).length();
                square(if size > 0.0 { size } else { 1.0 })
            }
            ShapeRow::Box { half_extents, .. } => solid_box(plain(half_extents)),
            ShapeRow::Sphere { radius, .. } => capsule(radius.0.into(), 0.0),
            ShapeRow::Capsule { a, b, radius } => {
                capsule(radius.0.into(), (plain(b) - plain(a)).length() / 2.0)
            }
            ShapeRow::Bounds { min, max } => {
                let mut room = solid_box((plain(max) - plain(min)) * 0.5);
                room.faces.iter_mut().for_each(|face| face.reverse());
                room
            }
            ShapeRow::Mesh { .. } => {
                let mesh = state.collider_mesh(collider)?;
                Solid {
                    vertices: mesh
                        .vertices
                        .iter()
                        .map(|one| DVec3::from(one.map(f64::from)))
                        .collect(),
                    faces: mesh.triangles.iter().map(|one| one.to_vec()).collect(),
                }
            }
        })
    }
}

fn plain(vector: [PlainF32; 3]) -> DVec3 {
    DVec3::from_array(vector.map(|one| one.0.into()))
}

fn quaternion(rotation: [PlainF32; 4]) -> DQuat {
    DQuat::from_array(rotation.map(|one| one.0.into())).normalize()
}

/// Returns a square in the plane z = 0 that faces +z.
fn square(half_side: f64) -> Solid {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let vertices = corners.map(|(x, y)| DVec3::new(x, y, 0.0) * half_side).to_vec();
    Solid { vertices, faces: vec![vec![0, 1, 2, 3]] }
}

fn solid_box(half_extents: DVec3) -> Solid {
    let side = |corner: u32, axis: u32| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
    let corner = |one: u32| half_extents * DVec3::new(side(one, 0), side(one, 1), side(one, 2));
    let faces = BOX_FACES.iter().map(|face| face.to_vec()).collect();
    Solid { vertices: (0..8).map(corner).collect(), faces }
}

/// Returns a capsule along y with these distances of its ends from its middle; without them a sphere.
fn capsule(radius: f64, half_length: f64) -> Solid {
    let half = LATITUDES / 2;
    let latitude = |circle: u32| FRAC_PI_2 - PI * f64::from(circle) / f64::from(LATITUDES);
    let upper = (1..=half).map(|circle| (latitude(circle), half_length));
    // The equator of a sphere belongs to both halves.
    let first_lower = if half_length > 0.0 { half } else { half + 1 };
    let lower = (first_lower..LATITUDES).map(|circle| (latitude(circle), -half_length));
    let top = DVec3::new(0.0, half_length + radius, 0.0);
    let mut solid = Solid { vertices: vec![top], faces: Vec::new() };
    let mut circle_count = 0;
    for (angle, height) in upper.chain(lower) {
        let (y, distance) = (height + radius * angle.sin(), radius * angle.cos());
        solid.vertices.extend((0..MERIDIANS).map(|meridian| {
            let turn = TAU * f64::from(meridian) / f64::from(MERIDIANS);
            DVec3::new(distance * turn.cos(), y, -distance * turn.sin())
        }));
        circle_count += 1;
    }
    solid.vertices.push(-top);
    let vertex = |circle: u32, meridian: u32| 1 + circle * MERIDIANS + meridian % MERIDIANS;
    let bottom = 1 + circle_count * MERIDIANS;
    for meridian in 0..MERIDIANS {
        let next = meridian + 1;
        solid.faces.push(vec![0, vertex(0, meridian), vertex(0, next)]);
        let quads = (1..circle_count).map(|below| {
            let above = below - 1;
            vec![
                vertex(above, meridian),
                vertex(below, meridian),
                vertex(below, next),
                vertex(above, next),
            ]
        });
        solid.faces.extend(quads);
        let last = circle_count - 1;
        solid.faces.push(vec![vertex(last, meridian), bottom, vertex(last, next)]);
    }
    solid
}

#[cfg(test)]
mod colliders_tests {
    use super::*;

    /// Returns the volume inside the faces, which is positive if they face outwards.
    fn volume(solid: &Solid) -> f64 {
        let at = |vertex: u32| solid.vertices[vertex as usize];
        let cone = |face: &Vec<u32>| -> f64 {
            let parts = face.windows(2).skip(1);
            parts.map(|pair| at(face[0]).dot(at(pair[0]).cross(at(pair[1]))) / 6.0).sum()
        };
        solid.faces.iter().map(cone).sum()
    }

    /// Every edge belongs to two faces of opposite direction.
    fn assert_closed(solid: &Solid) {
        let edges = solid.faces.iter().flat_map(|face| {
            (0..face.len()).map(|place| (face[place], face[(place + 1) % face.len()]))
        });
        let edges: std::collections::BTreeSet<_> = edges.collect();
        assert_eq!(edges.len(), solid.faces.iter().map(Vec::len).sum::<usize>());
        assert!(edges.iter().all(|(from, to)| edges.contains(&(*to, *from))));
    }

    #[test]
    fn solids_are_closed_and_have_their_volumes() {
        let ball = |radius: f64| 4.0 / 3.0 * PI * radius.powi(3);
        for (solid, expected) in [
            (solid_box(DVec3::new(1.0, 2.0, 3.0)), 48.0),
            (capsule(0.5, 0.0), ball(0.5)),
            (capsule(0.5, 2.0), ball(0.5) + 4.0 * PI * 0.25),
        ] {
            assert_closed(&solid);
            let ratio = volume(&solid) / expected;
            // An inscribed polyhedron is smaller.
            assert!(ratio > 0.96 && ratio < 1.0 + 1e-12, "{ratio}");
        }
    }

    #[test]
    fn a_plane_and_a_capsule_are_turned_to_their_directions() {
        let colliders =
            Colliders { room: Extent { min: DVec3::splat(-1.0), max: DVec3::splat(3.0) } };
        let normal = [0.6, 0.8, 0.0].map(PlainF32);
        let pose = colliders.pose(&ShapeRow::Plane { normal, offset: PlainF32(0.4) }).unwrap();
        for corner in square(2.0).vertices {
            let height = pose.apply(corner).dot(DVec3::new(0.6, 0.8, 0.0));
            assert!((height - 0.4).abs() < 1e-6, "{height}");
        }
        let (a, b) = ([1.0, 0.0, 0.0].map(PlainF32), [1.0, 0.0, 4.0].map(PlainF32));
        let pose = colliders.pose(&ShapeRow::Capsule { a, b, radius: PlainF32(0.5) }).unwrap();
        let top = pose.apply(capsule(0.5, 2.0).vertices[0]);
        assert!(top.distance(DVec3::new(1.0, 0.0, 4.5)) < 1e-9, "{top}");
        let center = [f32::NAN, 0.0, 0.0].map(PlainF32);
        assert_eq!(colliders.pose(&ShapeRow::Sphere { center, radius: PlainF32(1.0) }), None);
    }
}
