//! Poses of colliders and anchors, relative to those at load, from what a node publishes.
//!
//! `move_collider` and `move_anchor` take such poses. A client that moves something from where it is needs
//! the present one, which a scene's own motion and other clients may have changed.

use glam::{DQuat, DVec3};

use super::definition::Scene;
use super::definition::collider::ColliderGeometry;
use crate::rotation::Pose;
use sim_types::ColliderFields;

/// Shortest distance between particles from which a rotation is computed, relative to that from the origin.
const ARM_MIN: f64 = 1e-6;

/// The colliders and anchors of a scene at load.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ScenePoses {
    colliders: Vec<ColliderGeometry>,
    anchors: Vec<AnchorAtLoad>,
}

#[derive(Debug, Clone, Default, PartialEq)]
struct AnchorAtLoad {
    origin: DVec3,
    /// Particles, with their positions at load.
    particles: Vec<(u32, DVec3)>,
}

/// A particle of an anchor at load and now.
#[derive(Debug, Clone, Copy)]
struct Placed {
    at_load: DVec3,
    now: DVec3,
}

impl ScenePoses {
    /// The poses of a scene at load.
    pub fn new(scene: &Scene) -> Self {
        let colliders = scene.colliders.iter().map(|one| one.shape).collect();
        if scene.anchors.is_empty() {
            return Self { colliders, anchors: Vec::new() };
        }
        let positions = scene.positions().0;
        let anchors = scene.anchors.iter().map(|anchor| AnchorAtLoad {
            origin: vector(anchor.origin),
            particles: anchor
                .particles
                .iter()
                .filter_map(|one| Some((*one, vector(*positions.get(*one as usize)?))))
                .collect(),
        });
        Self { colliders, anchors: anchors.collect() }
    }

    /// Returns the particles of each anchor.
    pub fn anchored(&self) -> impl Iterator<Item = Vec<u32>> + '_ {
        self.anchors.iter().map(|anchor| anchor.particles.iter().map(|(one, _)| *one).collect())
    }

    /// Returns the pose of a collider that a node publishes. Leaves out the rotation about an axis of symmetry. `None` if
    /// the scene has no such collider.
    pub fn collider(&self, index: u32, now: &ColliderFields) -> Option<Pose> {
        let geometry = self.colliders.get(index as usize)?;
        let at_load = geometry.fields();
        let rotation = match geometry {
            ColliderGeometry::Box { .. } | ColliderGeometry::Mesh { .. } => {
                quaternion(now.rotation) * quaternion(at_load.rotation).conjugate()
            }
            ColliderGeometry::Plane { .. } => turn(vector(at_load.normal), vector(now.normal)),
            ColliderGeometry::Capsule { .. } => {
                turn(vector(at_load.b) - vector(at_load.a), vector(now.b) - vector(now.a))
            }
            ColliderGeometry::Sphere { .. } | ColliderGeometry::Bounds { .. } => DQuat::IDENTITY,
        };
        Some(pose(center(now) - center(&at_load), rotation))
    }

    /// Returns the pose of an anchor whose particles are at `position`, which is `None` for a particle that
    /// something else holds. If the particles lie on one line, the rotation about that line is unknown and left out.
    /// `None` if the scene has no such anchor, or it drives no particle.
    pub fn anchor(&self, index: u32, position: impl Fn(u32) -> Option<[f32; 3]>) -> Option<Pose> {
        let AnchorAtLoad { origin, particles } = self.anchors.get(index as usize)?;
        let placed = particles.iter().filter_map(|(particle, at_load)| {
            Some(Placed { at_load: *at_load, now: vector(position(*particle)?) })
        });
        let placed: Vec<_> = placed.collect();
        let first = *placed.first()?;
        let rotation = rotation(&placed);
        let translation = first.now - *origin - rotation * (first.at_load - *origin);
        Some(pose(translation, rotation))
    }
}

/// Finds the rotation from the particle farthest from the first one, and that farthest from the line through both.
fn rotation(placed: &[Placed]) -> DQuat {
    let Some(first) = placed.first() else { return DQuat::IDENTITY };
    let arms = || placed.iter().map(|one| (one.at_load - first.at_load, one.now - first.now));
    let by = |length: fn(DVec3, DVec3) -> f64, along: DVec3| {
        arms().max_by(|a, b| length(a.0, along).total_cmp(&length(b.0, along)))
    };
    let Some((from, to)) = by(|arm, _| arm.length_squared(), DVec3::ZERO) else {
        return DQuat::IDENTITY;
    };
    let size = first.at_load.abs().max_element().max(from.abs().max_element());
    if from.length() <= ARM_MIN * size || to.length() == 0.0 {
        return DQuat::IDENTITY;
    }
    let swing = turn(from, to);
    let axis = from.normalize();
    let aside = |arm: DVec3, axis: DVec3| (arm - axis * arm.dot(axis)).length_squared();
    let Some((second_from, second_to)) = by(aside, axis) else { return swing };
    if aside(second_from, axis).sqrt() <= ARM_MIN * size {
        return swing;
    }
    // Both are now seen along the line, where only the twist about it is left.
    let axis = to.normalize();
    let swung = swing * second_from;
    let (from, to) = (swung - axis * swung.dot(axis), second_to - axis * second_to.dot(axis));
    let angle = axis.dot(from.cross(to)).atan2(from.dot(to));
    DQuat::from_axis_angle(axis, angle) * swing
}

/// The smallest rotation that turns one direction into another; none for vectors without a direction.
fn turn(from: DVec3, to: DVec3) -> DQuat {
    match (from.try_normalize(), to.try_normalize()) {
        (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to),
        _ => DQuat::IDENTITY,
    }
}

/// The point about which a collider rotates; for a plane, the point nearest to the origin.
fn center(fields: &ColliderFields) -> DVec3 {
    use sim_types::ColliderShape::{Bounds, Box, Capsule, Mesh, Plane, Sphere};
    match fields.shape {
        Plane => vector(fields.normal) * f64::from(fields.offset),
        Box | Sphere | Mesh => vector(fields.center),
        Capsule | Bounds => (vector(fields.a) + vector(fields.b)) * 0.5,
    }
}

fn vector(axes: [f32; 3]) -> DVec3 {
    DVec3::from_array(axes.map(f64::from))
}

fn quaternion(parts: [f32; 4]) -> DQuat {
    DQuat::from_array(parts.map(f64::from)).normalize()
}

#[allow(clippy::cast_possible_truncation, reason = "a pose has f32")]
fn pose(translation: DVec3, rotation: DQuat) -> Pose {
    let rotation = rotation.to_array().map(|part| part as f32);
    Pose { translation: translation.to_array().map(|axis| axis as f32), rotation }
}
