//! The state hash of a recorded snapshot.

use sim_contract::ParticleState;
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// Returns the XXH3-64 of the particles, as the solver computes it.
///
/// `torn` holds all torn constraints of this state, in any order. The seed is 0 while it is empty.
/// Otherwise the seed is the XXH3-64 of the indices, ascending, as little-endian u32.
pub fn state_hash(particles: &[ParticleState], torn: &[u32]) -> u64 {
    hash_bytes(bytemuck::cast_slice(particles), hash_seed(torn.to_vec()))
}

/// Returns the seed of the hash for these torn constraints.
pub(in crate::log) fn hash_seed(mut torn: Vec<u32>) -> u64 {
    torn.sort_unstable();
    let bytes: Vec<u8> = torn.iter().flat_map(|index| index.to_le_bytes()).collect();
    if bytes.is_empty() { 0 } else { xxh3_64(&bytes) }
}

/// Returns the hash of the bytes of particles.
pub(in crate::log) fn hash_bytes(particles: &[u8], seed: u64) -> u64 {
    xxh3_64_with_seed(particles, seed)
}

#[cfg(test)]
mod tests {
    use sim_solver::{Scene, Solver};

    use super::*;

    #[test]
    fn the_hash_equals_the_solvers_hash_with_and_without_torn_constraints() {
        let text = "generate = [{ shape = 'cloth', columns = 4, rows = 4, spacing = 0.1 }]";
        let scene = Scene::from_toml(&format!("version = 1\n{text}"), "scene.toml").unwrap();
        let mut solver = Solver::new(&scene);
        let hash =
            |solver: &Solver| state_hash(bytemuck::cast_slice(solver.particles()), solver.torn());
        solver.step();
        assert_eq!(hash(&solver), solver.state_hash());
        for constraint in [7, 3] {
            solver.cut(constraint).unwrap();
        }
        solver.step();
        assert_eq!((solver.torn().len(), hash(&solver)), (2, solver.state_hash()));
    }
}
