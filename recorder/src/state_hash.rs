//! The state hash of a snapshot, from what a recording holds of it.

use sim_contract::ParticleState;
use xxhash_rust::xxh3::{xxh3_64, xxh3_64_with_seed};

/// XXH3-64 over the particles, as the solver computes it. `torn`: all constraints that are torn in
/// this state, in any order; the seed is 0 while nothing is, else the XXH3-64 of their indices,
/// ascending, as little-endian u32.
pub fn state_hash(particles: &[ParticleState], torn: &[u32]) -> u64 {
    let mut ascending = torn.to_vec();
    ascending.sort_unstable();
    let bytes: Vec<u8> = ascending.iter().flat_map(|index| index.to_le_bytes()).collect();
    let seed = if bytes.is_empty() { 0 } else { xxh3_64(&bytes) };
    xxh3_64_with_seed(bytemuck::cast_slice(particles), seed)
}

#[cfg(test)]
mod tests {
    use sim_solver::{Scene, Solver};

    use super::*;

    #[test]
    fn it_is_that_of_the_solver_whole_and_torn() {
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
