//! Messages that are published once per load.

use sim_contract::{
    BendState, ColliderState, ConstraintState, Load, LoadHeader, ParameterValues, Triangle,
    scene_hash,
};
use sim_solver::scene::{NotEnoughMemory, check_memory};
use sim_solver::{PlacedCollider, Scene, Solver};

/// Run and step of a load.
#[derive(Debug, Clone)]
pub(super) struct LoadPlace {
    pub(super) run_id: u64,
    /// First step that shows the load.
    pub(super) step: u64,
    pub(super) topology_revision: u32,
    pub(super) parameters: ParameterValues,
}

/// Memory of a node that runs, beside what is checked: its threads, their stacks, and what commands allocate.
const RUNNING_BYTES: u64 = 16 << 20;

/// The messages of a load, which follow from its scene.
#[derive(Debug)]
pub(in crate::node) struct LoadMessages {
    /// Without its place.
    header: LoadHeader,
    text: String,
    constraints: Vec<ConstraintState>,
    bends: Vec<BendState>,
    triangles: Vec<Triangle>,
    collider_count: usize,
    keyframe_size_bytes_max: usize,
}

impl LoadMessages {
    pub(in crate::node) fn new(scene: &Scene, solver: &Solver) -> Self {
        let text = scene.to_toml();
        Self {
            header: LoadHeader {
                scene_hash: scene_hash(text.as_bytes()),
                origin: scene.origin,
                particle_count: count(solver.particle_count()),
                rate_hz: scene.solver.rate_hz,
                method: scene.solver.method as u32,
                ..LoadHeader::default()
            },
            text,
            constraints: solver.constraints().map(to_constraint_state).collect(),
            bends: solver.bends().map(to_bend_state).collect(),
            triangles: solver.triangles().iter().map(|&corners| Triangle { corners }).collect(),
            collider_count: solver.collider_count(),
            keyframe_size_bytes_max: solver.keyframe_size_bytes_max(),
        }
    }

    /// Checks that the process can get the memory of the messages, and of a node that runs.
    ///
    /// # Errors
    /// It cannot. An allocation that fails would abort it.
    pub(in crate::node) fn check_memory(&self) -> Result<(), NotEnoughMemory> {
        let torn_bytes = size_of_val(&*self.constraints) as u64;
        check_memory(self.sizes().shared_memory_bytes() + torn_bytes + RUNNING_BYTES)
    }

    /// Identifies the scene.
    pub(super) fn scene_hash(&self) -> u64 {
        self.header.scene_hash
    }

    /// Returns the load at its place.
    pub(super) fn at(&self, place: LoadPlace) -> Load<'_> {
        let LoadPlace { run_id, step, topology_revision, parameters } = place;
        Load {
            header: LoadHeader { run_id, step, topology_revision, ..self.header },
            scene: self.text.as_bytes(),
            constraints: &self.constraints,
            bends: &self.bends,
            triangles: &self.triangles,
            collider_count: self.collider_count,
            keyframe_size_bytes_max: self.keyframe_size_bytes_max,
            parameters,
        }
    }

    /// Returns a load with the sizes of the messages, at no place.
    pub(in crate::node) fn sizes(&self) -> Load<'_> {
        let parameters = ParameterValues::DEFAULT;
        self.at(LoadPlace { run_id: 0, step: 0, topology_revision: 0, parameters })
    }
}

/// Returns the free shared memory that a node needs to run a scene, in bytes.
pub(crate) fn shared_memory_bytes(scene: &Scene, solver: &Solver) -> u64 {
    LoadMessages::new(scene, solver).sizes().shared_memory_bytes()
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

fn to_bend_state(bend: sim_solver::Bend) -> BendState {
    BendState {
        particles: bend.particles,
        coefficients: bend.coefficients,
        geometry: bend.geometry,
        rigidity: bend.rigidity,
        rest: bend.shape.rest(),
        shape: bend.shape.number(),
        block: bend.block.and_then(|block| i32::try_from(block).ok()).unwrap_or(-1),
    }
}

/// Converts a collider to its published form.
pub(super) fn to_collider_state(collider: &PlacedCollider) -> ColliderState {
    let PlacedCollider { shape, restitution, friction, velocity, angular_velocity } = *collider;
    ColliderState { restitution, friction, velocity, angular_velocity, ..shape.fields().into() }
}

#[allow(clippy::cast_possible_truncation, reason = "a scene has at most 2^24 of anything")]
pub(super) fn count(length: usize) -> u32 {
    length as u32
}
