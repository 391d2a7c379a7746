//! Memory for many states and what belongs to them, of any length.

use std::collections::TryReserveError;

use bytemuck::Zeroable;

use crate::kernels::huge_pages::refill;
use crate::kernels::stream::copy_past_caches;
use crate::state::particles::Particle;

/// A fixed memory in blocks of one size. A state takes as many as it needs.
///
/// Every page of the memory is written at the start, so that storing a state neither allocates nor waits for a page.
/// The copy bypasses the caches, which keep the data of the next step.
#[derive(Debug, Default)]
pub struct Blocks {
    particles: Vec<Particle>,
    /// Particles of a block.
    length: usize,
    /// By block: the next block of its chain.
    next: Vec<u32>,
    /// First block of the chain of free blocks.
    first_free: u32,
    free_count: usize,
}

/// The blocks of a state, or of some bytes.
#[derive(Debug, PartialEq, Eq)]
pub struct Chain {
    first: u32,
    /// Length of the content, in particles.
    length: usize,
}

/// Fewest particles of a block.
const LENGTH_MIN: usize = 8;
/// Most particles of a block.
const LENGTH_MAX: usize = 2048;
/// Blocks of a large state. At the end of the last one, little memory is lost then.
const BLOCKS_PER_STATE: usize = 32;

impl Blocks {
    /// Allocates `size_bytes` of memory. It has no blocks before [`Self::divide`].
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn new(size_bytes: usize) -> Result<Self, TryReserveError> {
        // With the links of the smallest blocks.
        let block_size_bytes = LENGTH_MIN * size_of::<Particle>() + size_of::<u32>();
        let block_count = (size_bytes / block_size_bytes).min(u32::MAX as usize);
        let (mut particles, mut next) = (Vec::new(), Vec::new());
        particles.try_reserve_exact(block_count * LENGTH_MIN)?;
        next.try_reserve_exact(block_count)?;
        refill(&mut particles, block_count * LENGTH_MIN, Particle::default());
        refill(&mut next, block_count, 0);
        Ok(Self { particles, next, ..Self::default() })
    }

    /// Divides the memory into blocks that suit states of `particle_count` particles, all of them free.
    #[allow(clippy::cast_possible_truncation, reason = "a new memory has fewer than 2^32 blocks")]
    pub fn divide(&mut self, particle_count: usize) {
        self.length = (particle_count / BLOCKS_PER_STATE).clamp(LENGTH_MIN, LENGTH_MAX);
        self.free_count = self.particles.len() / self.length;
        self.next.clear();
        self.next.extend(1..=self.free_count as u32);
        self.first_free = 0;
    }

    /// Number of blocks that hold `particle_count` particles.
    pub fn count_for(&self, particle_count: usize) -> usize {
        particle_count.div_ceil(self.length)
    }

    /// Number of blocks that hold `size_bytes` bytes.
    pub fn count_for_bytes(&self, size_bytes: usize) -> usize {
        self.count_for(size_bytes.div_ceil(size_of::<Particle>()))
    }

    /// Returns the size of all of the memory, in bytes.
    pub fn size_bytes(&self) -> usize {
        size_of_val(self.particles.as_slice()) + self.next.capacity() * size_of::<u32>()
    }

    /// Number of free blocks.
    pub fn free_count(&self) -> usize {
        self.free_count
    }

    /// Copies a state into free blocks; `None` if there are too few.
    pub fn store(&mut self, particles: &[Particle]) -> Option<Chain> {
        let first = self.first_free;
        self.free_count = self.free_count.checked_sub(self.count_for(particles.len()))?;
        for part in particles.chunks(self.length) {
            let block = self.first_free as usize;
            copy_past_caches(&mut self.particles[block * self.length..][..part.len()], part);
            self.first_free = self.next[block];
        }
        Some(Chain { first, length: particles.len() })
    }

    /// Copies bytes into free blocks; `None` if there are too few.
    pub fn store_bytes(&mut self, bytes: &[u8]) -> Option<Chain> {
        let mut padded = vec![Particle::zeroed(); bytes.len().div_ceil(size_of::<Particle>())];
        bytemuck::cast_slice_mut(&mut padded)[..bytes.len()].copy_from_slice(bytes);
        self.store(&padded)
    }

    /// Returns a copy of a state.
    pub fn read(&self, chain: &Chain) -> Vec<Particle> {
        let mut particles = Vec::with_capacity(chain.length);
        let mut block = chain.first as usize;
        while particles.len() < chain.length {
            let count = self.length.min(chain.length - particles.len());
            particles.extend_from_slice(&self.particles[block * self.length..][..count]);
            block = self.next[block] as usize;
        }
        particles
    }

    /// Returns a copy of `size_bytes` bytes.
    pub fn read_bytes(&self, chain: &Chain, size_bytes: usize) -> Vec<u8> {
        bytemuck::cast_slice(&self.read(chain))[..size_bytes].to_vec()
    }

    /// Makes the blocks of a state free.
    #[allow(clippy::needless_pass_by_value, reason = "nobody reads a released chain")]
    pub fn release(&mut self, chain: Chain) {
        let count = self.count_for(chain.length);
        let Some(more) = count.checked_sub(1) else { return };
        let last = (0..more).fold(chain.first, |block, _| self.next[block as usize]);
        self.next[last as usize] = self.first_free;
        self.first_free = chain.first;
        self.free_count += count;
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
    fn states_and_bytes_are_found_until_they_are_released() {
        let mut blocks = Blocks::new(260 * 40).unwrap();
        for count in [0, 7, 33, 300] {
            blocks.divide(count);
            let all = blocks.free_count();
            assert_eq!(all, 320 / blocks.length);
            let bytes: Vec<u8> = (0..=99).collect();
            let text = blocks.store_bytes(&bytes).unwrap();
            let stored: Vec<_> = (0..7_u8)
                .map_while(|number| {
                    let number = f32::from(number);
                    Some((number, blocks.store(&state(number, count))?))
                })
                .collect();
            let used = blocks.count_for_bytes(100) + stored.len() * blocks.count_for(count);
            assert_eq!(blocks.free_count(), all - used);
            // Others take the place of every second one.
            let (mut kept, mut others) = (Vec::new(), Vec::new());
            for (number, chain) in stored {
                if number % 2.0 == 0.0 {
                    kept.push((number, chain));
                } else {
                    blocks.release(chain);
                    others.push((-number, blocks.store(&state(-number, count)).unwrap()));
                }
            }
            kept.extend(others);
            for (number, chain) in &kept {
                assert_eq!(blocks.read(chain), state(*number, count), "{count}");
            }
            assert_eq!(blocks.read_bytes(&text, 100), bytes);
            for (_, chain) in kept {
                blocks.release(chain);
            }
            blocks.release(text);
            assert_eq!(blocks.free_count(), all);
        }
    }

    #[test]
    fn a_state_that_does_not_fit_takes_no_block() {
        let mut blocks = Blocks::new(260 * 4).unwrap();
        blocks.divide(8);
        assert_eq!(blocks.store(&state(1.0, 33)), None);
        assert!(blocks.store(&state(1.0, 32)).is_some());
        assert_eq!(blocks.store(&state(1.0, 1)), None);
        assert_eq!(Blocks::new(0).unwrap().free_count(), 0);
    }

    #[test]
    fn more_memory_than_there_is_is_an_error() {
        assert!(Blocks::new(usize::MAX / 2).is_err());
    }
}
