//! Warnings about contacts that cannot work as the scene starts: shapes across meshes, and a thickness that is
//! large or small for a shape.

use glam::Vec3;
use sim_scene::constraints::Constraint;
use sim_scene::model::Model;
use sim_scene::scene::{ColliderGeometry, ContactMode, Generator, Scene, SceneCollider, Shape};
use sim_types::ConstraintKind;

use super::rounded::three_digits;
use crate::contacts::colliders::Collider;
use crate::contacts::contact_substep::{ContactSubstep, Interval};
use crate::contacts::mesh::near::NearMeshes;
use crate::contacts::mesh::{PUSHES_MAX, PlacedMesh, Stop};
use crate::contacts::pairs::{
    CONNECTED_REACH, NEVER_PER_PARTICLE, PAIRS_PER_PARTICLE, ParticleContacts,
};
use crate::contacts::path::SubstepPath;
use crate::contacts::solid::{Solid, solids};
use crate::kernels::Kernels;

/// Largest reach, in spacings, that is without effect: that of the second neighbours begins.
const REACH_MAX: f64 = 2.0;
/// Smallest thickness, in spacings, with which particles mostly stop each other. A sheet of 40 x 40 that falls on its
/// edge crosses itself in no place at 1, in 58 at 0.75, and in 708 at 0.5.
const RATIO_MIN: f64 = 0.75;
const TOO_THIN: &str = "other particles pass between its particles; use at least three quarters of the spacing, or \
                        mode = \"surfaces\" for cloth";
/// The same for surfaces, whose folds tangle: a sheet of 24 x 24 that falls on its edge crosses itself in no place at
/// 0.5, and in hundreds at 0.05.
const SURFACE_RATIO_MIN: f64 = 0.5;
const TOO_THIN_ROPE: &str =
    "other particles pass between its particles; use at least three quarters of the spacing";
const TOO_THIN_SURFACE: &str = "its folds tangle; use at least half of the spacing";
/// Rest lengths are f32 differences of coordinates, so their mean is not quite the spacing.
const WITHOUT_ROUNDING: f64 = 0.999;
/// Thickness, in spacings, from which a sheet on a ball can be thrown apart.
const RATIO_MAX: f64 = 3.0;
/// Cosine of the angle between the normals of opposite sides. An edge of 25 degrees is no corner to cut off.
const OPPOSITE: f32 = -0.9;
/// Part of a segment's length by which it is shifted off an edge that it may pass through.
const SHIFT: f32 = 0.01;
/// Part of a mesh's distance by which particles may start within it unnoticed.
const WITHIN_MIN: f32 = 0.01;

/// Warns of meshes that a shape starts on both sides of: one sentence for each mesh.
pub(super) fn across_mesh(scene: &Scene, model: &Model) -> Vec<String> {
    let is_free = free(scene, model);
    let has_free_ends = |one: &Constraint| [one.a, one.b].iter().all(|end| is_free[*end as usize]);
    let sentence = |(index, collider): (usize, &SceneCollider)| {
        let mut mesh = MeshAtLoad::new(index, collider)?;
        let position = |index: u32| Vec3::from_array(model.particles[index as usize].position);
        let mut across = (0_usize..).zip(&model.constraints).filter(|(_, one)| {
            let [from, to] = [one.a, one.b].map(position);
            one.kind == ConstraintKind::Structural
                && has_free_ends(one)
                && mesh.is_between(from, to)
        });
        let (first, Constraint { a, b, .. }) = across.next()?;
        let count = match 1 + across.count() {
            1 => format!("constraint {first} starts"),
            count => format!("{count} constraints, the first of them {first}, start"),
        };
        Some(format!(
            "{count} across collider {index}, a mesh: particles {a} and {b} are on different sides of it, and each \
             stays on its side; move the mesh or the shape"
        ))
    };
    scene.colliders.iter().enumerate().filter_map(sentence).collect()
}

/// Warns of particles that start nearer to a mesh than its distance: one sentence for each mesh.
pub(super) fn within_distance(scene: &Scene, model: &Model) -> Vec<String> {
    let is_free = free(scene, model);
    let sentence = |(index, collider): (usize, &SceneCollider)| {
        let ColliderGeometry::Mesh { distance, .. } = collider.shape else { return None };
        // Without a distance, a particle on the mesh is too near by its rounding.
        let mut mesh = MeshAtLoad::new(index, collider).filter(|_| distance > 0.0)?;
        let free = model.particles.iter().enumerate().filter(|(particle, _)| is_free[*particle]);
        let depths = free.filter_map(|(particle, one)| {
            let depth = mesh.depth_within_distance(Vec3::from_array(one.position))?;
            (depth > WITHIN_MIN * distance).then_some((particle, depth))
        });
        let depths: Vec<_> = depths.collect();
        let (particle, depth) = depths.iter().rev().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let count = match depths.len() {
            1 => "1 particle starts".to_owned(),
            count => format!("{count} particles start"),
        };
        Some(format!(
            "{count} within the distance of collider {index}, a mesh; particle {particle} is {} {unit} too near: the \
             first step pushes it away at once; move the shape, or use a distance of at most {} {unit}",
            three_digits(f64::from(*depth)),
            three_digits(f64::from(distance - depth)),
            unit = scene.unit
        ))
    };
    scene.colliders.iter().enumerate().filter_map(sentence).collect()
}

/// Returns for each particle whether it can touch a collider.
fn free(scene: &Scene, model: &Model) -> Vec<bool> {
    let mut is_free: Vec<_> = model.particles.iter().map(|particle| !particle.pinned).collect();
    for particle in scene.anchors.iter().flat_map(|anchor| &anchor.particles) {
        is_free[*particle as usize] = false;
    }
    is_free
}

/// A mesh in its pose at load.
struct MeshAtLoad {
    placed: PlacedMesh,
    near: NearMeshes,
}

impl MeshAtLoad {
    fn new(index: usize, collider: &SceneCollider) -> Option<Self> {
        collider.mesh.as_ref()?;
        let interval = Interval { start: 0.0, end: 0.0 };
        let substep = ContactSubstep {
            h: 1.0,
            rest_speed: 0.0,
            gain: Vec3::ZERO,
            interval,
            is_planar: false,
        };
        let solids = solids(&Collider::new(index, collider), &substep);
        let placed = solids.into_iter().flatten().find_map(|solid| match solid {
            Solid::Mesh(placed) => Some(placed),
            _ => None,
        })?;
        Some(Self { placed, near: NearMeshes::new(1) })
    }

    /// Returns `true` if the mesh separates two points outside any solid: a segment between them meets it first from opposite sides.
    /// One that cuts a corner off meets it from two sides that are at an angle. So may one that passes through an edge:
    /// then the segments beside it decide.
    fn is_between(&mut self, from: Vec3, to: Vec3) -> bool {
        if [from, to].into_iter().any(|end| self.placed.depth(end).is_some()) {
            return false;
        }
        let Some((there, back)) = self.normals(from, to) else { return false };
        let along = to - from;
        let across = there - along * (there.dot(along) / along.dot(along));
        let shift = across.normalize_or_zero() * (SHIFT * along.length());
        let mut is_opposite = |shift: Vec3| {
            let normals = self.normals(from + shift, to + shift);
            normals.is_some_and(|(there, back)| there.dot(back) < OPPOSITE)
        };
        let angle = there.dot(back);
        angle < OPPOSITE || angle < 0.0 && [shift, -shift].into_iter().any(&mut is_opposite)
    }

    /// Returns the normals of the first triangles that a segment passes through, from either end.
    fn normals(&mut self, from: Vec3, to: Vec3) -> Option<(Vec3, Vec3)> {
        Some((self.first_normal(from, to)?, self.first_normal(to, from)?))
    }

    /// Returns how much nearer than its distance a point outside any solid is to the mesh.
    fn depth_within_distance(&mut self, point: Vec3) -> Option<f32> {
        if self.placed.depth(point).is_some() {
            return None;
        }
        let path = self.placed.path(&SubstepPath { start: point, displacement: Vec3::ZERO });
        let around = self.placed.surroundings(&mut self.near, 0, &path);
        match self.placed.stop(&path, &around, 0)? {
            Stop::Push(hit) => Some(hit.depth),
            Stop::Hold => None,
        }
    }

    /// Returns the normal of the first triangle that a segment passes through, on the side of `from`.
    fn first_normal(&mut self, from: Vec3, to: Vec3) -> Option<Vec3> {
        let path = SubstepPath { start: from, displacement: to - from };
        let path = self.placed.path(&path);
        let around = self.placed.surroundings(&mut self.near, 0, &path);
        // After the last push, only passages count.
        self.placed.stop(&path, &around, PUSHES_MAX)?;
        match self.placed.stop(&path, &around, 0)? {
            Stop::Push(hit) => Some(hit.normal),
            Stop::Hold => None,
        }
    }
}

/// Warns of a thickness with which neighbours in a shape never touch, or other shapes pass between its particles:
/// one sentence for each generator.
pub(super) fn thickness(scene: &Scene, model: &Model) -> Vec<String> {
    let Some(thickness) = scene.contact.distance() else { return Vec::new() };
    let mut rest = &model.constraints[scene.constraints.len()..];
    let sentence = |(index, generator): (usize, &Generator)| {
        #[allow(clippy::cast_possible_truncation, reason = "at most the constraints of the model")]
        let (own, others) = rest.split_at(generator.shape.constraint_count() as usize);
        rest = others;
        let spacing = mean_spacing(own).filter(|_| generator.contact)?;
        let ratio = f64::from(thickness) / spacing;
        let consequence = if f64::from(CONNECTED_REACH) * ratio >= REACH_MAX {
            too_thick(thickness, ratio, &scene.unit)
        } else {
            too_thin(ratio, scene.contact.mode, &generator.shape)?.to_owned()
        };
        let source = shortest_edge(&model.constraints).filter(|edge| edge.rest_length == thickness);
        let source = source.map_or_else(String::new, |Constraint { a, b, .. }| {
            format!(", the length of the shortest edge, between particles {a} and {b},")
        });
        Some(format!(
            "contact.thickness: {} {unit}{source} is {} times the spacing of generate[{index}], {} {unit}: \
             {consequence}",
            three_digits(f64::from(thickness)),
            three_digits(ratio),
            three_digits(spacing),
            unit = scene.unit,
        ))
    };
    scene.generators.iter().enumerate().filter_map(sentence).collect()
}

/// Warns of a thickness within which there are more neighbours at load than the solver can keep apart.
pub(super) fn overfull(scene: &Scene, model: &Model) -> Option<String> {
    let thickness = scene.contact.distance()?;
    let (mode, kernels) = (scene.contact.mode, Kernels::best());
    ParticleContacts::new(model, mode, Some(thickness), kernels).are_overfull().then(|| {
        format!(
            "contact.thickness: at load, there are more than {PAIRS_PER_PARTICLE} pairs of particles, each counted once, or \
             {NEVER_PER_PARTICLE} triangles for each particle, on average, within {} {unit}, {CONNECTED_REACH} times the thickness: some of them repel each other from the first step on; use a \
             smaller thickness",
            three_digits(f64::from(CONNECTED_REACH * thickness)),
            unit = scene.unit,
        )
    })
}

/// Returns `true` for shapes without holes of their own, so that nothing should pass between their particles.
fn is_closed(shape: &Shape) -> bool {
    matches!(shape, Shape::Cloth(_) | Shape::Mesh(_) | Shape::Rope(_) | Shape::Obj(_))
}

fn too_thick(thickness: f32, ratio: f64, unit: &str) -> String {
    let thrown = if ratio >= RATIO_MAX { ", and what touches can be thrown apart" } else { "" };
    format!(
        "its particles that are nearer than {} {unit} at load never touch, so small folds pass through \
         themselves{thrown}; use at most the spacing",
        three_digits(f64::from(CONNECTED_REACH * thickness)),
    )
}

/// Returns the consequence of a thickness of `ratio` spacings, if it is too small for a shape.
fn too_thin(ratio: f64, mode: ContactMode, shape: &Shape) -> Option<&'static str> {
    // The particles of a rope touch each other in both modes.
    let (ratio_min, consequence) = match (mode, shape) {
        (_, Shape::Rope(_)) => (RATIO_MIN, TOO_THIN_ROPE),
        (ContactMode::Surfaces, _) => (SURFACE_RATIO_MIN, TOO_THIN_SURFACE),
        _ => (RATIO_MIN, TOO_THIN),
    };
    (ratio < ratio_min * WITHOUT_ROUNDING && is_closed(shape)).then_some(consequence)
}

fn shortest_edge(constraints: &[Constraint]) -> Option<&Constraint> {
    let edges = constraints.iter().filter(|one| one.kind == ConstraintKind::Structural);
    edges.min_by(|a, b| a.rest_length.total_cmp(&b.rest_length))
}

/// Mean rest length of the structural constraints.
fn mean_spacing(constraints: &[Constraint]) -> Option<f64> {
    let structural = constraints.iter().filter(|one| one.kind == ConstraintKind::Structural);
    let (sum, count) = structural
        .fold((0.0, 0_u32), |(sum, count), one| (sum + f64::from(one.rest_length), count + 1));
    (sum > 0.0).then(|| sum / f64::from(count))
}
