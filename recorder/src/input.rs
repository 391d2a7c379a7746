//! Input of the subcommands: scenes and commands.

pub(crate) mod command_source;
pub(crate) mod scene_source;
