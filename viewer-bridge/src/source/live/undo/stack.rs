//! The changes that each page can undo, and those of others since.

use std::collections::{BTreeMap, VecDeque};

use sim_contract::{Action, Parameter};

use super::kept_state::KeptState;
use crate::limits::{UNDO_MAX, UNDO_SIZE_BYTES_MAX};
use crate::message::{CommandKind, Undoable};
use crate::request::ClientId;

/// Commands whose outcome has not arrived. Beyond it, the oldest one cannot be undone.
const AWAITED_MAX: usize = 8;

/// A load of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::source::live) struct LoadKey {
    pub(in crate::source::live) run_id: u64,
    pub(in crate::source::live) topology_revision: u32,
}

/// A command that can be undone once the node has applied it.
#[derive(Debug)]
pub(in crate::source::live) struct Awaited {
    pub(super) client: ClientId,
    pub(super) what: Undoable,
    /// Cuts, pushes or changes of parameters with the same number are one stroke.
    pub(super) stroke: Option<u32>,
    pub(super) load: LoadKey,
    /// The state when the command was sent.
    pub(super) kept: Option<KeptState>,
}

impl Awaited {
    /// Returns `true` for another part of the same stroke.
    fn is_continued_by(&self, what: Undoable, stroke: Option<u32>) -> bool {
        stroke.is_some() && (self.what, self.stroke) == (what, stroke)
    }
}

/// A change that a page can undo.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) number: u64,
    pub(super) made: Awaited,
    /// The last step without the change.
    pub(super) before: u64,
    /// Changes of the same page in the same step, before this one: the state before it has none of them.
    pub(super) own_before: u32,
    /// Changes of other clients that are undone as well.
    pub(super) by_others: u32,
}

/// The changes of the newest step, by client; `None` is a client beside the bridge.
#[derive(Debug, Default)]
struct Boundary {
    step: u64,
    counts: BTreeMap<Option<ClientId>, u32>,
}

/// The changes that pages can undo, in the order of application.
#[derive(Debug, Default)]
pub(super) struct Stack {
    entries: VecDeque<Entry>,
    awaited: BTreeMap<u64, Awaited>,
    boundary: Boundary,
    last_number: u64,
}

/// An applied change.
#[derive(Debug, Clone, Copy)]
pub(in crate::source::live) struct Change {
    /// First step that shows it.
    pub(in crate::source::live) step: u64,
    /// The client of the bridge that made it; `None` for any other program.
    pub(in crate::source::live) client: Option<ClientId>,
    /// Number of the command, if the bridge sent it.
    pub(in crate::source::live) command: Option<u64>,
}

/// Returns the kind of change of a command that can be undone.
pub(super) fn undoable(kind: &CommandKind) -> Option<Undoable> {
    let action = match kind {
        CommandKind::CutConstraints { .. } => return Some(Undoable::Cut),
        CommandKind::Brush(_) => return Some(Undoable::Brush),
        CommandKind::Lift { .. } => return Some(Undoable::Carry),
        CommandKind::Action(action) => action,
        _ => return None,
    };
    match action {
        Action::Grab { .. } => Some(Undoable::Drag),
        Action::MoveCollider { .. } | Action::MoveAnchor { .. } => Some(Undoable::Carry),
        Action::Push { .. } => Some(Undoable::Brush),
        Action::Pin { .. } => Some(Undoable::Pin),
        Action::Unpin { .. } => Some(Undoable::Unpin),
        Action::Cut { .. } | Action::CutSegment { .. } | Action::CutRadius { .. } => {
            Some(Undoable::Cut)
        }
        Action::Reset => Some(Undoable::Reset),
        // The pace is no part of the state that an undo brings back.
        Action::Set { parameter, .. } if parameter.as_str() != Parameter::TimeScale.name() => {
            Some(Undoable::Set)
        }
        Action::Load { .. } => Some(Undoable::Load),
        Action::Rewind { .. } => Some(Undoable::Rewind),
        _ => None,
    }
}

impl Stack {
    /// Returns `true` if a command belongs to the stroke of the page's last change.
    pub(super) fn continues(&self, client: ClientId, what: Undoable, stroke: Option<u32>) -> bool {
        let awaited = self.awaited.values().rev().find(|one| one.client == client);
        let last = awaited.or_else(|| self.last(client).map(|entry| &entry.made));
        last.is_some_and(|last| last.is_continued_by(what, stroke))
    }

    /// Notes a command of a page that has been sent.
    pub(super) fn await_outcome(&mut self, command: u64, awaited: Awaited) {
        self.awaited.insert(command, awaited);
        if self.awaited.len() > AWAITED_MAX {
            self.awaited.pop_first();
        }
        self.limit_size();
    }

    /// Notes an applied change.
    pub(super) fn add(&mut self, change: Change) {
        let awaited = change.command.and_then(|command| self.awaited.remove(&command));
        self.add_made(change, awaited);
    }

    /// Notes an applied change that its page can undo, if `awaited` says how.
    pub(super) fn add_made(&mut self, change: Change, awaited: Option<Awaited>) {
        let Change { step, client, .. } = change;
        // The outcome of a long load can come after the page was told that there is none.
        let client = client.or_else(|| awaited.as_ref().map(|awaited| awaited.client));
        for entry in self.entries.iter_mut().filter(|entry| Some(entry.made.client) != client) {
            entry.by_others = entry.by_others.saturating_add(1);
        }
        if self.boundary.step != step {
            self.boundary = Boundary { step, counts: BTreeMap::new() };
        }
        if let Some(awaited) = awaited {
            self.push(awaited, step);
            self.limit_size();
        }
        *self.boundary.counts.entry(client).or_default() += 1;
    }

    fn push(&mut self, made: Awaited, step: u64) {
        let last = self.last(made.client);
        if last.is_some_and(|last| last.made.is_continued_by(made.what, made.stroke)) {
            return;
        }
        let (own, others): (Vec<_>, Vec<_>) =
            self.boundary.counts.iter().partition(|(client, _)| **client == Some(made.client));
        let sum =
            |counts: Vec<(&Option<ClientId>, &u32)>| counts.iter().map(|(_, count)| **count).sum();
        self.last_number += 1;
        self.entries.push_back(Entry {
            number: self.last_number,
            made,
            before: step.saturating_sub(1),
            own_before: sum(own),
            by_others: sum(others),
        });
        if self.entries.len() > UNDO_MAX {
            self.entries.pop_front();
        }
    }

    /// Forgets the oldest states beyond the limit. Their changes can still be undone by a rewind.
    fn limit_size(&mut self) {
        let made = self.entries.iter_mut().map(|entry| &mut entry.made);
        let mut newest_first: Vec<_> = made.chain(self.awaited.values_mut()).rev().collect();
        let mut size_bytes = 0;
        for made in &mut newest_first {
            size_bytes += made.kept.as_ref().map_or(0, KeptState::size_bytes);
            if size_bytes > UNDO_SIZE_BYTES_MAX {
                made.kept = None;
            }
        }
    }

    /// The newest change of a page.
    pub(super) fn last(&self, client: ClientId) -> Option<&Entry> {
        self.entries.iter().rev().find(|entry| entry.made.client == client)
    }

    /// The newest change of each page.
    pub(super) fn newest(&self) -> BTreeMap<ClientId, Option<Undoable>> {
        self.entries.iter().map(|entry| (entry.made.client, Some(entry.made.what))).collect()
    }

    pub(super) fn get(&self, number: u64) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.number == number)
    }

    /// Removes a change that was undone, and all that went with it.
    pub(super) fn remove_from(&mut self, number: u64) -> Option<Entry> {
        let index = self.entries.iter().position(|entry| entry.number == number)?;
        let mut removed = self.entries.split_off(index).into_iter();
        let undone = removed.next()?;
        // A pause has one step, whose changes go together.
        let is_same =
            |entry: &Entry| entry.made.load == undone.made.load && entry.before >= undone.before;
        while self.entries.back().is_some_and(is_same) {
            self.entries.pop_back();
        }
        Some(undone)
    }

    /// Forgets what a page could undo.
    pub(super) fn remove_client(&mut self, client: ClientId) {
        self.entries.retain(|entry| entry.made.client != client);
        self.awaited.retain(|_, awaited| awaited.client != client);
    }

    /// Forgets everything: the node has ended.
    pub(super) fn clear(&mut self) {
        *self = Self { last_number: self.last_number, ..Self::default() };
    }
}
