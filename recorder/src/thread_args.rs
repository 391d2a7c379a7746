//! With how many threads a command simulates.

/// The option of the commands that step a solver.
#[derive(Debug, clap::Args)]
pub(crate) struct ThreadArgs {
    /// Threads that step the solver, 1 to 64; they change no bit, and make big scenes faster
    #[arg(long = "threads", value_name = "N", default_value_t = 1, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u8).range(1..=i64::from(sim_solver::THREADS_MAX)))]
    thread_count: u8,
}

impl ThreadArgs {
    pub(crate) fn count(&self) -> usize {
        usize::from(self.thread_count)
    }
}
