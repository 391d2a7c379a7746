//! The rigid bodies of a scene, in a world of rapier3d.

use anyhow::{Context, bail};
use rapier3d::glamx::{DVec3, Quat, Vec3};
use rapier3d::prelude::{
    ColliderBuilder, MassProperties, PhysicsWorld, Pose, RigidBodyBuilder, RigidBodyHandle,
};
use sim_contract::{Action, ColliderState, ForceKind, Forces};
use sim_solver::Scene;
use sim_solver::scene::{ColliderGeometry, SceneCollider};

/// The bodies of a scene. Their poses are those of the node: relative to the pose at load.
pub(crate) struct World {
    physics: PhysicsWorld,
    bodies: Vec<Body>,
}

/// A body of the scene.
struct Body {
    /// Index of its collider.
    collider: u32,
    handle: RigidBodyHandle,
    center_at_load: Vec3,
}

impl World {
    /// Places all bodies of a scene as the node has them in `states`.
    pub(crate) fn new(scene: &Scene, states: &[ColliderState]) -> anyhow::Result<Self> {
        let mut physics = PhysicsWorld::new();
        physics.integration_parameters.dt = 1.0 / scene.solver.rate_hz as f32;
        let mut bodies = Vec::new();
        for ((index, collider), state) in (0..).zip(&scene.colliders).zip(states) {
            let Some(mass) = &collider.body else { continue };
            let load = PoseAtLoad::new(collider)?;
            let inertia = Vec3::from(mass.inertia);
            let mass = MassProperties::with_principal_inertia_frame(
                Vec3::ZERO,
                mass.mass,
                inertia,
                load.axes,
            );
            let (translation, rotation) = load.motion_to(state);
            let body = RigidBodyBuilder::dynamic()
                .pose(Pose::from_parts(load.center + translation, rotation))
                .linvel(state.velocity.into())
                .angvel(state.angular_velocity.into())
                .additional_mass_properties(mass)
                .can_sleep(false);
            // The mass is that of the scene alone.
            let shape = shape(collider, &load)?.density(0.0).friction(collider.friction);
            let (handle, _) = physics.insert(body, shape);
            physics.bodies[handle].recompute_mass_properties_from_colliders(&physics.colliders);
            bodies.push(Body { collider: index, handle, center_at_load: load.center });
        }
        Ok(Self { physics, bodies })
    }

    /// Makes a step, with the impulses of the particles in it.
    pub(crate) fn advance(&mut self, forces: &Forces, gravity: [f32; 3]) {
        for body in &self.bodies {
            let Some(row) = forces.row(ForceKind::Collider, body.collider) else { continue };
            let one = &mut self.physics.bodies[body.handle];
            one.apply_impulse(row.impulse.into(), true);
            one.apply_torque_impulse(row.angular_impulse.into(), true);
        }
        self.physics.gravity = gravity.into();
        self.physics.step();
    }

    /// Returns the commands that move the bodies through the next step.
    pub(crate) fn commands(&self) -> impl Iterator<Item = Action> {
        self.bodies.iter().map(|body| {
            let one = &self.physics.bodies[body.handle];
            Action::DriveBody {
                collider: body.collider,
                translation: (one.translation() - body.center_at_load).into(),
                rotation: one.rotation().to_array(),
                velocity: one.linvel().into(),
                angular_velocity: one.angvel().into(),
                force: [0.0; 3],
                torque: [0.0; 3],
            }
        })
    }

    /// Returns the momentum of all bodies, in kg m/s.
    pub(crate) fn momentum(&self) -> DVec3 {
        let each = self.physics.rigid_bodies();
        each.map(|(_, one)| (one.linvel() * one.mass()).as_dvec3()).sum()
    }

    /// Returns the mass of all bodies, in kg.
    pub(crate) fn mass(&self) -> f64 {
        self.physics.rigid_bodies().map(|(_, one)| f64::from(one.mass())).sum()
    }

    /// Returns the kinetic energy of all bodies and their energy in the gravity, in J.
    pub(crate) fn energy(&self) -> f64 {
        let height = |one: &Vec3| -f64::from(one.dot(self.physics.gravity));
        let each = self.physics.rigid_bodies();
        each.map(|(_, one)| {
            let height = f64::from(one.mass()) * height(&one.translation());
            f64::from(one.kinetic_energy()) + height
        })
        .sum()
    }

    /// Returns the height of the lowest body, against gravity, in m.
    pub(crate) fn height(&self) -> f32 {
        let up = -self.physics.gravity.normalize_or_zero();
        let each = self.physics.rigid_bodies();
        each.map(|(_, one)| one.translation().dot(up)).fold(f32::INFINITY, f32::min)
    }

    /// Returns the greatest speed of a body, in m/s.
    pub(crate) fn speed(&self) -> f32 {
        self.physics.rigid_bodies().map(|(_, one)| one.linvel().length()).fold(0.0, f32::max)
    }
}

/// Center of a collider at load, and the axes of its inertia.
struct PoseAtLoad {
    center: Vec3,
    axes: Quat,
    /// From one end of a capsule to the other.
    axis: Vec3,
}

impl PoseAtLoad {
    fn new(collider: &SceneCollider) -> anyhow::Result<Self> {
        let (center, axes, axis) = match collider.shape {
            ColliderGeometry::Sphere { center, .. } => (center.into(), Quat::IDENTITY, Vec3::ZERO),
            ColliderGeometry::Capsule { a, b, .. } => {
                let (a, b) = (Vec3::from(a), Vec3::from(b));
                ((a + b) / 2.0, Quat::IDENTITY, b - a)
            }
            ColliderGeometry::Box { center, rotation, .. }
            | ColliderGeometry::Mesh { center, rotation, .. } => {
                (center.into(), Quat::from_array(rotation).normalize(), Vec3::ZERO)
            }
            ColliderGeometry::Plane { .. } | ColliderGeometry::Bounds { .. } => {
                bail!("a plane or bounds are no body")
            }
        };
        Ok(Self { center, axes, axis })
    }

    /// Returns the translation and rotation from this pose to the state. That of a sphere does not show.
    fn motion_to(&self, state: &ColliderState) -> (Vec3, Quat) {
        let (a, b) = (Vec3::from(state.a), Vec3::from(state.b));
        if self.axis != Vec3::ZERO {
            let turn = Quat::from_rotation_arc(self.axis.normalize(), (b - a).normalize());
            return ((a + b) / 2.0 - self.center, turn);
        }
        let center = Vec3::from(state.center);
        let rotation = Quat::from_array(state.rotation);
        let turn = if rotation.length_squared() > 0.0 {
            rotation * self.axes.conjugate()
        } else {
            Quat::IDENTITY
        };
        (center - self.center, turn)
    }
}

/// The shape of a body, about its center. A mesh is the hull of its corners: bodies of rapier3d are convex.
fn shape(collider: &SceneCollider, load: &PoseAtLoad) -> anyhow::Result<ColliderBuilder> {
    Ok(match collider.shape {
        ColliderGeometry::Sphere { radius, .. } => ColliderBuilder::ball(radius),
        ColliderGeometry::Capsule { a, b, radius } => ColliderBuilder::capsule_from_endpoints(
            Vec3::from(a) - load.center,
            Vec3::from(b) - load.center,
            radius,
        ),
        ColliderGeometry::Box { half_extents: [x, y, z], .. } => {
            ColliderBuilder::cuboid(x, y, z).position(Pose::from_parts(Vec3::ZERO, load.axes))
        }
        _ => {
            let corners = collider.mesh.iter().flat_map(|mesh| &mesh.vertices);
            let corners: Vec<_> = corners.map(|corner| Vec3::from(*corner)).collect();
            ColliderBuilder::convex_hull(&corners)
                .context("the mesh is flat, and has no hull")?
                .position(Pose::from_parts(Vec3::ZERO, load.axes))
        }
    })
}
