//! The state hash: XXH3-64 over the particles as they are published.

use xxhash_rust::xxh3::Xxh3;

use crate::particles::{Particle, Particles};

/// Particles packed at a time on the stack (4 KiB) for the hash to read.
const CHUNK: usize = 128;

/// XXH3-64 over 32 bytes a particle. The seed is 0 while nothing is torn, else the XXH3-64 of the
/// torn indices, ascending, as little-endian u32.
pub(crate) fn state_hash(particles: &Particles, seed: u64) -> u64 {
    let mut hasher = Xxh3::with_seed(seed);
    let mut chunk = [Particle::default(); CHUNK];
    let mut index = 0;
    while index < particles.count() {
        let length = CHUNK.min(particles.count() - index);
        for (offset, particle) in chunk[..length].iter_mut().enumerate() {
            *particle = particles.get(index + offset);
        }
        hasher.update(bytemuck::cast_slice(&chunk[..length]));
        index += length;
    }
    hasher.digest()
}
