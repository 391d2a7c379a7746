//! Poses of colliders and anchors, relative to those at load, from what a node publishes.
//!
//! `move_collider` and `move_anchor` take such poses. A client that moves something from where it is needs
//! the present one, which a scene's own motion and other clients may have changed.

use glam::{DQuat, DVec3};

use super::definition::Scene;
use super::definition::collider::ColliderGeometry;
use crate::frame::Pose;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Solver;

    const SCENE: &str = "
        version = 1
        [[particle]]
        position = [0, 0, 0]
        [[generate]]
        shape = 'cloth'
        columns = 3
        rows = 3
        spacing = 0.25
        [[anchor]]
        particles = [1, 3, 7, 8]
        origin = [0.5, 0.25, 0]
        path = [{ time = 0 }, { time = 2, translation = [0, 1, 0], rotation = [0.5, 0.5, 0.5, 0.5] }]
        [[anchor]]
        particles = [4, 5]
        [[collider]]
        shape = 'box'
        center = [1, 2, 3]
        half_extents = [0.1, 0.2, 0.3]
        rotation = [0, 0, 0.6, 0.8]
        angular_velocity = [1, 2, 0]
        velocity = [0.5, 0, 0]
        [[collider]]
        shape = 'capsule'
        a = [0, -3, 0]
        b = [1, -3, 0]
        radius = 0.1
        [[collider]]
        shape = 'plane'
        normal = [0, 1, 0]
        offset = -9
        [[collider]]
        shape = 'bounds'
        min = [-50, -50, -50]
        max = [50, 50, 50]
        ";

    /// A pose that is given back to the node leaves everything where it is.
    #[test]
    fn the_pose_of_a_state_puts_it_where_it_is() {
        let scene = Scene::from_toml(SCENE, "").unwrap();
        let poses = ScenePoses::new(&scene);
        let mut solver = Solver::new(&scene);
        let moves = [
            (1, Pose { translation: [0.5, 0.25, -1.0], rotation: [0.0, 0.6, 0.0, 0.8] }),
            (2, Pose { translation: [0.0, -0.5, 0.0], rotation: [0.1, 0.0, 0.0, 1.0] }),
            (3, Pose { translation: [0.0, 1.0, 2.0], rotation: [0.0, 0.0, 0.0, 1.0] }),
        ];
        for (collider, pose) in moves {
            solver.move_collider(collider, pose).unwrap();
        }
        for _ in 0..50 {
            solver.step();
        }
        let colliders: Vec<_> = solver.colliders().map(|one| one.shape.fields()).collect();
        let particles: Vec<_> =
            (0..10).map(|particle| solver.particle(particle).position).collect();
        for (index, fields) in (0..).zip(&colliders) {
            solver.move_collider(index, poses.collider(index, fields).unwrap()).unwrap();
        }
        for anchor in [0, 1] {
            let pose = poses.anchor(anchor, |one| particles.get(one as usize).copied()).unwrap();
            solver.move_anchor(anchor, pose).unwrap();
        }
        solver.step();
        for (before, after) in colliders.iter().zip(solver.colliders()) {
            let after = after.shape.fields();
            let near =
                |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
            let is_near = near(before.center, after.center)
                && near(before.normal, after.normal)
                && near(before.a, after.a)
                && near(before.b, after.b)
                && (before.offset - after.offset).abs() < 1e-4;
            assert!(is_near, "{before:?} {after:?}");
            let dot: f32 = before.rotation.iter().zip(after.rotation).map(|(a, b)| a * b).sum();
            assert!(before.rotation == [0.0; 4] || dot.abs() > 1.0 - 1e-6, "{before:?} {after:?}");
        }
        for particle in [1, 3, 7, 8, 4, 5] {
            let (before, after) = (particles[particle], solver.particle(particle).position);
            let distance = (vector(before) - vector(after)).length();
            assert!(distance < 1e-5, "particle {particle}: {before:?} {after:?}");
        }
    }

    #[test]
    fn unknown_and_undriven_things_have_no_pose() {
        let poses = ScenePoses::new(&Scene::from_toml(SCENE, "").unwrap());
        let fields = ColliderFields::new(sim_types::ColliderShape::Sphere);
        assert_eq!(poses.collider(4, &fields), None);
        assert_eq!(poses.anchor(2, |_| Some([0.0; 3])), None);
        assert_eq!(poses.anchor(0, |_| None), None);
        assert_eq!(poses.anchored().collect::<Vec<_>>(), [vec![1, 3, 7, 8], vec![4, 5]]);
    }
}
