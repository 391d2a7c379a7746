//! The option for the number of solver threads.

use sim_solver::THREADS_MAX;

use super::parse::whole_number_in;

/// The option of the subcommands that step a solver.
#[derive(Debug, clap::Args)]
pub(crate) struct ThreadArgs {
    /// Number of solver threads, 1 to 64. More threads speed up large scenes and change no bit of
    /// the result
    #[arg(long, value_name = "N", default_value_t = 1, allow_hyphen_values = true,
        value_parser = thread_count)]
    threads: usize,
}

impl ThreadArgs {
    pub(crate) fn count(&self) -> usize {
        self.threads
    }
}

fn thread_count(text: &str) -> Result<usize, String> {
    let count = whole_number_in(text, &(1..=u64::from(THREADS_MAX)))?;
    usize::try_from(count).map_err(|error| error.to_string())
}
