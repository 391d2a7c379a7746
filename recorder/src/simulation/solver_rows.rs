//! Rows of `/colliders` and `/tears`, from the state of a solver.

use crate::log::{CollidersRow, TearsRow};
use sim_contract::ColliderState;
use sim_solver::{PlacedCollider, Solver};

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
