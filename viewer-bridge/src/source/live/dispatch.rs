//! Sends the clients' commands to the node, and the outcomes back.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use sim_contract::{Action, Client, Outcome, Reason, RequestError};
use sim_host::clock::monotonic_ns;

use super::actions::{CommandContext, actions};
use crate::limits::{COMMANDS_QUEUED_MAX, GRABS_PER_CLIENT_MAX, OUTCOME_TIMEOUT};
use crate::message::{Command, CommandKind, OutcomeText, Refusal, Status};
use crate::request::ClientId;
use crate::scene::catalog::Catalog;
use crate::sink::{Sinks, Update};

/// Open commands and grabs. The node sees all clients as one, so only the bridge knows which of them
/// grabs a particle.
#[derive(Debug, Default)]
pub(super) struct Dispatch {
    /// The scenes that clients can load.
    catalog: Arc<Catalog>,
    /// Grabs by particle, including those that the node has not applied yet.
    grabs: BTreeMap<u32, GrabOwner>,
    /// Open commands by number, ascending in time.
    open: BTreeMap<u64, OpenCommand>,
    last_command: u64,
    /// Actions that wait for room in the node's queue.
    outbox: VecDeque<QueuedAction>,
    /// Actions without an outcome, by their sequence number.
    sent: BTreeMap<u64, QueuedAction>,
}

/// The owner of a grab.
#[derive(Debug, Clone, Copy)]
struct GrabOwner {
    client: ClientId,
    /// The node has applied the grab. Until then a reset does not end it, because the grab may come
    /// after the reset.
    is_applied: bool,
}

/// The origin of an action.
#[derive(Debug, Clone, Copy)]
pub(super) struct Origin {
    /// `None` if the client has left, or has been told that its command was not answered.
    pub(super) client: Option<ClientId>,
    /// Number of the command.
    pub(super) command: u64,
}

/// An action of a command.
#[derive(Debug, Clone, Copy)]
struct QueuedAction {
    /// Number of the command; `None` if no client waits for the outcome.
    command: Option<u64>,
    action: Action,
}

/// A command whose client waits for the answer.
#[derive(Debug)]
struct OpenCommand {
    client: ClientId,
    deadline_ns: u64,
    /// Number of its actions without an outcome.
    open_count: usize,
    outcome: OutcomeText,
}

/// The outcome of an action.
#[derive(Debug, Clone, Copy)]
struct PartOutcome {
    /// First step that shows it.
    step: Option<u64>,
    /// Step whose state a rewind has put in place.
    state_step: Option<u64>,
    result: Result<(), Refusal>,
}

impl Dispatch {
    /// Clients can load the scenes of the catalog.
    pub(super) fn new(catalog: Arc<Catalog>) -> Self {
        Self { catalog, ..Self::default() }
    }

    /// Accepts a command of a client. Returns the answer if it is known at once.
    pub(super) fn submit(
        &mut self,
        client: ClientId,
        command: &Command,
        context: CommandContext<'_>,
    ) -> Option<OutcomeText> {
        let (id, kind) = (command.id, command.kind.name());
        let parts = self.update_grabs(client, &command.kind);
        match parts.and_then(|()| actions(&command.kind, context, &self.catalog)) {
            Err(reason) => Some(OutcomeText::refused(id, kind, reason)),
            Ok(parts) if parts.is_empty() => id.map(|_| OutcomeText::pending(id, kind)),
            Ok(parts) => {
                self.open_command(client, OutcomeText::pending(id, kind), parts);
                None
            }
        }
    }

    /// Sends moves for the bridge itself, without an answer to a client. Each replaces an unsent one of the same
    /// object.
    pub(super) fn add_moves(&mut self, moves: Vec<Action>) {
        for action in moves {
            let is_outdated = |part: &QueuedAction| {
                part.command.is_none() && is_same_object(&part.action, &action)
            };
            self.outbox.retain(|part| !is_outdated(part));
            self.outbox.push_back(QueuedAction { command: None, action });
        }
    }

    fn open_command(&mut self, client: ClientId, outcome: OutcomeText, parts: Vec<Action>) {
        self.last_command += 1;
        let number = self.last_command;
        let timeout_ns = u64::try_from(OUTCOME_TIMEOUT.as_nanos()).unwrap_or(u64::MAX);
        let deadline_ns = monotonic_ns() + timeout_ns;
        let command = OpenCommand { client, deadline_ns, open_count: parts.len(), outcome };
        self.open.insert(number, command);
        let parts = parts.into_iter().map(|action| QueuedAction { command: Some(number), action });
        self.outbox.extend(parts);
    }

    /// Notes a client's grabs, and refuses to touch those of others.
    fn update_grabs(&mut self, client: ClientId, kind: &CommandKind) -> Result<(), Refusal> {
        if self.outbox.len() >= COMMANDS_QUEUED_MAX {
            return Err(Refusal::Busy);
        }
        let owner = |particle: &u32| self.grabs.get(particle).map(|grab| grab.client);
        let CommandKind::Action(action) = kind else { return Ok(()) };
        match action {
            Action::Grab { particle, .. } => {
                if owner(particle).is_some_and(|other| other != client) {
                    return Err(Reason::GrabbedByOther.into());
                }
                let count = self.grabs.values().filter(|grab| grab.client == client).count();
                if count >= GRABS_PER_CLIENT_MAX && owner(particle).is_none() {
                    return Err(Refusal::TooManyGrabs);
                }
                self.grabs.entry(*particle).or_insert(GrabOwner { client, is_applied: false });
            }
            Action::Move { particle, .. } | Action::Release { particle, .. } => {
                match owner(particle) {
                    None => return Err(Reason::NotGrabbed.into()),
                    Some(other) if other != client => return Err(Reason::GrabbedByOther.into()),
                    Some(_) => {}
                }
                if matches!(action, Action::Release { .. }) {
                    self.grabs.remove(particle);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Ends the grabs of a client that has left, and drops its open commands.
    pub(super) fn remove_client(&mut self, client: ClientId) {
        let grabs = self.grabs.extract_if(.., |_, grab| grab.client == client);
        self.outbox.extend(grabs.map(|(particle, _)| release(particle)));
        self.open.retain(|_, command| command.client != client);
    }

    /// Ends all grabs.
    pub(super) fn release_all(&mut self) {
        let grabs = std::mem::take(&mut self.grabs);
        self.outbox.extend(grabs.into_keys().map(release));
    }

    /// Returns whether a release is still without an outcome.
    pub(super) fn is_releasing(&self) -> bool {
        let mut pending = self.outbox.iter().chain(self.sent.values());
        pending.any(|part| matches!(part.action, Action::Release { .. }))
    }

    /// Sends as many actions as the node's queue accepts.
    pub(super) fn flush(&mut self, node: &mut Client, sinks: &Sinks) {
        while let Some(part) = self.outbox.pop_front() {
            match node.send(part.action) {
                Ok(sequence) => {
                    self.sent.insert(sequence, part);
                }
                Err(RequestError::QueueFull { .. }) => {
                    self.outbox.push_front(part);
                    return;
                }
                Err(_) => {
                    self.forget_unsent_grab(part.action);
                    let result = Err(Refusal::NoNode);
                    let outcome = PartOutcome { step: None, state_step: None, result };
                    self.close_part(sinks, part.command, outcome);
                }
            }
        }
    }

    /// Number of the newest command.
    pub(super) fn last_command(&self) -> u64 {
        self.last_command
    }

    /// Returns the client and the number of the command to which an action belongs.
    pub(super) fn origin(&self, sequence: u64) -> Option<Origin> {
        let command = self.sent.get(&sequence)?.command?;
        let client = self.open.get(&command).map(|open| open.client);
        Some(Origin { client, command })
    }

    /// Handles the outcome of an action that this bridge sent.
    pub(super) fn on_outcome(&mut self, sinks: &Sinks, outcome: &Outcome) {
        let command = self.remove_sent(outcome.command.sequence);
        let result = match Reason::from_number(outcome.reason) {
            _ if outcome.is_applied() => Ok(()),
            Some(reason) => Err(Refusal::of_action(reason, &outcome.command.action())),
            None => Err(Refusal::Unknown),
        };
        match outcome.command.action() {
            Action::Grab { particle, .. } if result.is_err() => self.forget_lost_grab(particle),
            // If the grab has no owner, its release has been sent already.
            Action::Grab { particle, .. } => {
                if let Some(grab) = self.grabs.get_mut(&particle) {
                    grab.is_applied = true;
                }
            }
            Action::Release { particle, .. } => {
                if let Some(grab) = self.grabs.get_mut(&particle) {
                    grab.is_applied = false;
                }
            }
            _ => {}
        }
        let state_step = match outcome.command.action() {
            Action::Rewind { to_step, .. } if result.is_ok() => to_step,
            _ => None,
        };
        let outcome = PartOutcome { step: Some(outcome.step), state_step, result };
        self.close_part(sinks, command, outcome);
    }

    /// Removes an answered action and returns the number of its command. The node answers in the order
    /// of sending, so the answers to earlier actions were missed; they are removed as well.
    fn remove_sent(&mut self, sequence: u64) -> Option<u64> {
        let mut later = self.sent.split_off(&sequence);
        let part = later.remove(&sequence);
        self.sent = later;
        part?.command
    }

    /// Ends the grabs that the node had applied before a reset or a load. The node answers in the order
    /// of application, so a grab without an answer comes after it.
    pub(super) fn end_applied_grabs(&mut self) {
        let particles: Vec<_> = self.grabs.keys().copied().collect();
        for particle in particles {
            self.end_applied_grab(particle);
        }
    }

    /// Ends the grabs as [`Self::end_applied_grabs`] does, and releases their particles.
    pub(super) fn release_applied_grabs(&mut self) {
        let applied = self.grabs.iter().filter(|(_, grab)| grab.is_applied);
        let particles: Vec<_> = applied.map(|(particle, _)| *particle).collect();
        self.end_applied_grabs();
        // A grab that is on its way has its owner still, and comes after the state.
        let ended = particles.into_iter().filter(|particle| !self.grabs.contains_key(particle));
        self.outbox.extend(ended.map(release));
    }

    /// Ends the grab of a particle that another client has released by force.
    pub(super) fn end_applied_grab(&mut self, particle: u32) {
        if let Some(grab) = self.grabs.get_mut(&particle) {
            grab.is_applied = false;
            self.forget_lost_grab(particle);
        }
    }

    /// Forgets the owner of a grab that failed or ended, unless another grab of the particle was
    /// applied or is on its way.
    fn forget_lost_grab(&mut self, particle: u32) {
        let is_applied = self.grabs.get(&particle).is_some_and(|grab| grab.is_applied);
        let is_grab = |part: &QueuedAction| matches!(part.action, Action::Grab { particle: grabbed, .. } if grabbed == particle);
        if !is_applied && !self.sent.values().chain(&self.outbox).any(is_grab) {
            self.grabs.remove(&particle);
        }
    }

    /// Adds the outcome of an action to its command. Answers the command after the last one.
    fn close_part(&mut self, sinks: &Sinks, number: Option<u64>, part: PartOutcome) {
        let Some(number) = number else { return };
        let Some(command) = self.open.get_mut(&number) else { return };
        let outcome = &mut command.outcome;
        outcome.step = outcome.step.max(part.step);
        outcome.state_step = part.state_step.or(outcome.state_step);
        match part.result {
            Ok(()) => outcome.applied += 1,
            Err(reason) => outcome.reject_part(reason),
        }
        command.open_count -= 1;
        if command.open_count == 0
            && let Some(command) = self.open.remove(&number)
        {
            command.answer(sinks);
        }
    }

    /// Answers the commands whose deadline has passed.
    pub(super) fn expire(&mut self, sinks: &Sinks, now_ns: u64) {
        while let Some(first) = self.open.first_entry()
            && first.get().deadline_ns <= now_ns
        {
            let (number, mut command) = first.remove_entry();
            self.withdraw(number);
            if command.outcome.applied + command.outcome.rejected == 0 {
                command.outcome.status = Status::Unanswered;
            }
            command.outcome.explain(Refusal::NoAnswer);
            command.answer(sinks);
        }
    }

    /// Drops the unsent actions of a command, except releases: no other client can release the
    /// particles.
    fn withdraw(&mut self, number: u64) {
        let mut withdrawn = Vec::new();
        self.outbox.retain_mut(|part| {
            if part.command != Some(number) {
                return true;
            }
            part.command = None;
            let is_release = matches!(part.action, Action::Release { .. });
            if !is_release {
                withdrawn.push(part.action);
            }
            is_release
        });
        for action in withdrawn {
            self.forget_unsent_grab(action);
        }
    }

    fn forget_unsent_grab(&mut self, action: Action) {
        if let Action::Grab { particle, .. } = action {
            self.forget_lost_grab(particle);
        }
    }
}

impl OpenCommand {
    fn answer(mut self, sinks: &Sinks) {
        if self.outcome.status == Status::Applied && self.outcome.applied == 0 {
            self.outcome.status = Status::Rejected;
        }
        if self.outcome.id.is_some() || self.outcome.status != Status::Applied {
            sinks.publish(&Update::Answer { client: self.client, outcome: &self.outcome });
        }
    }
}

fn is_same_object(a: &Action, b: &Action) -> bool {
    match (a, b) {
        (Action::MoveCollider { collider: a, .. }, Action::MoveCollider { collider: b, .. })
        | (Action::MoveAnchor { anchor: a, .. }, Action::MoveAnchor { anchor: b, .. }) => a == b,
        _ => false,
    }
}

/// Releases a particle whose client cannot do it.
fn release(particle: u32) -> QueuedAction {
    QueuedAction { command: None, action: Action::Release { particle, force: false } }
}
