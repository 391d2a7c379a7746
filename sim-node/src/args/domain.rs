//! Command lines of the subcommands that look at a whole domain.

use std::time::Duration;

use clap::Args as ClapArgs;

use super::endpoint::DomainArgs;
use super::value::time;

#[derive(Debug, ClapArgs)]
#[command(
    after_help = "A replay (`recorder play`) owns a name like a node. A node that does not answer is listed as \
    silent:\nit is stopped, or computes a long step. Killed nodes are not listed.\n\n\
    Examples:\n  \
    sim-node ps\n  \
    sim-node ps --domain lab\n  \
    sim-node ps --json    list them for a program: a JSON array, [] without nodes"
)]
pub(crate) struct PsArgs {
    /// Wait at most this long for the answers
    #[arg(long, value_name = "TIME", default_value = "1s", value_parser = time)]
    pub(crate) timeout: Duration,
    /// Print a JSON array with one object for each node; its fields are named as in `ctl status`
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) domain: DomainArgs,
}
