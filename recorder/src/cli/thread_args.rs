//! The option for the number of solver threads.

use std::num::NonZero;
use std::thread::available_parallelism;

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

/// The option of the subcommand that simulates the parts of a recording side by side.
#[derive(Debug, clap::Args)]
pub(crate) struct PartArgs {
    /// Number of threads that simulate parts of the recording side by side, 1 to 64. Default: the number of cores
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = thread_count)]
    threads: Option<usize>,
}

impl PartArgs {
    pub(crate) fn count(&self) -> usize {
        let cores = || available_parallelism().map_or(1, NonZero::get).min(THREADS_MAX as usize);
        self.threads.unwrap_or_else(cores)
    }
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
