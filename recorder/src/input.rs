//! Input of the subcommands: scenes and command files.

pub(crate) mod command_file;
pub(crate) mod scene_source;
