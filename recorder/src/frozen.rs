//! The events of a recording: particles that were frozen between two of its snapshots.

use recorder::EventRow;
use sim_contract::{ParticleFlags, ParticleState};

/// Most events of a step: when everything blows up at once, the file stays readable.
const EVENTS_PER_STEP_MAX: usize = 1024;

/// Compares the frozen particles of each snapshot with those of the one before.
#[derive(Debug, Default)]
pub(crate) struct FrozenWatch {
    /// Frozen particles of the last snapshot, ascending; `None` before the first one.
    known: Option<Vec<u32>>,
}

impl FrozenWatch {
    /// The events of a snapshot. Those frozen in the first one were so before. After a reset
    /// nothing is frozen, and a particle can be frozen again.
    pub(crate) fn events(&mut self, step: u64, particles: &[ParticleState]) -> Vec<EventRow> {
        let is_frozen = |state: &ParticleState| state.flags & ParticleFlags::FROZEN != 0;
        // Hardly ever is there one: then nothing is allocated.
        let frozen: Vec<u32> = (0_u32..)
            .zip(particles)
            .filter(|(_, state)| is_frozen(state))
            .map(|(index, _)| index)
            .collect();
        let Some(known) = self.known.replace(frozen) else { return Vec::new() };
        let frozen = self.known.iter().flatten().copied();
        rows(step, &frozen.filter(|one| known.binary_search(one).is_err()).collect::<Vec<_>>())
    }
}

fn rows(step: u64, frozen: &[u32]) -> Vec<EventRow> {
    let row = |particle, text| EventRow { step, kind: "frozen".to_owned(), particle, text };
    // The last place is for the number of those that have none.
    let is_bounded = frozen.len() > EVENTS_PER_STEP_MAX;
    let told_count = if is_bounded { EVENTS_PER_STEP_MAX - 1 } else { frozen.len() };
    let (told, others) = frozen.split_at(told_count);
    let mut rows: Vec<_> = told
        .iter()
        .map(|index| {
            row(Some(*index), format!("particle {index} was no longer finite and is frozen"))
        })
        .collect();
    if is_bounded {
        rows.push(row(None, format!("{} more particles are frozen", others.len())));
    }
    rows
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
    fn only_what_is_newly_frozen_is_an_event() {
        let mut watch = FrozenWatch::default();
        let mut events = |frozen: &[usize]| particles(&watch.events(3, &snapshot(frozen, 5)));
        assert_eq!(events(&[2]), [], "it was so before the recording");
        assert_eq!(events(&[0, 2, 4]), [Some(0), Some(4)]);
        assert_eq!(events(&[0, 2, 4]), []);
        assert_eq!(events(&[]), [], "a reset");
        assert_eq!(events(&[2]), [Some(2)]);
    }

    #[test]
    fn a_step_has_a_bounded_number_of_events_and_the_last_one_counts_the_rest() {
        for (count, told) in [(EVENTS_PER_STEP_MAX, 1024), (EVENTS_PER_STEP_MAX + 1, 1023)] {
            let mut watch = FrozenWatch::default();
            watch.events(0, &snapshot(&[], count));
            let all: Vec<_> = (0..count).collect();
            let rows = watch.events(1, &snapshot(&all, count));
            assert_eq!(rows.len(), EVENTS_PER_STEP_MAX);
            assert_eq!(rows.iter().filter(|row| row.particle.is_some()).count(), told);
            if told == 1023 {
                assert_eq!(rows[told].text, "2 more particles are frozen");
            }
        }
    }
}
