//! The events of a recording: the particles that froze between two snapshots.

use crate::log::EventRow;
use sim_contract::{ParticleFlags, ParticleState};

/// Most events of a step, so that a scene that diverges does not flood the file.
const EVENTS_PER_STEP_MAX: usize = 1024;

/// Particles whose flags are tested together, because frozen ones are rare: in half the time of one by one.
const TESTED_TOGETHER: usize = 64;

/// The frozen particles of a snapshot.
#[derive(Debug)]
pub struct FrozenParticles {
    /// Ascending.
    indices: Vec<u32>,
}

impl FrozenParticles {
    /// Finds the frozen particles.
    pub fn find(particles: &[ParticleState]) -> Self {
        let is_frozen = |flags: u32| flags & ParticleFlags::FROZEN != 0;
        let mut indices = Vec::new();
        for (first, some) in
            (0_u32..).step_by(TESTED_TOGETHER).zip(particles.chunks(TESTED_TOGETHER))
        {
            if is_frozen(some.iter().fold(0, |flags, state| flags | state.flags)) {
                let frozen = (first..).zip(some).filter(|(_, state)| is_frozen(state.flags));
                indices.extend(frozen.map(|(index, _)| index));
            }
        }
        Self { indices }
    }

    /// Returns `true` if this particle is frozen.
    fn contains(&self, index: u32) -> bool {
        self.indices.binary_search(&index).is_ok()
    }
}

/// Compares the frozen particles of each snapshot with those of the previous one.
#[derive(Debug, Default)]
pub struct FrozenTracker {
    /// Those of the last snapshot. `None` before the first snapshot.
    known: Option<FrozenParticles>,
}

impl FrozenTracker {
    /// Returns the events of a snapshot. The first snapshot has none, because its frozen particles
    /// froze earlier. After a reset a particle can freeze again.
    pub fn new_events(&mut self, step: u64, frozen: FrozenParticles) -> Vec<EventRow> {
        let newest = self.known.take();
        let known = self.known.insert(frozen);
        let Some(before) = newest else { return Vec::new() };
        let new = known.indices.iter().copied().filter(|index| !before.contains(*index));
        rows(step, &new.collect::<Vec<_>>())
    }
}

fn rows(step: u64, frozen: &[u32]) -> Vec<EventRow> {
    // Beyond the limit, the last event gives the number of particles without one.
    let is_over_limit = frozen.len() > EVENTS_PER_STEP_MAX;
    let named_count = if is_over_limit { EVENTS_PER_STEP_MAX - 1 } else { frozen.len() };
    let (named, others) = frozen.split_at(named_count);
    let mut rows: Vec<_> = named.iter().map(|index| frozen_event(step, *index)).collect();
    if is_over_limit {
        rows.push(row(step, None, format!("{} more particles are frozen", others.len())));
    }
    rows
}

/// Returns the event of one particle.
fn frozen_event(step: u64, particle: u32) -> EventRow {
    row(step, Some(particle), format!("particle {particle} was not finite and is frozen"))
}

fn row(step: u64, particle: Option<u32>, text: String) -> EventRow {
    EventRow { step, kind: "frozen".to_owned(), particle, client_id: None, text }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn snapshot(frozen: &[usize], count: usize) -> Vec<ParticleState> {
        let flags = |index| if frozen.contains(&index) { ParticleFlags::FROZEN } else { 1 };
        let state = |index| ParticleState { flags: flags(index), ..ParticleState::default() };
        (0..count).map(state).collect()
    }

    fn particles(rows: &[EventRow]) -> Vec<Option<u32>> {
        rows.iter().map(|row| row.particle).collect()
    }

    #[test]
    fn every_frozen_particle_is_found() {
        for frozen in [vec![], vec![0], vec![63, 64], vec![1, 2, 130], (0..200).collect()] {
            let found = FrozenParticles::find(&snapshot(&frozen, 200)).indices;
            assert!(found.iter().map(|index| *index as usize).eq(frozen), "{found:?}");
        }
    }

    #[test]
    fn only_newly_frozen_particles_are_events() {
        let mut tracker = FrozenTracker::default();
        let mut events = |frozen: &[usize]| {
            particles(&tracker.new_events(3, FrozenParticles::find(&snapshot(frozen, 5))))
        };
        assert_eq!(events(&[2]), [], "it froze before the recording");
        assert_eq!(events(&[0, 2, 4]), [Some(0), Some(4)]);
        assert_eq!(events(&[0, 2, 4]), []);
        assert_eq!(events(&[]), [], "a reset");
        assert_eq!(events(&[2]), [Some(2)]);
    }

    #[test]
    fn the_last_event_of_a_step_over_the_limit_counts_the_remaining_particles() {
        for (count, named) in [(EVENTS_PER_STEP_MAX, 1024), (EVENTS_PER_STEP_MAX + 1, 1023)] {
            let mut tracker = FrozenTracker::default();
            tracker.new_events(0, FrozenParticles::find(&snapshot(&[], count)));
            let all: Vec<_> = (0..count).collect();
            let rows = tracker.new_events(1, FrozenParticles::find(&snapshot(&all, count)));
            assert_eq!(rows.len(), EVENTS_PER_STEP_MAX);
            assert_eq!(rows.iter().filter(|row| row.particle.is_some()).count(), named);
            if named == 1023 {
                assert_eq!(rows[named].text, "2 more particles are frozen");
            }
        }
    }
}
