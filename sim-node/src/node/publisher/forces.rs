//! Forces: computed and published only while a client reads them.

use sim_contract::{ForceKind, ForceRow, ForcesHeader, Owner, OwnerError};
use sim_host::clock::{SECOND_NS, monotonic_ns};
use sim_solver::{Forces, FrameImpulse, Solver};

use super::load::count;

/// Time between two checks that a reader is alive. A killed one counts until its place is freed.
const CHECK_PERIOD_NS: u64 = SECOND_NS;

/// Publishes forces.
#[derive(Debug, Default)]
pub(super) struct ForcesPublisher {
    reader_count: usize,
    /// At least one of the readers is alive, and there is memory for the forces.
    are_served: bool,
    /// CLOCK_MONOTONIC of the next check.
    next_check_ns: u64,
    /// Memory for the rows of a step.
    rows: Vec<ForceRow>,
}

impl ForcesPublisher {
    /// Lets the solver compute the forces from the next step on if a client reads them, and no longer if none
    /// does.
    pub(super) fn switch(&mut self, owner: &Owner, solver: &mut Solver) {
        let are_read = self.are_read(owner);
        if are_read != solver.forces().is_some() {
            solver.compute_forces(are_read);
            if !are_read {
                owner.end_forces();
            }
        }
    }

    fn are_read(&mut self, owner: &Owner) -> bool {
        let reader_count = owner.forces_reader_count();
        let has_changed = std::mem::replace(&mut self.reader_count, reader_count) != reader_count;
        if reader_count == 0 {
            return false;
        }
        let now_ns = monotonic_ns();
        if has_changed || now_ns >= self.next_check_ns {
            self.are_served = owner.has_living_forces_reader();
            self.next_check_ns = now_ns + CHECK_PERIOD_NS;
        }
        self.are_served
    }

    /// Publishes the forces of a step, if the solver has computed them. After an error, computes no more of them
    /// until the next check.
    pub(super) fn publish(
        &mut self,
        owner: &Owner,
        header: ForcesHeader,
        solver: &Solver,
    ) -> Result<(), OwnerError> {
        let Some(forces) = solver.forces() else { return Ok(()) };
        self.rows.clear();
        self.rows.extend(rows(forces));
        let published = owner.publish_forces(header, &self.rows);
        self.are_served &= published.is_ok();
        published
    }
}

/// The rows of a step, in the order of publication.
fn rows(forces: &Forces) -> impl Iterator<Item = ForceRow> {
    let colliders = forces.colliders.iter().enumerate().map(|(index, one)| ForceRow {
        contacts: one.contacts,
        ..row(ForceKind::Collider, count(index), &one.impulse)
    });
    let anchors = forces.anchors.iter().enumerate();
    let anchors = anchors.map(|(index, one)| row(ForceKind::Anchor, count(index), one));
    let particles = forces.particles.iter().map(|one| {
        let impulse = FrameImpulse { linear: one.impulse, ..FrameImpulse::default() };
        row(ForceKind::Particle, one.particle, &impulse)
    });
    colliders.chain(anchors).chain(particles)
}

fn row(kind: ForceKind, index: u32, impulse: &FrameImpulse) -> ForceRow {
    let FrameImpulse { linear, angular } = *impulse;
    ForceRow {
        kind: kind as u32,
        index,
        impulse: linear,
        angular_impulse: angular,
        ..ForceRow::default()
    }
}

#[cfg(test)]
mod tests {
    use sim_solver::{ColliderImpulse, ParticleImpulse};

    use super::*;

    #[test]
    fn rows_come_by_kind_and_index_with_the_impulses_of_the_solver() {
        let impulse = |x| FrameImpulse { linear: [x, 2.0, 3.0], angular: [4.0, 5.0, x] };
        let forces = Forces {
            colliders: vec![
                ColliderImpulse::default(),
                ColliderImpulse { impulse: impulse(1.0), contacts: 9 },
            ],
            anchors: vec![impulse(7.0)],
            particles: vec![ParticleImpulse { particle: 13, impulse: [0.5, 0.0, -0.5] }],
        };
        let expected = [
            (ForceKind::Collider, 0, [0.0; 3], [0.0; 3], 0),
            (ForceKind::Collider, 1, [1.0, 2.0, 3.0], [4.0, 5.0, 1.0], 9),
            (ForceKind::Anchor, 0, [7.0, 2.0, 3.0], [4.0, 5.0, 7.0], 0),
            (ForceKind::Particle, 13, [0.5, 0.0, -0.5], [0.0; 3], 0),
        ];
        let rows: Vec<_> = rows(&forces)
            .map(|row| {
                let kind = row.kind().unwrap();
                (kind, row.index, row.impulse, row.angular_impulse, row.contacts)
            })
            .collect();
        assert_eq!(rows, expected);
    }
}
