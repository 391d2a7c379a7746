//! How many threads step the solver. Their number changes no bit.

use std::num::NonZero;
use std::thread::available_parallelism;

use sim_solver::{Solver, THREADS_MAX};

/// Particles from which on more than one thread is the default: the solver divides nothing smaller.
const SHARED_MIN: usize = 4000;

/// Gives a solver that was just made its threads: as many as asked for, or the default of its scene.
/// They start here, so that no step has to.
pub(crate) fn with_threads(mut solver: Solver, asked: Option<u8>) -> Solver {
    let by_default = || {
        // Where the system does not say how many cores there are, one is there.
        let core_count = available_parallelism().map_or(1, NonZero::get);
        default_count(solver.particle_count(), core_count)
    };
    let count = asked.map_or_else(by_default, usize::from);
    solver.set_threads(count);
    solver
}

/// No more threads than free cores: one for a small scene, else the cores that this process may use
/// less one for everything else, at least one and at most [`THREADS_MAX`]. Threads wait for each
/// other several times a substep, so one that has to share its core delays all of them.
fn default_count(particle_count: usize, core_count: usize) -> usize {
    if particle_count < SHARED_MIN {
        return 1;
    }
    core_count.saturating_sub(1).clamp(1, usize::from(THREADS_MAX))
}

#[cfg(test)]
mod tests {
    //! The rule, and that both ways to a number reach the solver.
    use sim_solver::Scene;

    use super::*;

    #[test]
    fn a_small_scene_has_one_thread_and_a_big_one_all_cores_but_one() {
        for (particle_count, core_count, expected) in [
            (0, 16, 1),
            (3999, 16, 1),
            (4000, 1, 1),
            (4000, 2, 1),
            (4000, 3, 2),
            (1 << 24, 16, 15),
            (1 << 24, 65, 64),
            (1 << 24, 1024, 64),
        ] {
            let count = default_count(particle_count, core_count);
            assert_eq!(count, expected, "{particle_count} particles, {core_count} cores");
        }
    }

    #[test]
    fn a_solver_has_the_threads_that_were_asked_for_or_those_of_its_scene() {
        let empty = || Solver::new(&Scene::from_toml("version = 1", "empty").unwrap());
        assert_eq!(with_threads(empty(), Some(3)).threads(), 3);
        assert_eq!(with_threads(empty(), Some(1)).threads(), 1);
        assert_eq!(with_threads(empty(), None).threads(), 1);
    }
}
