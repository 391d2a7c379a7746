//! Memory for the particles of many states.

use std::collections::TryReserveError;
use std::ops::Range;

use crate::kernels::huge_pages::refill;
use crate::kernels::stream::copy_past_caches;
use crate::state::particles::Particle;

/// Slots for states of the same number of particles.
///
/// All of the memory is in use from the start, so that a copy neither allocates nor waits for a page. It
/// goes past the caches, which then keep what the next step needs.
#[derive(Debug, Default)]
pub struct Slots {
    particles: Vec<Particle>,
    /// Particles of a slot.
    particle_count: usize,
    /// Slots that have held no state yet. They are taken before the released ones.
    unused: Range<usize>,
    /// The last one is taken first.
    released: Vec<Slot>,
}

/// A slot that holds a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Slot(usize);

impl Slots {
    /// Allocates `size_bytes` of memory. It has no slots before [`Self::divide`].
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn new(size_bytes: usize) -> Result<Self, TryReserveError> {
        let count = size_bytes / size_of::<Particle>();
        let mut particles = Vec::new();
        particles.try_reserve_exact(count)?;
        refill(&mut particles, count, Particle::default());
        Ok(Self { particles, ..Self::default() })
    }

    /// Divides the memory into slots of `particle_count` particles, at most `count_max`, all of them
    /// free.
    pub fn divide(&mut self, particle_count: usize, count_max: usize) {
        let fitting = self.particles.len().checked_div(particle_count).unwrap_or(usize::MAX);
        self.particle_count = particle_count;
        self.unused = 0..count_max.min(fitting);
        self.released.clear();
        // A release then does not allocate.
        self.released.reserve(self.unused.len());
    }

    /// Copies a state into a free slot; None if there is none.
    ///
    /// # Panics
    /// If the state has another number of particles than the slots.
    pub fn store(&mut self, particles: &[Particle]) -> Option<Slot> {
        assert_eq!(particles.len(), self.particle_count, "the slots are for another scene");
        let slot = self.unused.next().map(Slot).or_else(|| self.released.pop())?;
        let first = slot.0 * self.particle_count;
        copy_past_caches(&mut self.particles[first..][..self.particle_count], particles);
        Some(slot)
    }

    /// Returns the state in a slot.
    pub fn particles(&self, slot: Slot) -> &[Particle] {
        &self.particles[slot.0 * self.particle_count..][..self.particle_count]
    }

    /// Makes a slot free.
    pub fn release(&mut self, slot: Slot) {
        self.released.push(slot);
    }
}

#[cfg(test)]
mod tests {
    //! States come back as they were stored.
    use super::*;

    fn state(number: f32, count: usize) -> Vec<Particle> {
        let particle = |index| Particle {
            position: [number, index as f32, -0.0],
            velocity: [0.5, f32::MIN_POSITIVE, number],
            ..Particle::default()
        };
        (0..count).map(particle).collect()
    }

    #[test]
    fn a_state_is_found_in_its_slot_until_that_is_released() {
        let mut slots = Slots::new(32 * 30).unwrap();
        for count in [7, 3, 30] {
            slots.divide(count, 4);
            let stored: Vec<_> = std::iter::successors(Some(1.0_f32), |number| Some(number + 1.0))
                .map_while(|number| Some((number, slots.store(&state(number, count))?)))
                .collect();
            assert_eq!(stored.len(), 4.min(30 / count));
            for (number, slot) in &stored {
                assert_eq!(slots.particles(*slot), state(*number, count));
            }
            slots.release(stored[0].1);
            let again = slots.store(&state(-1.0, count)).unwrap();
            assert_eq!((again, slots.particles(again)), (stored[0].1, &state(-1.0, count)[..]));
        }
    }

    #[test]
    fn a_scene_without_particles_has_as_many_slots_as_asked_for() {
        let mut slots = Slots::new(0).unwrap();
        slots.divide(0, 2);
        assert!(slots.store(&[]).is_some() && slots.store(&[]).is_some());
        assert!(slots.store(&[]).is_none());
    }

    #[test]
    fn more_memory_than_there_is_is_an_error() {
        assert!(Slots::new(usize::MAX / 2).is_err());
    }
}
