//! The state hash: XXH3-64 over the particles as they are published.

use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::particles::Particle;

/// XXH3-64 over 32 bytes a particle. The seed is 0 while nothing is torn, else the XXH3-64 of the
/// torn indices, ascending, as little-endian u32.
pub(crate) fn state_hash(states: &[Particle], seed: u64) -> u64 {
    xxh3_64_with_seed(bytemuck::cast_slice(states), seed)
}
