//! The threads of a node: the loop, a thread that wakes readers, and the threads of the solver, whose number
//! changes no bit.

use sim_solver::{Solver, THREADS_MAX};

use super::Node;
use super::pace::Rest;
use super::real_time::Cpus;
use super::real_time::{Prepared, prepare};

/// Number of particles from which on the default is more than one thread. In smaller scenes, the solver divides only
/// the contacts.
const SHARED_MIN: usize = 4000;

impl Node {
    /// Obtains the real-time properties of the options and starts the threads. Call it on the thread of the
    /// loop, after everything that takes long. Returns lines for people.
    ///
    /// # Errors
    /// The system refuses a property that the options require, or a thread.
    pub(crate) fn prepare(&mut self) -> anyhow::Result<Vec<String>> {
        let Prepared { real_time, lines } = prepare(self.options.real_time, &mut self.cpus)?;
        self.real_time = real_time;
        self.rest = real_time.fifo_priority.map(|_| Rest::default());
        // They inherit the scheduling of this thread.
        start_threads(&mut self.solver, self.options.threads, &self.cpus);
        self.cpus.lend(|| self.publisher.start_wake_thread())?;
        Ok(lines)
    }
}

/// Starts the threads of a new solver: the requested number, or the default of its scene. No step
/// starts a thread. The thread of the loop calls it, because they inherit its scheduling.
pub(super) fn start_threads(solver: &mut Solver, requested: Option<u8>, cpus: &Cpus) {
    let by_default = || default_count(solver.particle_count(), cpus.core_count);
    let count = requested.map_or_else(by_default, usize::from);
    cpus.lend(|| solver.set_threads(count));
}

/// Default number of threads: 1 for a small scene, else one less than the number of cores available
/// to this process, at least 1 and at most [`THREADS_MAX`]. Threads wait for each other several times per
/// substep, so a thread that shares its core delays all of them.
fn default_count(particle_count: usize, core_count: usize) -> usize {
    if particle_count < SHARED_MIN {
        return 1;
    }
    core_count.saturating_sub(1).clamp(1, usize::from(THREADS_MAX))
}

#[cfg(test)]
mod tests {
    //! Checks the rule, and that requested and default numbers reach the solver.
    use sim_solver::Scene;

    use super::*;

    #[test]
    fn a_small_scene_has_one_thread_and_a_large_one_all_cores_but_one() {
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
    fn a_solver_has_the_requested_threads_or_the_default_of_its_scene() {
        let cpus = Cpus::observe();
        for (requested, expected) in [(Some(3), 3), (Some(1), 1), (None, 1)] {
            let mut solver = Solver::new(&Scene::from_toml("version = 1", "empty").unwrap());
            start_threads(&mut solver, requested, &cpus);
            assert_eq!(solver.threads(), expected);
        }
    }
}
