//! A recorded state, compared with the simulated one.

use sim_contract::ParticleState;
use sim_solver::Solver;

use super::difference::{Difference, first_difference};
use super::finding::SnapshotFinding;
use crate::log::{Frame, Message, TearTracker};

/// Returns `true` if the torn constraints of the first snapshot differ from its rows. Later snapshots
/// have no `/topology`. An unknown cause equals any cause.
pub(super) fn has_other_tears(frame: &Frame, solver: &Solver) -> bool {
    let torn = frame.updates.iter().find_map(|update| match update {
        Message::Topology(row) => Some(row.torn_before()),
        _ => None,
    });
    let Some(torn) = torn else { return false };
    let mut tracker = TearTracker::new(torn);
    frame.updates.iter().for_each(|update| tracker.process(update));
    let Some(torn) = tracker.at(frame.row.step) else { return false };
    let expected = solver.torn().iter().zip(solver.tear_causes());
    torn.constraints.len() != solver.torn().len()
        || torn.constraints.iter().zip(expected).any(|(found, (index, cause))| {
            found.constraint != *index || found.cause().is_some_and(|found| found != *cause)
        })
}

/// Compares the recorded header, the recorded payload and the simulated state.
pub(super) fn compare(solver: &Solver, frame: &Frame) -> SnapshotFinding {
    let row = &frame.row;
    let diverged =
        |what: String, difference| SnapshotFinding::Diverged { step: row.step, what, difference };
    let simulated_hash = solver.state_hash();
    if let Some(particles) = &frame.particles
        && let Some((what, difference)) = compare_particles(solver, particles)
    {
        return diverged(what, difference);
    }
    let counts = [
        ("scene_step", row.scene_step, solver.scene_step()),
        ("torn_count", u64::from(row.torn_count), solver.torn().len() as u64),
    ];
    let differs = |(_, recorded, simulated): &(_, u64, u64)| recorded != simulated;
    if let Some((name, recorded, simulated)) = counts.into_iter().find(differs) {
        return diverged(
            format!("/steps: {name}: recorded {recorded}, simulated {simulated}"),
            None,
        );
    }
    if row.state_hash != simulated_hash {
        let of =
            if frame.particles.is_some() { "its particles have" } else { "the simulation has" };
        let what = format!(
            "its row in /steps has the hash {:016x}, but {of} {simulated_hash:016x}",
            row.state_hash
        );
        return diverged(what, None);
    }
    SnapshotFinding::Identical
}

/// Describes the first difference of recorded particles from the simulated state.
fn compare_particles(
    solver: &Solver,
    recorded: &[ParticleState],
) -> Option<(String, Option<Difference>)> {
    let expected_count = solver.particle_count();
    if recorded.len() != expected_count {
        let count = recorded.len();
        let what = format!("/particles: recorded {count} particles, simulated {expected_count}");
        return Some((what, None));
    }
    let simulated = bytemuck::cast_slice(solver.particles());
    // One comparison of memory, because it runs for every step.
    if bytemuck::cast_slice::<_, u8>(recorded) == bytemuck::cast_slice::<_, u8>(simulated) {
        return None;
    }
    let difference = first_difference(recorded, simulated)?;
    Some((format!("/particles: {difference}"), Some(difference)))
}
