//! The events of a snapshot, compared with its particles.

use crate::log::{EventRow, Frame, Message};

use crate::simulation::frozen::{FrozenParticles, FrozenTracker, frozen_event};

/// Compares the events of each snapshot with the particles that froze since the last one. Those of members of
/// the lockstep are not compared.
#[derive(Debug, Default)]
pub(super) struct EventCheck {
    frozen: FrozenTracker,
    last_step: Option<u64>,
}

impl EventCheck {
    /// Returns `true` before the first snapshot.
    pub(super) fn is_new(&self) -> bool {
        self.frozen.is_new()
    }

    /// Passes a snapshot before the first one to check.
    pub(super) fn skip(&mut self, step: u64, frozen: FrozenParticles) {
        self.frozen.new_events(step, frozen);
        self.last_step = Some(step);
    }

    /// Checks the events before a snapshot. `is_after_gap` if snapshots may be missing before it: a
    /// recorder then compared its particles with those of a snapshot that is not in the file.
    pub(super) fn check(
        &mut self,
        frame: &Frame,
        frozen: FrozenParticles,
        is_after_gap: bool,
    ) -> Option<String> {
        let Frame { row, updates, .. } = frame;
        let expected = self.frozen.new_events(row.step, frozen);
        let last_step = self.last_step.replace(row.step);
        let events: Vec<_> = updates.iter().filter_map(event).collect();
        let is_same = match (last_step, self.frozen.known()) {
            (Some(last), Some(frozen)) if is_after_gap => {
                is_ascending(&events)
                    && events.iter().all(|event| {
                        (last + 1..=row.step).contains(&event.step) && is_valid(event, frozen)
                    })
                    && events
                        .iter()
                        .filter(|event| event.step == row.step)
                        .all(|event| event.particle.is_none_or(|index| frozen.contains(index)))
                    && has_all(&events, &expected)
            }
            _ => events.iter().copied().eq(&expected),
        };
        (!is_same).then(|| "its events in /events are not those of its particles".to_owned())
    }
}

fn event(update: &Message) -> Option<&EventRow> {
    match update {
        // Only the node knows the members.
        Message::Event(row) if !row.is_of_member() => Some(row),
        _ => None,
    }
}

/// Returns `true` if no event is repeated, and each is in its place. An event without a particle is the
/// last one of its step.
fn is_ascending(events: &[&EventRow]) -> bool {
    let place = |event: &EventRow| (event.step, event.particle.unwrap_or(u32::MAX));
    events.windows(2).all(|pair| place(pair[0]) < place(pair[1]))
}

/// Returns `true` if an event has the form that a recorder writes.
fn is_valid(event: &EventRow, frozen: &FrozenParticles) -> bool {
    match event.particle {
        Some(index) => {
            (index as usize) < frozen.particle_count && *event == frozen_event(event.step, index)
        }
        None => event.kind == "frozen" && event.text.ends_with(" more particles are frozen"),
    }
}

/// Returns `true` if each expected event is in the file, at its step or at an earlier one.
fn has_all(events: &[&EventRow], expected: &[EventRow]) -> bool {
    let is_limited = events.iter().any(|event| event.particle.is_none());
    is_limited
        || expected.iter().all(|one| events.iter().any(|event| event.particle == one.particle))
}
