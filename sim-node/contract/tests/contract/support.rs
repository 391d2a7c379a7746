//! A small scene, and an owner that publishes it step by step like a node.

use std::time::Duration;

use sim_contract::{
    BendState, CONTRACT_VERSION, ColliderShape, ColliderState, CollidersHeader, ConstraintState,
    Endpoint, KeyframeHeader, Load, LoadHeader, NodeStatus, Outcome, Owner, OwnerError, Parameter,
    ParameterValues, ParticleState, Reason, ReceivedCommand, SnapshotHeader, TearCause,
    TearsHeader, TornConstraint, Triangle, Wake,
};

/// Longer than any operation here takes. Tests wait for events, not for this deadline.
pub(crate) const DEADLINE: Duration = Duration::from_secs(10);
/// Long enough to read a message that has arrived, and short if none will arrive.
pub(crate) const MOMENT: Duration = Duration::from_millis(20);

pub(crate) const RUN_ID: u64 = 77;
pub(crate) const PARTICLE_COUNT: u32 = 4;
pub(crate) const COLLIDER_COUNT: usize = 2;
pub(crate) const SCENE: &str = "version = 1 # gemütlich";

pub(crate) fn load_header() -> LoadHeader {
    LoadHeader {
        run_id: RUN_ID,
        particle_count: PARTICLE_COUNT,
        rate_hz: 240,
        topology_revision: 1,
        ..LoadHeader::default()
    }
}

pub(crate) fn constraints() -> Vec<ConstraintState> {
    let constraint =
        |a: u32| ConstraintState { a, b: a + 1, rest_length: 0.1, ..Default::default() };
    (0..PARTICLE_COUNT - 1).map(constraint).collect()
}

pub(crate) fn bends() -> Vec<BendState> {
    let line = BendState {
        particles: [0, 1, 2, 1],
        coefficients: [1.0, -2.0, 1.0, 0.0],
        geometry: 1e-3,
        rigidity: 0.02,
        block: -1,
        ..BendState::default()
    };
    vec![line, BendState { particles: [1, 2, 3, 2], block: 0, ..line }]
}

pub(crate) fn triangles() -> Vec<Triangle> {
    vec![Triangle { corners: [0, 1, 2] }, Triangle { corners: [1, 2, 3] }]
}

pub(crate) fn create_owner(endpoint: &Endpoint) -> Result<Owner, OwnerError> {
    let load = Load {
        header: load_header(),
        scene: SCENE.as_bytes(),
        constraints: &constraints(),
        bends: &bends(),
        triangles: &triangles(),
        collider_count: COLLIDER_COUNT,
        keyframe_size_bytes_max: 16,
        parameters: parameters(0),
    };
    Owner::create(endpoint, &load)
}

/// Returns the parameters from `step` on.
pub(crate) fn parameters(step: u64) -> ParameterValues {
    ParameterValues::default().with(Parameter::Damping, step as f32)
}

pub(crate) fn snapshot_header(step: u64) -> SnapshotHeader {
    SnapshotHeader {
        contract_version: CONTRACT_VERSION,
        run_id: RUN_ID,
        step,
        topology_revision: 1,
        particle_count: PARTICLE_COUNT,
        ..SnapshotHeader::default()
    }
}

/// Returns particle `index` of the state after `step`.
#[allow(clippy::cast_possible_truncation, reason = "steps and indices of tests are small")]
pub(crate) fn particle(step: u64, index: usize) -> ParticleState {
    ParticleState { position: [step as f32, index as f32, 0.5], ..ParticleState::default() }
}

pub(crate) fn publish_step(owner: &Owner, step: u64) {
    publish_snapshot(owner, &snapshot_header(step));
}

fn publish_snapshot(owner: &Owner, header: &SnapshotHeader) {
    owner.publish_particles(header, |index| particle(header.step, index)).unwrap();
    owner.wake(Wake::Frame);
    owner.refresh();
}

/// Returns the colliders at the end of `step`: a sphere that rises with the steps, and a plane.
pub(crate) fn colliders(step: u64) -> [ColliderState; COLLIDER_COUNT] {
    let sphere = ColliderState {
        shape: ColliderShape::Sphere as u32,
        radius: 0.5,
        center: particle(0, 0).position.map(|axis| axis + step as f32),
        ..ColliderState::default()
    };
    let plane = ColliderState { normal: [0.0, 1.0, 0.0], ..ColliderState::default() };
    [sphere, plane]
}

pub(crate) fn publish_colliders(owner: &Owner, step: u64) {
    let header = CollidersHeader { run_id: RUN_ID, step, ..CollidersHeader::default() };
    owner.publish_colliders(header, &colliders(step)).unwrap();
}

/// Publishes a message on every service that changes with the steps, the particles last.
pub(crate) fn publish_everything(owner: &Owner, step: u64) {
    let tears = TearsHeader { run_id: RUN_ID, step, new_count: 1, ..TearsHeader::default() };
    owner.publish_tears(tears, &[TornConstraint::new(2, Some(TearCause::Cut))]).unwrap();
    owner.publish_parameters(RUN_ID, step, &parameters(step)).unwrap();
    publish_colliders(owner, step);
    let keyframe = KeyframeHeader { run_id: RUN_ID, step, ..KeyframeHeader::default() };
    owner.publish_keyframe(keyframe, b"keyframe").unwrap();
    owner.publish_status(&NodeStatus { step, ..NodeStatus::default() }).unwrap();
    publish_snapshot(owner, &SnapshotHeader { torn_count: 1, ..snapshot_header(step) });
}

/// Answers the received commands: applies `pin` at `step`, and rejects all others.
pub(crate) fn answer_commands(owner: &Owner, step: u64, outcome_count: &mut u64) {
    let mut commands = Vec::new();
    owner.receive_commands(&mut commands);
    for ReceivedCommand { command, .. } in commands {
        let result = match command.action() {
            sim_contract::Action::Pin { .. } => Ok(()),
            _ => Err(Reason::NotGrabbed),
        };
        owner.publish_outcome(&Outcome::new(*outcome_count, step, command, result)).unwrap();
        *outcome_count += 1;
        owner.wake(Wake::Outcome);
    }
    owner.refresh();
}
