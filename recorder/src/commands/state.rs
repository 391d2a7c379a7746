//! `recorder state`: records one step of a running node.

use crate::cli::output::Exit;
use crate::commands::record::{self, RecordArgs, SingleStateArgs};

#[derive(Debug, clap::Args)]
#[command(
    after_help = "A state is a recording of one step. `recorder restore` puts it in place again.\n\nExamples:\n  \
    recorder state -o state.mcap\n  \
    recorder restore state.mcap"
)]
pub(crate) struct StateArgs {
    #[command(flatten)]
    record: SingleStateArgs,
}

pub(crate) fn run(args: &StateArgs) -> anyhow::Result<Exit> {
    record::run(&RecordArgs::from(args.record.clone()))
}
