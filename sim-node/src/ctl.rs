//! `ctl`: sends commands to a running node and prints its state.

mod action;
mod command;
mod explanation;
mod forces;
mod parameters;
mod particles;
pub(crate) mod status;
mod watch;

use anyhow::Context;
use sim_contract::{CONSOLE_CLIENT_ID, Client};
use sim_host::report_bus_errors;

use crate::args::{CtlArgs, CtlVerb, QueryVerb};
use crate::output::Exit;

/// Sends one command, or answers one query.
pub(crate) fn ctl(args: &CtlArgs) -> anyhow::Result<Exit> {
    report_bus_errors()?;
    let endpoint = args.endpoint.endpoint()?;
    let attach = || Client::attach_as(&endpoint, CONSOLE_CLIENT_ID);
    match &args.verb {
        CtlVerb::Command(verb) => {
            let mut client = attach()?;
            let actions = action::from_verb(verb, || rate_hz(&mut client, args))?;
            command::send(&mut client, args, &actions)
        }
        CtlVerb::Query(query) => answer(&mut attach()?, args, query).map(|()| Exit::Done),
        CtlVerb::Watch(options) => watch::watch(args, options).map(|()| Exit::Done),
    }
}

fn answer(client: &mut Client, args: &CtlArgs, query: &QueryVerb) -> anyhow::Result<()> {
    match query {
        QueryVerb::Get { parameter } => parameters::print(client, args, *parameter),
        QueryVerb::Status { energy } => status::print(client, args, *energy),
        QueryVerb::Hash => particles::print_hash(client, args),
        QueryVerb::Forces => forces::print(client, args),
        QueryVerb::Particles { indices } => particles::print(client, args, indices),
        QueryVerb::Nearest(point) => particles::print_nearest(client, args, point.vector()),
    }
}

/// Steps per second of the node.
fn rate_hz(client: &mut Client, args: &CtlArgs) -> anyhow::Result<u32> {
    let status =
        client.status(args.timeout())?.context("the node published no status: is it stopped?")?;
    Ok(status.rate_hz)
}
