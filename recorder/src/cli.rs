//! Options, output and exit codes that several subcommands share.

pub(crate) mod damaged_input;
pub(crate) mod endpoint_args;
pub(crate) mod exit;
pub(crate) mod file_args;
pub(crate) mod output;
pub(crate) mod parse;
pub(crate) mod progress;
pub(crate) mod thread_args;
