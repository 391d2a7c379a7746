//! Commands on their way: from pages to the node, and their outcomes back.

use std::collections::{BTreeMap, VecDeque};

use sim_contract::clock::monotonic_ns;
use sim_contract::{Action, Client, Outcome, RequestError};

use super::actions::{Context, actions};
use crate::limits::{COMMANDS_QUEUED_MAX, OUTCOME_TIMEOUT, PARTICLES_HELD_MAX};
use crate::message::reason;
use crate::message::{Command, OutcomeText, Status, ToPage};
use crate::pages::hub::Hub;

/// Commands on their way, and what pages hold. All pages are one client of the node: who of them
/// holds a particle is known here only.
#[derive(Debug, Default)]
pub(super) struct Dispatch {
    /// Which page holds a particle, or will when the node has applied what is on its way.
    holders: BTreeMap<u32, Holder>,
    /// Unanswered commands by number, ascending in time.
    tickets: BTreeMap<u64, Ticket>,
    last_ticket: u64,
    /// What has not been sent yet.
    outbox: VecDeque<Part>,
    /// What has no outcome yet, by the sequence number that the node was told.
    sent: BTreeMap<u64, Part>,
}

/// Who holds a particle.
#[derive(Debug, Clone, Copy)]
struct Holder {
    client: u32,
    /// The node has said so. Until then a reset does not end it: the grab may come after.
    is_applied: bool,
}

/// An action, and the command that it is a part of.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// None where nobody waits for the outcome.
    ticket: Option<u64>,
    action: Action,
}

/// A command that a page waits for.
#[derive(Debug)]
struct Ticket {
    client: u32,
    deadline_ns: u64,
    /// Actions without an outcome.
    open: usize,
    outcome: OutcomeText,
}

impl Dispatch {
    /// Takes a command of a page.
    pub(super) fn take(
        &mut self,
        client: u32,
        id: Option<u32>,
        command: Command,
        context: Context<'_>,
    ) -> Option<(u32, OutcomeText)> {
        let kind = command.name();
        let mut outcome = OutcomeText {
            id,
            kind,
            status: Status::Applied,
            step: None,
            applied: 0,
            rejected: 0,
            reason: "",
            text: String::new(),
        };
        let parts = self.hold(client, &command).and_then(|()| actions(command, context));
        match parts {
            Err(reason) => {
                refuse(&mut outcome, reason);
                outcome.status = Status::Rejected;
                Some((client, outcome))
            }
            Ok(parts) if parts.is_empty() => id.map(|_| (client, outcome)),
            Ok(parts) => {
                self.last_ticket += 1;
                let number = self.last_ticket;
                let timeout_ns = u64::try_from(OUTCOME_TIMEOUT.as_nanos()).unwrap_or(u64::MAX);
                let deadline_ns = monotonic_ns() + timeout_ns;
                let ticket = Ticket { client, deadline_ns, open: parts.len(), outcome };
                self.tickets.insert(number, ticket);
                self.outbox
                    .extend(parts.into_iter().map(|action| Part { ticket: Some(number), action }));
                None
            }
        }
    }

    /// Keeps the book of who holds what.
    fn hold(&mut self, client: u32, command: &Command) -> Result<(), &'static str> {
        if self.outbox.len() >= COMMANDS_QUEUED_MAX {
            return Err(reason::BUSY);
        }
        let holder = |particle: &u32| self.holders.get(particle).map(|holder| holder.client);
        match command {
            Command::DragBegin { particle, .. } => {
                if holder(particle).is_some_and(|other| other != client) {
                    return Err("grabbed_by_other");
                }
                let held = self.holders.values().filter(|one| one.client == client).count();
                if held >= PARTICLES_HELD_MAX && holder(particle).is_none() {
                    return Err(reason::TOO_MANY_HELD);
                }
                let holder = Holder { client, is_applied: false };
                self.holders.entry(*particle).or_insert(holder);
            }
            Command::DragMove { particle, .. } | Command::DragEnd { particle } => {
                match holder(particle) {
                    None => return Err("not_grabbed"),
                    Some(other) if other != client => return Err("grabbed_by_other"),
                    Some(_) => {}
                }
                if matches!(command, Command::DragEnd { .. }) {
                    self.holders.remove(particle);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// A page has gone: what it holds is let go.
    pub(super) fn leave(&mut self, client: u32) {
        let held = self.holders.extract_if(.., |_, holder| holder.client == client);
        self.outbox.extend(held.map(|(particle, _)| release(particle)));
        self.tickets.retain(|_, ticket| ticket.client != client);
    }

    /// All pages go: what they hold is let go.
    pub(super) fn release_all(&mut self) {
        let held = std::mem::take(&mut self.holders);
        self.outbox.extend(held.into_keys().map(release));
    }

    /// Whether the node has yet to let go of something.
    pub(super) fn is_releasing(&self) -> bool {
        let mut on_their_way = self.outbox.iter().chain(self.sent.values());
        on_their_way.any(|part| matches!(part.action, Action::Release { .. }))
    }

    /// Hands the node as much as it takes.
    pub(super) fn flush(&mut self, node: &mut Client, hub: &Hub) {
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
                    self.forget_unsent(part.action);
                    self.close_part(hub, part.ticket, None, Err(reason::NO_NODE));
                }
            }
        }
    }

    /// Takes the outcome of what this bridge sent.
    pub(super) fn take_outcome(&mut self, hub: &Hub, outcome: &Outcome) {
        let ticket = self.answered(outcome.command.sequence);
        let result = if outcome.is_applied() { Ok(()) } else { Err(outcome.reason_name()) };
        match outcome.command.action() {
            Action::Grab { particle, .. } if result.is_err() => self.forget_unless_held(particle),
            // Where nobody holds it, what lets it go is on its way already.
            Action::Grab { particle, .. } => self.set_applied(particle, true),
            Action::Release { particle } => self.set_applied(particle, false),
            _ => {}
        }
        self.close_part(hub, ticket, Some(outcome.step), result);
    }

    /// The ticket of what the node has answered. It answers in the order of sending: what was sent
    /// before has been answered as well, and that was missed.
    fn answered(&mut self, sequence: u64) -> Option<u64> {
        let mut later = self.sent.split_off(&sequence);
        let part = later.remove(&sequence);
        self.sent = later;
        part?.ticket
    }

    fn set_applied(&mut self, particle: u32, is_applied: bool) {
        if let Some(holder) = self.holders.get_mut(&particle) {
            holder.is_applied = is_applied;
        }
    }

    /// The state is another one: nobody holds anything any more, but for what is grabbed after it.
    /// The node answers in the order of application: what it has not answered comes after.
    pub(super) fn forget_holders(&mut self) {
        for holder in self.holders.values_mut() {
            holder.is_applied = false;
        }
        let particles: Vec<_> = self.holders.keys().copied().collect();
        for particle in particles {
            self.forget_unless_held(particle);
        }
    }

    /// A grab has come to nothing: unless another one did or may, nobody holds the particle.
    fn forget_unless_held(&mut self, particle: u32) {
        let is_applied = self.holders.get(&particle).is_some_and(|holder| holder.is_applied);
        let grabs = |part: &Part| matches!(part.action, Action::Grab { particle: grabbed, .. } if grabbed == particle);
        if !is_applied && !self.sent.values().chain(&self.outbox).any(grabs) {
            self.holders.remove(&particle);
        }
    }

    fn close_part(
        &mut self,
        hub: &Hub,
        number: Option<u64>,
        step: Option<u64>,
        result: Result<(), &'static str>,
    ) {
        let Some(number) = number else { return };
        let Some(ticket) = self.tickets.get_mut(&number) else { return };
        let outcome = &mut ticket.outcome;
        outcome.step = outcome.step.max(step);
        match result {
            Ok(()) => outcome.applied += 1,
            Err(reason) => refuse(outcome, reason),
        }
        ticket.open -= 1;
        if ticket.open == 0
            && let Some(ticket) = self.tickets.remove(&number)
        {
            ticket.answer(hub);
        }
    }

    /// Answers what the node has not, for too long or for ever.
    pub(super) fn expire(&mut self, hub: &Hub, now_ns: u64) {
        while let Some(first) = self.tickets.first_entry()
            && first.get().deadline_ns <= now_ns
        {
            let (number, mut ticket) = first.remove_entry();
            self.withdraw(number);
            if ticket.outcome.applied + ticket.outcome.rejected == 0 {
                ticket.outcome.status = Status::Unanswered;
            }
            explain(&mut ticket.outcome, reason::NO_ANSWER);
            ticket.answer(hub);
        }
    }

    /// Sends no more of a command, but for what lets go of a particle: nobody else would.
    fn withdraw(&mut self, number: u64) {
        let mut withdrawn = Vec::new();
        self.outbox.retain_mut(|part| {
            if part.ticket != Some(number) {
                return true;
            }
            part.ticket = None;
            let is_release = matches!(part.action, Action::Release { .. });
            if !is_release {
                withdrawn.push(part.action);
            }
            is_release
        });
        for action in withdrawn {
            self.forget_unsent(action);
        }
    }

    /// An action will not be sent: nobody holds what it would have grabbed.
    fn forget_unsent(&mut self, action: Action) {
        if let Action::Grab { particle, .. } = action {
            self.forget_unless_held(particle);
        }
    }
}

impl Ticket {
    fn answer(mut self, hub: &Hub) {
        if self.outcome.status == Status::Applied && self.outcome.applied == 0 {
            self.outcome.status = Status::Rejected;
        }
        if self.outcome.id.is_some() || self.outcome.status != Status::Applied {
            hub.send(self.client, &ToPage::Outcome(self.outcome));
        }
    }
}

/// Lets go of a particle for whoever cannot ask for it any more.
fn release(particle: u32) -> Part {
    Part { ticket: None, action: Action::Release { particle } }
}

fn refuse(outcome: &mut OutcomeText, reason: &'static str) {
    outcome.rejected += 1;
    explain(outcome, reason);
}

/// The first reason is told.
fn explain(outcome: &mut OutcomeText, reason: &'static str) {
    if outcome.reason.is_empty() {
        outcome.reason = reason;
        reason::text(reason).clone_into(&mut outcome.text);
    }
}
