//! Rows of `/steps`, `/colliders`, `/tears` and `/forces`, from the state of a solver.

use crate::log::{AnchorForceRow, ColliderForceRow, CollidersRow, ForcesRow, StepRow, TearsRow};
use sim_contract::{ColliderState, PlainF32};
use sim_solver::{PlacedCollider, Solver};

use super::job::count;

/// Returns the row of `step`, of a recording of every step, without the number of outcomes.
pub fn step_row(solver: &Solver, step: u64) -> StepRow {
    StepRow {
        step,
        scene_step: solver.scene_step(),
        state_hash: solver.state_hash(),
        torn_count: count(solver.torn().len()),
        snapshot_index: low_32_bits(step),
        ..StepRow::default()
    }
}

#[allow(clippy::cast_possible_truncation, reason = "the low half is wanted")]
fn low_32_bits(step: u64) -> u32 {
    step as u32
}

/// Returns the colliders after `step`.
pub fn colliders_row(solver: &Solver, step: u64) -> CollidersRow {
    let states: Vec<_> = solver.colliders().map(|collider| state(&collider)).collect();
    // Every shape of this solver has a row.
    CollidersRow::new(step, &states).unwrap_or(CollidersRow { step, colliders: Vec::new() })
}

/// Returns the tears of the last step, which is `step`, or `None` if there are none. All tears of a state
/// that a command put in place count as those of its step.
pub(crate) fn new_tears_row(solver: &Solver, step: u64, is_in_place: bool) -> Option<TearsRow> {
    let count = if is_in_place { solver.torn().len() } else { solver.new_torn_count() };
    (count > 0).then(|| newest_tears_row(solver, step, count))
}

/// Returns the newest `count` torn constraints, or all if there are fewer.
pub(crate) fn newest_tears_row(solver: &Solver, step: u64, count: usize) -> TearsRow {
    let first = solver.torn().len().saturating_sub(count);
    let causes = solver.tear_causes()[first..].iter();
    TearsRow {
        step,
        constraints: solver.torn()[first..].to_vec(),
        causes: causes.map(|cause| cause.name().to_owned()).collect(),
    }
}

/// Returns a collider as a node publishes it.
fn state(collider: &PlacedCollider) -> ColliderState {
    let PlacedCollider { shape, restitution, friction, velocity, angular_velocity } = *collider;
    ColliderState { restitution, friction, velocity, angular_velocity, ..shape.fields().into() }
}

/// Returns the forces of the last step, which is `step`, if the solver computes them.
pub fn forces_row(solver: &Solver, step: u64) -> Option<ForcesRow> {
    let forces = solver.forces()?;
    let plain = |vector: [f32; 3]| vector.map(PlainF32);
    let colliders = forces.colliders.iter().map(|one| ColliderForceRow {
        impulse: plain(one.impulse.linear),
        angular_impulse: plain(one.impulse.angular),
        contacts: one.contacts,
    });
    let anchors = forces.anchors.iter().map(|one| AnchorForceRow {
        impulse: plain(one.linear),
        angular_impulse: plain(one.angular),
    });
    Some(ForcesRow {
        step,
        colliders: colliders.collect(),
        anchors: anchors.collect(),
        particles: forces.particles.iter().map(|one| one.particle).collect(),
        impulses: forces.particles.iter().map(|one| plain(one.impulse)).collect(),
    })
}
