//! The option for the number of solver threads.

/// The option of the subcommands that step a solver.
#[derive(Debug, clap::Args)]
pub(crate) struct ThreadArgs {
    /// Number of solver threads, 1 to 64. It speeds up large scenes and does not change any bit of
    /// the result
    #[arg(long = "threads", value_name = "N", default_value_t = 1, allow_negative_numbers = true,
        value_parser = clap::value_parser!(u8).range(1..=i64::from(sim_solver::THREADS_MAX)))]
    thread_count: u8,
}

impl ThreadArgs {
    pub(crate) fn count(&self) -> usize {
        usize::from(self.thread_count)
    }
}
