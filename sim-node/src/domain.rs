//! Subcommands that look at a whole domain instead of one node.

pub(crate) mod doctor;
pub(crate) mod ps;
