//! Messages that are published once per load.

use sim_contract::{
    ColliderShape, ColliderState, ConstraintState, Load, LoadHeader, OwnerError, ParameterValues,
    Triangle,
};
use sim_solver::{PlacedCollider, Scene, Solver, scene};

/// Run and step of a load.
#[derive(Debug, Clone, Copy)]
pub(super) struct LoadPlace {
    pub(super) run_id: u64,
    /// First step that shows the load.
    pub(super) step: u64,
    pub(super) topology_revision: u32,
    pub(super) parameters: ParameterValues,
}

/// Calls `publish` with the load of a scene.
pub(super) fn with_load<T>(
    scene: &Scene,
    solver: &Solver,
    place: LoadPlace,
    publish: impl FnOnce(&Load<'_>) -> Result<T, OwnerError>,
) -> Result<T, OwnerError> {
    let constraints: Vec<_> = solver.constraints().map(to_constraint_state).collect();
    let triangles: Vec<_> =
        solver.triangles().iter().map(|corners| Triangle { corners: *corners }).collect();
    publish(&Load {
        header: LoadHeader {
            run_id: place.run_id,
            step: place.step,
            origin: scene.origin,
            topology_revision: place.topology_revision,
            particle_count: count(solver.particle_count()),
            rate_hz: scene.solver.rate_hz,
            method: scene.solver.method as u32,
            ..LoadHeader::default()
        },
        scene: scene.to_toml().as_bytes(),
        constraints: &constraints,
        triangles: &triangles,
        collider_count: solver.collider_count(),
        keyframe_size_bytes_max: solver.keyframe_size_bytes_max(),
        parameters: place.parameters,
    })
}

/// Returns the free shared memory that a node needs to run a scene, in bytes.
pub(crate) fn shared_memory_bytes(scene: &Scene, solver: &Solver) -> Result<u64, OwnerError> {
    let place = LoadPlace {
        run_id: 0,
        step: 0,
        topology_revision: 0,
        parameters: ParameterValues::DEFAULT,
    };
    with_load(scene, solver, place, |load| Ok(load.shared_memory_bytes()))
}

fn to_constraint_state(constraint: sim_solver::Constraint) -> ConstraintState {
    ConstraintState {
        a: constraint.a,
        b: constraint.b,
        rest_length: constraint.rest_length,
        compliance: constraint.compliance,
        kind: constraint.kind as u32,
    }
}

/// Converts a collider to its published form.
pub(super) fn to_collider_state(collider: &PlacedCollider) -> ColliderState {
    let common = ColliderState {
        restitution: collider.restitution,
        friction: collider.friction,
        velocity: collider.velocity,
        angular_velocity: collider.angular_velocity,
        ..ColliderState::default()
    };
    let with_shape = |shape: ColliderShape| ColliderState { shape: shape as u32, ..common };
    match collider.shape {
        scene::ColliderGeometry::Plane { normal, offset } => {
            ColliderState { normal, offset, ..with_shape(ColliderShape::Plane) }
        }
        scene::ColliderGeometry::Box { center, half_extents, rotation } => {
            ColliderState { center, half_extents, rotation, ..with_shape(ColliderShape::Box) }
        }
        scene::ColliderGeometry::Sphere { center, radius } => {
            ColliderState { center, radius, ..with_shape(ColliderShape::Sphere) }
        }
        scene::ColliderGeometry::Capsule { a, b, radius } => {
            ColliderState { a, b, radius, ..with_shape(ColliderShape::Capsule) }
        }
        scene::ColliderGeometry::Bounds { min, max } => {
            ColliderState { a: min, b: max, ..with_shape(ColliderShape::Bounds) }
        }
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 of anything")]
pub(super) fn count(length: usize) -> u32 {
    length as u32
}
