//! `ctl`: sends commands to a running node and prints its state.

mod action;
mod command;
mod hint;
mod parameters;
mod particles;
mod rejection;
pub(crate) mod status;

use sim_contract::{CONSOLE_CLIENT_ID, Client, report_bus_errors};

use crate::args::{CtlArgs, CtlVerb, QueryVerb};
use crate::exit::Exit;

/// Sends one command, or answers one query.
pub(crate) fn ctl(args: &CtlArgs) -> anyhow::Result<Exit> {
    report_bus_errors()?;
    let mut client = Client::attach_as(&args.endpoint.endpoint()?, CONSOLE_CLIENT_ID)?;
    match &args.verb {
        CtlVerb::Command(verb) => command::send(&mut client, args, action::from_verb(verb)?),
        CtlVerb::Query(query) => {
            match query {
                QueryVerb::Get { parameter } => parameters::print(&mut client, args, *parameter),
                QueryVerb::Status => status::print(&mut client, args),
                QueryVerb::Hash => particles::print_hash(&mut client, args),
                QueryVerb::Particles { indices } => particles::print(&mut client, args, indices),
                QueryVerb::Nearest(point) => {
                    particles::print_nearest(&mut client, args, point.vector())
                }
            }?;
            Ok(Exit::Done)
        }
    }
}
