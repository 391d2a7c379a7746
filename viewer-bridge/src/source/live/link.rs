//! The connection to one run of a node.

use std::sync::Arc;
use std::time::Duration;

use recording::{StatusRow, StepRow};
use sim_contract::{
    Action, AttachError, Client, Endpoint, NodeStatus, Parameter, ParameterValues, SnapshotFlags,
    Tap,
};
use sim_host::clock::{SECOND_NS, monotonic_ns};

use super::actions::CommandContext;
use super::carrier::{Carrier, LiftState};
use super::dispatch::Dispatch;
use super::newest_state::{LoadedState, NewestState, Updates};
use super::outcomes::{HeldByClients, handle_outcomes};
use super::status::{node_text, statistics};
use super::undo::kept_state::Keyframes;
use super::undo::stack::Change;
use super::undo::{Undo, UndoRequest};
use crate::limits::{FRAMES_PER_SECOND_MAX, RELEASE_TIMEOUT};
use crate::message::{Command, CommandKind, Level, Node, OutcomeText, ParametersText, Refusal};
use crate::request::{ClientId, Request, RequestKind, Requests};
use crate::scene::catalog::Catalog;
use crate::sink::{Demand, Sinks, State, Update};
use crate::source::shown_state::ShownState;
use crate::wire::frame_flag;

/// Time between two frames. It is slightly shorter than the display's period, so that a node with the
/// rate of the display shows every state.
const FRAME_PERIOD_NS: u64 = SECOND_NS / FRAMES_PER_SECOND_MAX as u64 - SECOND_NS / 1000;
/// Time that a due frame waits for a fresh state. Commands wait as well.
const FRESH_STATE_WAIT: Duration = Duration::from_millis(5);
/// Time between two reads while no client waits for a frame.
const IDLE_PERIOD: Duration = Duration::from_millis(50);
/// Time between two checks of the owner.
const OWNER_CHECK_NS: u64 = SECOND_NS / 5;
/// Time between two statistics.
const STATISTICS_PERIOD_NS: u64 = SECOND_NS / 4;
/// Requests that are handled before the node is read again.
const REQUESTS_AT_ONCE_MAX: usize = 1024;

/// The reason for the end of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LinkEnd {
    /// The program ends.
    ShuttingDown,
    /// The node has ended.
    Lost,
    /// Another run owns the services.
    NewRun,
}

/// A state of a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ShownId {
    epoch: u32,
    step: u64,
}

/// The connection to one run of a node.
#[derive(Debug)]
pub(super) struct Link {
    tap: Tap,
    pub(super) client: Client,
    run_id: Option<u64>,
    newest: NewestState,
    status: Option<NodeStatus>,
    parameters: Option<ParameterValues>,
    /// A client wants the forces, so that the tap reads them.
    reads_forces: bool,
    /// The parameters that were published last.
    published_parameters: Option<ParametersText>,
    pub(super) dispatch: Dispatch,
    pub(super) carrier: Carrier,
    catalog: Arc<Catalog>,
    /// It outlives the link: a load can begin another run.
    pub(super) undo: Undo,
    keyframes: Keyframes,
    shown_id: Option<ShownId>,
    pub(super) next_frame_ns: u64,
    next_owner_check_ns: u64,
    next_statistics_ns: u64,
}

impl Link {
    pub(super) fn attach(endpoint: &Endpoint, catalog: &Arc<Catalog>) -> Result<Self, AttachError> {
        Ok(Self {
            tap: Tap::attach(endpoint)?,
            client: Client::attach(endpoint)?,
            run_id: None,
            newest: NewestState::default(),
            status: None,
            parameters: None,
            reads_forces: false,
            published_parameters: None,
            dispatch: Dispatch::new(Arc::clone(catalog)),
            carrier: Carrier::default(),
            catalog: Arc::clone(catalog),
            undo: Undo::default(),
            keyframes: Keyframes::default(),
            shown_id: None,
            next_frame_ns: 0,
            next_owner_check_ns: 0,
            next_statistics_ns: 0,
        })
    }

    /// Handles requests until a frame is due, then reads the node and shows its newest state.
    pub(super) fn exchange(
        &mut self,
        shown: &mut ShownState,
        sinks: &Sinks,
        requests: &Requests,
    ) -> Result<(), LinkEnd> {
        self.handle_requests(shown, sinks, requests);
        // Commands that found the node's queue full are sent now, even without new requests.
        self.dispatch.flush(&mut self.client, sinks);
        self.follow_forces(sinks);
        let is_due = sinks.has_demand(Demand::State) && monotonic_ns() >= self.next_frame_ns;
        if self.carrier.is_moving() {
            self.tap.wait(FRESH_STATE_WAIT);
        } else if is_due && self.is_fast() {
            // A fast node always has a state that was not shown. The first wait clears the wake-ups
            // of the past, the second one waits for the next state.
            self.tap.wait(Duration::ZERO);
            self.tap.wait(FRESH_STATE_WAIT);
        }
        self.read(shown, sinks)?;
        if is_due && !self.has_new_state(shown) {
            self.tap.wait(FRESH_STATE_WAIT);
            self.read(shown, sinks)?;
        }
        self.move_carried(sinks);
        self.show(shown, sinks);
        let now_ns = monotonic_ns();
        self.dispatch.expire(sinks, now_ns);
        if now_ns >= self.next_statistics_ns {
            self.next_statistics_ns = now_ns + STATISTICS_PERIOD_NS;
            self.publish_statistics(shown, sinks);
        }
        if sinks.is_shutting_down() {
            return Err(LinkEnd::ShuttingDown);
        }
        self.check_owner(now_ns)
    }

    /// Sends the poses of carried objects for the next step.
    pub(super) fn move_carried(&mut self, sinks: &Sinks) {
        let Some(state) = self.newest.get() else { return };
        let moves = self.carrier.advance(&state);
        if !moves.is_empty() {
            self.dispatch.add_moves(moves);
            self.dispatch.flush(&mut self.client, sinks);
        }
    }

    /// Reads the forces while a client wants them: a reader costs the node time.
    pub(super) fn follow_forces(&mut self, sinks: &Sinks) {
        let is_wanted = sinks.has_demand(Demand::Forces);
        if is_wanted == self.reads_forces {
            return;
        }
        self.reads_forces = is_wanted;
        if !is_wanted {
            self.tap.end_forces();
        } else if let Err(error) = self.tap.read_forces() {
            let text = format!("the forces cannot be read: {error}");
            sinks.publish(&Update::Notice { level: Level::Warning, text: &text });
        }
    }

    /// Returns whether the node makes a state within [`FRESH_STATE_WAIT`].
    fn is_fast(&self) -> bool {
        let running = self.status.as_ref().filter(|status| !status.is_paused());
        running.is_some_and(|status| {
            let pace_hz = f64::from(status.rate_hz) * status.time_scale;
            pace_hz * FRESH_STATE_WAIT.as_secs_f64() >= 1.0
        })
    }

    fn has_new_state(&self, shown: &ShownState) -> bool {
        let id = |state: LoadedState<'_>| ShownId { epoch: shown.epoch(), step: state.header.step };
        self.newest.get().map(id) != self.shown_id
    }

    fn check_owner(&mut self, now_ns: u64) -> Result<(), LinkEnd> {
        if now_ns < self.next_owner_check_ns {
            return Ok(());
        }
        self.next_owner_check_ns = now_ns + OWNER_CHECK_NS;
        if self.tap.is_owner_alive() { Ok(()) } else { Err(LinkEnd::Lost) }
    }

    /// Handles requests until the next frame is due, or for a while if no client waits for one.
    fn handle_requests(&mut self, shown: &ShownState, sinks: &Sinks, requests: &Requests) {
        let is_awaited = sinks.has_demand(Demand::State);
        for _ in 0..REQUESTS_AT_ONCE_MAX {
            let until_due_ns = self.next_frame_ns.saturating_sub(monotonic_ns());
            let timeout = match is_awaited {
                // The next step is waited for instead.
                _ if self.carrier.is_moving() => Duration::ZERO,
                true => Duration::from_nanos(until_due_ns),
                false => IDLE_PERIOD,
            };
            let Some(request) = requests.next(timeout) else { return };
            let is_new_demand = matches!(request.kind, RequestKind::State | RequestKind::Credit);
            self.handle(request, shown, sinks);
            self.dispatch.flush(&mut self.client, sinks);
            if is_new_demand {
                return;
            }
        }
    }

    pub(super) fn handle(&mut self, request: Request, shown: &ShownState, sinks: &Sinks) {
        let client = request.client;
        match request.kind {
            RequestKind::State => self.shown_id = None,
            RequestKind::Credit => {}
            RequestKind::Left => {
                self.dispatch.remove_client(client);
                self.carrier.remove_client(client);
                self.undo.remove_client(client);
            }
            RequestKind::Command(command) => self.obey(client, &command, shown, sinks),
        }
    }

    fn obey(&mut self, client: ClientId, command: &Command, shown: &ShownState, sinks: &Sinks) {
        let (id, kind) = (command.id, &command.kind);
        match *kind {
            CommandKind::Undo { takes_others } => {
                let request = UndoRequest { client, id, takes_others };
                let answer = self.undo.begin(request, self.newest.get(), &mut self.client);
                match answer {
                    Some(outcome) => {
                        sinks.publish(&Update::Answer { client, outcome: &outcome });
                    }
                    None => self.carrier.clear(),
                }
            }
            CommandKind::Lift { .. } | CommandKind::Carry { .. } | CommandKind::Throw { .. } => {
                let outcome = match self.carry(client, command, shown) {
                    Ok(()) => OutcomeText::applied(id, kind.name()),
                    Err(reason) => OutcomeText::refused(id, kind.name(), reason),
                };
                // A motion that begins does so with the next step.
                self.move_carried(sinks);
                if id.is_some() || outcome.applied == 0 {
                    sinks.publish(&Update::Answer { client, outcome: &outcome });
                }
            }
            _ => self.submit(client, command, shown, sinks),
        }
    }

    /// Lifts, carries or releases an object for a client.
    fn carry(
        &mut self,
        client: ClientId,
        command: &Command,
        shown: &ShownState,
    ) -> Result<(), Refusal> {
        if self.status.as_ref().is_some_and(NodeStatus::is_replay) {
            return Err(Refusal::OnlyLive);
        }
        let state = self.newest.get().ok_or(Refusal::NoNode)?;
        match command.kind {
            CommandKind::Lift { epoch, .. } if epoch != shown.epoch() => Err(Refusal::StaleEpoch),
            CommandKind::Lift { object, index, .. } => {
                let place = LiftState { state: &state, colliders: shown.colliders() };
                let object = object.at(index);
                self.carrier.lift(client, object, place)?;
                let known = (&self.keyframes, &*self.catalog);
                let prepared = self.undo.prepare(client, command, &state, known);
                // The whole way is one change.
                let step = state.header.step + 1;
                let change = Change { step, client: Some(client), command: None };
                self.undo.add_carrying(change, prepared);
                Ok(())
            }
            CommandKind::Carry { object, index, offset, over_s } => {
                let steps = f64::from(over_s) * f64::from(state.load.header.rate_hz.max(1));
                self.carrier.carry(client, object.at(index), offset, steps)
            }
            CommandKind::Throw { object, index, velocity } => {
                self.carrier.throw(client, object.at(index), velocity)
            }
            _ => Ok(()),
        }
    }

    /// Gives a command to the dispatch. Keeps the state before a change that can be undone.
    fn submit(&mut self, client: ClientId, command: &Command, shown: &ShownState, sinks: &Sinks) {
        let state = self.newest.get();
        let context = CommandContext {
            epoch: shown.epoch(),
            rate_hz: state.map_or(1, |state| state.load.header.rate_hz.max(1)),
            is_planar: state.is_some_and(|state| state.load.summary.is_planar),
            is_replay: self.status.as_ref().is_some_and(NodeStatus::is_replay),
            particles: state.map_or(&[], |state| state.particles),
        };
        let known = (&self.keyframes, &*self.catalog);
        let awaited = state.and_then(|state| self.undo.prepare(client, command, &state, known));
        let is_restart = matches!(
            command.kind,
            CommandKind::Action(Action::Reset | Action::Load { .. } | Action::Rewind { .. })
        );
        let before = self.dispatch.last_command();
        if let Some(outcome) = self.dispatch.submit(client, command, context) {
            sinks.publish(&Update::Answer { client, outcome: &outcome });
        }
        let number = self.dispatch.last_command();
        if is_restart && number != before {
            // No move may follow it in the node's queue.
            self.carrier.clear();
        }
        if let Some(awaited) = awaited.filter(|_| number != before) {
            self.undo.await_outcome(number, awaited);
        }
    }

    /// Reads everything that has arrived.
    pub(super) fn read(&mut self, shown: &mut ShownState, sinks: &Sinks) -> Result<(), LinkEnd> {
        let mut updates = Updates::for_run(self.run_id);
        let state = self.tap.latest_state(|update| updates.add(update));
        let run_id = state.map(|state| state.header.run_id).or(updates.run_id);
        let run = check_run(&mut self.run_id, run_id);
        // A client that waits for an answer sees the effect of its command after the answer. The last
        // answers of a run arrive together with the first messages of the next one.
        handle_outcomes(
            HeldByClients {
                dispatch: &mut self.dispatch,
                carrier: &mut self.carrier,
                undo: &mut self.undo,
            },
            &mut self.client,
            self.newest.get(),
            &updates.outcomes,
            sinks,
        );
        if let (Some(state), Ok(())) = (state, run) {
            self.newest.update(&state, shown, sinks);
        }
        if let Some(status) = &updates.status {
            sinks.publish(&Update::Status(&StatusRow::from(status)));
            self.status = Some(*status);
        }
        run?;
        updates.keyframes.into_iter().for_each(|(step, bytes)| self.keyframes.add(step, bytes));
        self.undo.follow(self.newest.get(), &mut self.client, sinks);
        if updates.parameters.is_some() {
            self.parameters = updates.parameters;
        }
        self.publish_parameters(sinks);
        Ok(())
    }

    /// Publishes the parameters of the load on show if they have changed. They take effect at once, even
    /// if the node is paused, so they do not wait for a state.
    fn publish_parameters(&mut self, sinks: &Sinks) {
        let Some(state) = self.newest.get() else { return };
        let summary = &state.load.summary;
        let text = ParametersText {
            is_complete: true,
            values: self.parameters.clone(),
            initial: Some(summary.parameters.clone()),
            initial_colliders: summary.surfaces.clone(),
        };
        if self.published_parameters.as_ref() != Some(&text) {
            sinks.publish(&Update::Parameters(&text));
            self.published_parameters = Some(text);
        }
    }

    /// Shows the newest state, if a frame is due and the state is new.
    pub(super) fn show(&mut self, shown: &ShownState, sinks: &Sinks) {
        let Some(LoadedState { load, header, particles, forces }) = self.newest.get() else {
            return;
        };
        let now_ns = monotonic_ns();
        let id = ShownId { epoch: shown.epoch(), step: header.step };
        let is_due = now_ns >= self.next_frame_ns && self.shown_id != Some(id);
        if !is_due || !sinks.has_demand(Demand::State) {
            return;
        }
        let flag = |own: u32, flag: u32| if header.flags & own == 0 { 0 } else { flag };
        let state = State {
            ghost: None,
            epoch: shown.epoch(),
            row: StepRow::from(header),
            sim_time_s: header.step as f64 / f64::from(load.header.rate_hz.max(1)),
            flags: flag(SnapshotFlags::PAUSED, frame_flag::PAUSED)
                | flag(SnapshotFlags::REPLAY, frame_flag::REPLAY),
            publish_monotonic_ns: header.publish_monotonic_ns,
            particles,
            forces,
        };
        shown.show(sinks, state);
        self.shown_id = Some(id);
        self.next_frame_ns = now_ns + FRAME_PERIOD_NS;
    }

    pub(super) fn publish_statistics(&self, shown: &ShownState, sinks: &Sinks) {
        if !sinks.has_demand(Demand::Statistics) {
            return;
        }
        if let (Some(status), Some(state)) = (&self.status, self.newest.get()) {
            let gravity = self.parameters.as_ref();
            let gravity = gravity.map_or([0.0; 3], |values| values.vector(Parameter::Gravity));
            let statistics = statistics(status, state, shown, gravity);
            sinks.publish(&Update::Statistics(&statistics));
        }
    }

    /// The state of the node for clients.
    pub(super) fn node(&self) -> Node {
        node_text(self.status.as_ref(), self.newest.get().map(|state| state.load.method()))
    }

    /// Answers the open commands. If the node goes on without this bridge, ends the clients' grabs.
    /// Returns what pages can undo.
    pub(super) fn close(mut self, sinks: &Sinks, end: LinkEnd) -> Undo {
        self.dispatch.expire(sinks, u64::MAX);
        if end == LinkEnd::ShuttingDown {
            self.release_grabs(sinks);
        }
        sinks.publish(&Update::Parameters(&ParametersText::UNKNOWN));
        self.undo.end_run(end == LinkEnd::NewRun, sinks);
        self.undo
    }

    /// Releases all grabs, because the tasks of the clients end with the server. Waits for the node no
    /// longer than [`RELEASE_TIMEOUT`].
    fn release_grabs(&mut self, sinks: &Sinks) {
        self.dispatch.release_all();
        let wait_ns = u64::try_from(RELEASE_TIMEOUT.as_nanos()).unwrap_or(u64::MAX);
        let end_ns = monotonic_ns() + wait_ns;
        loop {
            self.dispatch.flush(&mut self.client, sinks);
            let mut updates = Updates::for_run(self.run_id);
            self.tap.latest_state(|update| updates.add(update));
            handle_outcomes(
                HeldByClients {
                    dispatch: &mut self.dispatch,
                    carrier: &mut self.carrier,
                    undo: &mut self.undo,
                },
                &mut self.client,
                None,
                &updates.outcomes,
                sinks,
            );
            let left_ns = end_ns.saturating_sub(monotonic_ns());
            if !self.dispatch.is_releasing() || left_ns == 0 {
                return;
            }
            self.tap.wait(Duration::from_nanos(left_ns).min(IDLE_PERIOD));
        }
    }
}

/// Ends the link if the messages belong to another run.
fn check_run(known: &mut Option<u64>, run_id: Option<u64>) -> Result<(), LinkEnd> {
    let Some(run_id) = run_id else { return Ok(()) };
    match known.replace(run_id) {
        Some(known) if known != run_id => Err(LinkEnd::NewRun),
        _ => Ok(()),
    }
}
