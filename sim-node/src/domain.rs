//! Subcommands that look at a whole domain instead of one node.

pub(crate) mod ps;
