//! Applies the outcomes of a node to what the bridge keeps for its clients.

use std::time::Duration;

use recording::OutcomeRow;
use sim_contract::{Action, Client, Outcome};

use super::carrier::Carrier;
use super::dispatch::Dispatch;
use super::newest_state::LoadedState;
use super::undo::Undo;
use super::undo::stack::Change;
use crate::sink::{Sinks, Update};

/// The state that the bridge keeps for its clients.
#[derive(Debug)]
pub(super) struct HeldByClients<'a> {
    pub(super) dispatch: &'a mut Dispatch,
    pub(super) carrier: &'a mut Carrier,
    pub(super) undo: &'a mut Undo,
}

/// Ends the grabs of clients at an applied action that replaces the state.
fn end_grabs(dispatch: &mut Dispatch, action: &Action) {
    match action {
        Action::Reset | Action::Load { .. } => dispatch.end_applied_grabs(),
        // The state in place may have them too, and then the node still drives the particles.
        Action::Rewind { .. } | Action::Restore { .. } => dispatch.release_applied_grabs(),
        _ => {}
    }
}

/// Notes what a client of the bridge, or another program, has changed.
fn note_change(dispatch: &Dispatch, undo: &mut Undo, outcome: &Outcome, is_own: bool) {
    let origin = dispatch.origin(outcome.command.sequence).filter(|_| is_own);
    // The bridge ends the grabs of clients that have left.
    if is_own && origin.is_none() {
        return;
    }
    let client = origin.and_then(|origin| origin.client);
    let command = origin.map(|origin| origin.command);
    undo.add(Change { step: outcome.step, client, command }, &outcome.command.action());
}

/// Publishes outcomes, and answers the clients whose commands they belong to.
pub(super) fn handle_outcomes(
    held: HeldByClients<'_>,
    client: &mut Client,
    newest: Option<LoadedState<'_>>,
    outcomes: &[Outcome],
    sinks: &Sinks,
) {
    let HeldByClients { dispatch, carrier, undo } = held;
    for outcome in outcomes {
        let row = OutcomeRow::from(outcome);
        sinks.publish(&Update::Outcome(&row));
        let action = outcome.command.action();
        if outcome.is_applied() {
            end_grabs(dispatch, &action);
            if row.replaces_state() || matches!(action, Action::Load { .. }) {
                carrier.clear();
            }
            if row.replaces_state() {
                sinks.publish(&Update::Reset { step: outcome.step });
            }
        }
        if let Action::Release { particle, force: true } = action
            && outcome.is_applied()
        {
            dispatch.end_applied_grab(particle);
        }
        let is_own = outcome.command.client_id == client.client_id();
        if is_own && undo.on_outcome(outcome, newest, client, sinks) {
            continue;
        }
        if outcome.is_applied() {
            note_change(dispatch, undo, outcome, is_own);
        }
        if is_own {
            dispatch.on_outcome(sinks, outcome);
        }
    }
    // The client receives the same outcomes. Reading them makes room for the next ones.
    while let Ok(Some(_)) = client.next_outcome(Duration::ZERO) {}
}
