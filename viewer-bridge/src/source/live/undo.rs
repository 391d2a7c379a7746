//! Undoes what pages have changed: drags, moves, pushes, pins, cuts, parameters, resets,
//! loads and jumps.
//!
//! A change is undone by a rewind to the last step before it. Where the node no longer keeps that step,
//! because another scene was loaded since, the bridge gives it the state back that it kept when the page
//! sent the command, after loading the scene of that state if another one runs.

pub(super) mod kept_state;
pub(super) mod stack;

use std::collections::BTreeMap;

use sim_contract::{Action, Client, Outcome, Reason, SentState, Text};
use sim_host::clock::{SECOND_NS, monotonic_ns};

use super::newest_state::LoadedState;
use crate::limits::UNDO_TIMEOUT;
use crate::message::{Command, OutcomeText, Refusal, Undoable};
use crate::request::ClientId;
use crate::scene::catalog::Catalog;
use crate::sink::{Sinks, Update};
use kept_state::{KeptState, Keyframes};
use stack::{Awaited, Change, Entry, LoadKey, Stack, undoable};

/// Type of the command in messages.
const KIND: &str = "undo";

/// The changes that pages can undo, and the undoing that is under way.
#[derive(Debug, Default)]
pub(super) struct Undo {
    stack: Stack,
    pending: Option<Pending>,
    /// The name or path of the scene that the node loaded last, and of the scene on show.
    loaded: Option<Text>,
    source: Option<Text>,
    load: Option<LoadKey>,
    /// The newest change of each page that it can undo, as the page knows it.
    told: BTreeMap<ClientId, Option<Undoable>>,
}

/// A change that is being undone.
#[derive(Debug)]
struct Pending {
    client: ClientId,
    id: Option<u32>,
    number: u64,
    deadline_ns: u64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Rewinding { sequence: u64 },
    Loading { sequence: u64, from: LoadKey },
    Restoring(SentState),
}

/// A client's wish to undo its newest change.
#[derive(Debug, Clone, Copy)]
pub(super) struct UndoRequest {
    pub(super) client: ClientId,
    pub(super) id: Option<u32>,
    /// Changes of others since may be undone as well.
    pub(super) takes_others: bool,
}

impl LoadedState<'_> {
    fn key(&self) -> LoadKey {
        let header = &self.load.header;
        LoadKey { run_id: header.run_id, topology_revision: header.topology_revision }
    }
}

impl Undo {
    /// Copies the state before a command that can be undone.
    pub(super) fn prepare(
        &self,
        client: ClientId,
        command: &Command,
        state: &LoadedState<'_>,
        (keyframes, catalog): (&Keyframes, &Catalog),
    ) -> Option<Awaited> {
        let (what, stroke) = (undoable(&command.kind)?, command.stroke);
        if !matches!(client, ClientId::Page(_)) {
            return None;
        }
        let source = self.source.or_else(|| catalog.source(&state.load.summary.name));
        let is_continued = self.stack.continues(client, what, stroke);
        let copy = || KeptState::copy(state, keyframes, source);
        let kept = if is_continued { None } else { copy() };
        Some(Awaited { client, what, stroke, load: state.key(), kept })
    }

    /// Notes that a prepared command was sent.
    pub(super) fn await_outcome(&mut self, command: u64, awaited: Awaited) {
        self.stack.await_outcome(command, awaited);
    }

    /// Notes an applied change of any client.
    pub(super) fn add(&mut self, change: Change, action: &Action) {
        if let Action::Load { scene } = action {
            self.loaded = Some(*scene);
        }
        if is_change(action) {
            self.stack.add(change);
        }
    }

    /// Notes that a client carries something. A prepared one can be undone.
    pub(super) fn add_carrying(&mut self, change: Change, prepared: Option<Awaited>) {
        self.stack.add_made(change, prepared);
    }

    /// Begins to undo the newest change of a page. Returns the answer if it is refused.
    pub(super) fn begin(
        &mut self,
        request: UndoRequest,
        state: Option<LoadedState<'_>>,
        node: &mut Client,
    ) -> Option<OutcomeText> {
        let begun = self.first_stage(request, state, node);
        match begun {
            Err(reason) => Some(OutcomeText::refused(request.id, KIND, reason)),
            Ok((number, stage)) => {
                let UndoRequest { client, id, .. } = request;
                let timeout_ns = u64::try_from(UNDO_TIMEOUT.as_nanos()).unwrap_or(SECOND_NS);
                let deadline_ns = monotonic_ns() + timeout_ns;
                self.pending = Some(Pending { client, id, number, deadline_ns, stage });
                None
            }
        }
    }

    fn first_stage(
        &self,
        request: UndoRequest,
        state: Option<LoadedState<'_>>,
        node: &mut Client,
    ) -> Result<(u64, Stage), Refusal> {
        if self.pending.is_some() {
            return Err(Refusal::Busy);
        }
        let entry = self.stack.last(request.client).ok_or(Refusal::NothingToUndo)?;
        if entry.by_others > 0 && !request.takes_others {
            return Err(Refusal::ChangedByOthers(entry.by_others));
        }
        let state = state.ok_or(Refusal::NoNode)?;
        if entry.made.load == state.key() {
            let action = Action::Rewind { to_step: Some(entry.before), back_steps: None };
            let sequence = node.send(action).map_err(|_| Refusal::Busy)?;
            return Ok((entry.number, Stage::Rewinding { sequence }));
        }
        restore(entry, &state, node).map(|stage| (entry.number, stage))
    }

    /// Handles the outcome of a command of the bridge. Returns `false` if it belongs to another one.
    pub(super) fn on_outcome(
        &mut self,
        outcome: &Outcome,
        state: Option<LoadedState<'_>>,
        node: &mut Client,
        sinks: &Sinks,
    ) -> bool {
        let sequence = outcome.command.sequence;
        let Some(pending) = self.pending.take_if(|pending| pending.stage.awaits(sequence)) else {
            return false;
        };
        let reason = Reason::from_number(outcome.reason);
        if let (Action::Load { scene }, true) = (outcome.command.action(), outcome.is_applied()) {
            self.loaded = Some(scene);
        }
        match (&pending.stage, outcome.is_applied()) {
            (Stage::Rewinding { .. }, true) => {
                let state_step = match outcome.command.action() {
                    Action::Rewind { to_step, .. } => to_step,
                    _ => None,
                };
                self.finish(&pending, outcome.step, state_step, sinks);
            }
            (Stage::Restoring(_), true) => self.finish(&pending, outcome.step, None, sinks),
            // The state follows when the scene is there.
            (Stage::Loading { .. }, true) => self.pending = Some(pending),
            (Stage::Rewinding { .. }, false) => self.restore_instead(&pending, state, node, sinks),
            (_, false) => {
                let refusal = reason.map_or(Refusal::Unknown, Refusal::Node);
                refuse(&pending, refusal, sinks);
            }
        }
        true
    }

    /// The node no longer keeps the step.
    fn restore_instead(
        &mut self,
        pending: &Pending,
        state: Option<LoadedState<'_>>,
        node: &mut Client,
        sinks: &Sinks,
    ) {
        let entry = self.stack.get(pending.number);
        let stage = match (entry, state) {
            (Some(entry), Some(state)) => restore(entry, &state, node),
            _ => Err(Refusal::StateNotKept),
        };
        match stage {
            Ok(stage) => self.pending = Some(Pending { stage, ..*pending }),
            Err(refusal) => refuse(pending, refusal, sinks),
        }
    }

    /// Follows the load on show, gives the kept state to the node once its scene is there, and tells the
    /// pages what they can undo.
    pub(super) fn follow(
        &mut self,
        state: Option<LoadedState<'_>>,
        node: &mut Client,
        sinks: &Sinks,
    ) {
        if let Some(state) = state {
            self.follow_load(&state, node, sinks);
        }
        let now_ns = monotonic_ns();
        if let Some(pending) = self.pending.take_if(|pending| pending.deadline_ns <= now_ns) {
            refuse(&pending, Refusal::NoAnswer, sinks);
        }
        self.tell(sinks);
    }

    fn follow_load(&mut self, state: &LoadedState<'_>, node: &mut Client, sinks: &Sinks) {
        let key = state.key();
        if self.load != Some(key) {
            self.load = Some(key);
            self.source = self.loaded.take();
        }
        let has_loaded = |pending: &mut Pending| matches!(pending.stage, Stage::Loading { from, .. } if from != key);
        let Some(pending) = self.pending.take_if(has_loaded) else { return };
        let kept = self.stack.get(pending.number).and_then(|entry| entry.made.kept.as_ref());
        let stage = match kept {
            None => Err(Refusal::StateNotKept),
            Some(kept) if kept.scene_hash != state.load.header.scene_hash => {
                Err(Refusal::SceneChanged)
            }
            Some(kept) => give(kept, node),
        };
        match stage {
            Ok(stage) => self.pending = Some(Pending { stage, ..pending }),
            Err(refusal) => refuse(&pending, refusal, sinks),
        }
    }

    fn finish(&mut self, pending: &Pending, step: u64, state_step: Option<u64>, sinks: &Sinks) {
        let Pending { client, id, number, .. } = *pending;
        let Some(entry) = self.stack.remove_from(number) else { return };
        let text = finished_text(&entry, state_step);
        let outcome = OutcomeText {
            applied: 1,
            step: Some(step),
            state_step,
            text,
            ..OutcomeText::pending(id, KIND)
        };
        sinks.publish(&Update::Answer { client, outcome: &outcome });
    }

    /// Tells each page its newest change that it can undo.
    fn tell(&mut self, sinks: &Sinks) {
        let mut now: BTreeMap<ClientId, Option<Undoable>> = self.stack.newest();
        for client in self.told.keys() {
            now.entry(*client).or_default();
        }
        for (client, what) in &now {
            if self.told.get(client).copied().flatten() != *what {
                sinks.publish(&Update::Undoable { client: *client, what: *what });
            }
        }
        self.told = now;
    }

    /// Forgets a client that has left.
    pub(super) fn remove_client(&mut self, client: ClientId) {
        self.stack.remove_client(client);
        self.told.remove(&client);
    }

    /// The link ends. A load can begin another run, in which the undoing goes on; nothing else can.
    pub(super) fn end_run(&mut self, goes_on: bool, sinks: &Sinks) {
        let is_over =
            |pending: &mut Pending| !(goes_on && matches!(pending.stage, Stage::Loading { .. }));
        if let Some(pending) = self.pending.take_if(is_over) {
            refuse(&pending, Refusal::NoNode, sinks);
        }
        if !goes_on {
            self.stack.clear();
            (self.loaded, self.source, self.load) = (None, None, None);
            self.tell(sinks);
        }
    }
}

impl Stage {
    fn awaits(&self, outcome: u64) -> bool {
        match self {
            Self::Rewinding { sequence } | Self::Loading { sequence, .. } => *sequence == outcome,
            Self::Restoring(sent) => sent.sequence() == outcome,
        }
    }
}

/// Begins to put the kept state of a change in place, after a load if another scene runs.
fn restore(entry: &Entry, state: &LoadedState<'_>, node: &mut Client) -> Result<Stage, Refusal> {
    let kept = entry.made.kept.as_ref().ok_or(Refusal::StateNotKept)?;
    if kept.scene_hash == state.load.header.scene_hash {
        return give(kept, node);
    }
    let scene = kept.source.ok_or(Refusal::SceneNotKnown)?;
    let sequence = node.send(Action::Load { scene }).map_err(|_| Refusal::Busy)?;
    Ok(Stage::Loading { sequence, from: state.key() })
}

fn give(kept: &KeptState, node: &mut Client) -> Result<Stage, Refusal> {
    node.send_state(&kept.given()).map(Stage::Restoring).map_err(|_| Refusal::Busy)
}

fn refuse(pending: &Pending, reason: Refusal, sinks: &Sinks) {
    let outcome = OutcomeText::refused(pending.id, KIND, reason);
    sinks.publish(&Update::Answer { client: pending.client, outcome: &outcome });
}

/// Tells the user what was undone, and what differs from the state before it.
fn finished_text(entry: &Entry, state_step: Option<u64>) -> String {
    let own_before = entry.own_before;
    let mut text = format!("Undid {}.", entry.made.what.text());
    if own_before > 0 {
        let s = if own_before == 1 { "" } else { "s" };
        text += &format!(
            " {own_before} earlier change{s} of the same pause went with it: the node makes no step between them."
        );
    }
    if let Some(state_step) = state_step.filter(|step| *step != entry.before) {
        text += &format!(
            " The node no longer keeps step {}: the state is that of step {state_step}.",
            entry.before
        );
    }
    text
}

/// Returns `true` for an action that changes the state, which an undo reverts.
fn is_change(action: &Action) -> bool {
    match action {
        Action::Pause | Action::Resume | Action::Step { .. } | Action::Mark { .. } => false,
        Action::Set { parameter, .. } => {
            parameter.as_str() != sim_contract::Parameter::TimeScale.name()
        }
        _ => true,
    }
}
