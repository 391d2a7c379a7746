//! Options, output and exit codes that several subcommands share.

pub(crate) mod args;
pub(crate) mod damaged_input;
pub(crate) mod output;
pub(crate) mod parse;
