//! The state hash: XXH3-64 of the published particles.

use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::state::particles::Particle;

/// Returns the XXH3-64 of 32 bytes per particle. The seed is 0 if nothing is torn, else the XXH3-64 of
/// the torn indices in ascending order, as little-endian u32.
pub(crate) fn state_hash(states: &[Particle], seed: u64) -> u64 {
    xxh3_64_with_seed(bytemuck::cast_slice(states), seed)
}
