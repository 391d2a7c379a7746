//! The connection to one run of a node.

mod known;
mod statistics;
#[cfg(test)]
mod tests;

use std::time::Duration;

use recorder::{Message, OutcomeRow, StatusRow, StepRow, Topic};
use sim_contract::clock::{SECOND_NS, monotonic_ns};
use sim_contract::{
    Action, AttachError, Client, ColliderState, Endpoint, NodeStatus, Snapshot, SnapshotFlags,
    StatusFlags, Tap,
};

use super::actions::Context;
use super::dispatch::Dispatch;
use super::load::{Parts, is_of};
use super::news::News;
use super::waiting::Waiting;
use crate::limits::{FRAMES_PER_SECOND_MAX, RELEASE_TIMEOUT};
use crate::message::{Level, Node, NodeState, ToPage};
use crate::pages::hub::Hub;
use crate::pages::hub::Slot;
use crate::scene::load::Load;
use crate::shown_state::{Stage, single};
use crate::source::{Ask, Request, Requests};
use crate::wire::{FrameHead, Stamp, frame_flag};
use known::Known;

/// Time from a frame to the next, less a little: a node of the display's rate is met each time.
const FRAME_PERIOD_NS: u64 = SECOND_NS / FRAMES_PER_SECOND_MAX as u64 - SECOND_NS / 1000;
/// How long a frame that is due waits for a fresh state; commands wait with it.
const FRESH_STATE_WAIT: Duration = Duration::from_millis(5);
/// How often the node is looked at while nobody waits for a frame.
const IDLE_PERIOD: Duration = Duration::from_millis(50);
/// How often the owner is looked for.
const OWNER_LOOK_NS: u64 = SECOND_NS / 5;
/// How often statistics are sent.
const STATISTICS_PERIOD_NS: u64 = SECOND_NS / 4;
/// Requests that are taken before the node is looked at again.
const REQUESTS_PER_ROUND_MAX: usize = 1024;

/// Why a link ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum LinkEnd {
    /// The server ends.
    Closed,
    /// The node has gone; or what went wrong.
    Lost(Option<String>),
    /// Another run has the name.
    NewRun,
}

/// Tears and colliders, until the state that shows them is there.
#[derive(Debug, Default)]
struct Changes {
    torn: Waiting<Vec<u32>>,
    causes: Waiting<Vec<u8>>,
    colliders: Waiting<Vec<ColliderState>>,
}

impl Changes {
    fn take(&mut self, news: News) {
        for (header, torn) in news.tears {
            self.torn.add(header.step, torn);
        }
        for (header, causes) in news.tear_causes {
            self.causes.add(header.step, causes);
        }
        for (header, colliders) in news.colliders {
            self.colliders.add(header.step, colliders);
        }
    }
}

/// The connection to one run of a node.
#[derive(Debug)]
pub(super) struct Link {
    tap: Tap,
    client: Client,
    run_id: Option<u64>,
    parts: Parts,
    load: Option<Load>,
    /// The newest state, in shared memory.
    snapshot: Option<Snapshot>,
    status: Option<NodeStatus>,
    known: Known,
    dispatch: Dispatch,
    is_torn: Vec<bool>,
    /// Why constraints tore, in the order of tearing.
    causes: Vec<u8>,
    changes: Changes,
    /// The state that was shown last.
    shown_step: Option<u64>,
    due_ns: u64,
    next_owner_look_ns: u64,
    next_statistics_ns: u64,
}

impl Link {
    pub(super) fn attach(endpoint: &Endpoint) -> Result<Self, AttachError> {
        Ok(Self {
            tap: Tap::attach(endpoint)?,
            client: Client::attach(endpoint)?,
            run_id: None,
            parts: Parts::default(),
            load: None,
            snapshot: None,
            status: None,
            known: Known::default(),
            dispatch: Dispatch::default(),
            is_torn: Vec::new(),
            causes: Vec::new(),
            changes: Changes::default(),
            shown_step: None,
            due_ns: 0,
            next_owner_look_ns: 0,
            next_statistics_ns: 0,
        })
    }

    /// Takes requests until a frame is due, then reads the node, and shows what it has.
    pub(super) fn round(
        &mut self,
        stage: &mut Stage,
        hub: &Hub,
        requests: &Requests,
    ) -> Result<(), LinkEnd> {
        let is_awaited = hub.demand(self.particle_count()).is_any();
        self.take_requests(stage, hub, requests, is_awaited);
        // What had no room the last time has some now, whether pages ask for more or not.
        self.dispatch.flush(&mut self.client, hub);
        let is_due = is_awaited && monotonic_ns() >= self.due_ns;
        if is_due && self.is_fast() {
            // There is always a state that was not shown; this waits for one that comes now. What
            // woke before is read below.
            self.tap.wait(Duration::ZERO);
            self.tap.wait(FRESH_STATE_WAIT);
        }
        self.read(stage, hub)?;
        if is_due && !self.has_news() {
            self.tap.wait(FRESH_STATE_WAIT);
            self.read(stage, hub)?;
        }
        self.show(stage, hub);
        let now_ns = monotonic_ns();
        self.dispatch.expire(hub, now_ns);
        if now_ns >= self.next_statistics_ns {
            self.next_statistics_ns = now_ns + STATISTICS_PERIOD_NS;
            self.tell_statistics(stage, hub);
        }
        if hub.is_closed() {
            return Err(LinkEnd::Closed);
        }
        self.look_for_owner(now_ns)
    }

    /// Whether a fresh state comes within the wait for one.
    fn is_fast(&self) -> bool {
        let pace_hz = |status: &NodeStatus| f64::from(status.rate_hz) * status.time_scale;
        let is_stepping = |status: &&NodeStatus| !status.is_paused();
        let pace_hz = self.status.as_ref().filter(is_stepping).map_or(0.0, pace_hz);
        pace_hz * FRESH_STATE_WAIT.as_secs_f64() >= 1.0
    }

    /// Whether there is a state that was not shown.
    fn has_news(&self) -> bool {
        let newest = self.snapshot.as_ref().map(|snapshot| snapshot.header().step);
        newest != self.shown_step
    }

    fn look_for_owner(&mut self, now_ns: u64) -> Result<(), LinkEnd> {
        if now_ns < self.next_owner_look_ns {
            return Ok(());
        }
        self.next_owner_look_ns = now_ns + OWNER_LOOK_NS;
        if self.tap.is_owner_alive() { Ok(()) } else { Err(LinkEnd::Lost(None)) }
    }

    /// Answers what pages ask for until the next frame is due; while nobody waits for one, a while.
    fn take_requests(&mut self, stage: &Stage, hub: &Hub, requests: &Requests, is_awaited: bool) {
        for _ in 0..REQUESTS_PER_ROUND_MAX {
            let until_due = Duration::from_nanos(self.due_ns.saturating_sub(monotonic_ns()));
            let timeout = if is_awaited { until_due } else { IDLE_PERIOD };
            let Some(request) = requests.next(timeout) else { return };
            let is_new_demand = matches!(request.ask, Ask::Frame | Ask::Credit);
            self.take(request, stage, hub);
            self.dispatch.flush(&mut self.client, hub);
            if is_new_demand {
                return;
            }
        }
    }

    fn take(&mut self, request: Request, stage: &Stage, hub: &Hub) {
        match request.ask {
            Ask::Frame => self.shown_step = None,
            Ask::Credit => {}
            Ask::Left => self.dispatch.leave(request.client),
            Ask::Command { id, command } => {
                let context = Context {
                    epoch: stage.epoch(),
                    rate_hz: self.load.as_ref().map_or(1, |load| load.header.rate_hz.max(1)),
                    is_planar: self.load.as_ref().is_some_and(|load| load.summary.is_planar),
                    particles: self.snapshot.as_ref().map_or(&[], Snapshot::particles),
                };
                let answer = self.dispatch.take(request.client, id, command, context);
                if let Some((client, outcome)) = answer {
                    hub.send(client, &ToPage::Outcome(outcome));
                }
            }
        }
    }

    /// Reads what has come. The snapshot first: then all that it builds on is among the rest.
    fn read(&mut self, stage: &mut Stage, hub: &Hub) -> Result<(), LinkEnd> {
        // One that cannot be read is dropped; the next one comes.
        if let Ok(Some(snapshot)) = self.tap.latest_snapshot() {
            self.snapshot = Some(snapshot);
        }
        let mut news = News::drain(&mut self.tap);
        self.check_run(&news)?;
        self.take_outcomes(&news, hub);
        self.parts.take(&mut news);
        if let Some(status) = &news.status {
            hub.say(Topic::Status, || Message::Status(StatusRow::from(status)));
        }
        self.status = news.status.or(self.status);
        self.changes.take(news);
        self.begin_load(stage, hub);
        self.known.set_time_scale(self.status.as_ref());
        self.known.tell(hub);
        self.set_changes(stage, hub);
        Ok(())
    }

    /// Notices another run of the node: everything is begun anew then.
    fn check_run(&mut self, news: &News) -> Result<(), LinkEnd> {
        let snapshot = || self.snapshot.as_ref().map(|one| one.header().run_id);
        let Some(run_id) = news.run_id().or_else(snapshot) else { return Ok(()) };
        match self.run_id.replace(run_id) {
            Some(known) if known != run_id => Err(LinkEnd::NewRun),
            _ => Ok(()),
        }
    }

    fn take_outcomes(&mut self, news: &News, hub: &Hub) {
        for outcome in &news.outcomes {
            hub.say(Topic::Outcomes, || Message::Outcome(OutcomeRow::from(outcome)));
            self.known.follow(outcome);
            let action = outcome.command.action();
            if outcome.is_applied() && matches!(action, Action::Reset | Action::Load { .. }) {
                self.dispatch.forget_holders();
                if action == Action::Reset {
                    hub.broadcast(&ToPage::Reset { step: outcome.step });
                }
            }
            if outcome.command.client_id == self.client.client_id() {
                self.dispatch.take_outcome(hub, outcome);
            }
        }
        // They have been read above; this makes room for the next ones.
        while let Ok(Some(_)) = self.client.next_outcome(Duration::ZERO) {}
    }

    /// Shows another load, once it is complete.
    fn begin_load(&mut self, stage: &mut Stage, hub: &Hub) {
        let Some(snapshot) = &self.snapshot else { return };
        let header = snapshot.header();
        match self.parts.complete(header) {
            None => {}
            Some(Err(text)) => {
                let text = text.to_owned();
                hub.broadcast(&ToPage::Notice { level: Level::Error, text });
            }
            Some(Ok(load)) => {
                stage.begin(hub, load.to_scene(header.step, snapshot.particles()));
                self.known.begin(load.summary.parameters, header.outcome_count);
                self.is_torn = vec![false; load.constraints.len()];
                self.load = Some(load);
                self.shown_step = None;
            }
        }
    }

    /// Puts tears, colliders and pins on the stage.
    fn set_changes(&mut self, stage: &mut Stage, hub: &Hub) {
        let Some((load, snapshot)) = self.on_show() else { return };
        let (shown_step, constraint_count) = (snapshot.header().step, load.constraints.len());
        stage.set_pins(hub, shown_step, snapshot.particles());
        if let Some((_, causes)) = self.changes.causes.take_until(shown_step) {
            self.causes = causes;
        }
        if let Some((step, torn)) = self.changes.torn.take_until(shown_step)
            && torn.iter().all(|constraint| (*constraint as usize) < constraint_count)
        {
            stage.set_torn(hub, step, &torn, &self.causes);
            self.is_torn = vec![false; constraint_count];
            for constraint in &torn {
                self.is_torn[*constraint as usize] = true;
            }
        }
        if let Some((step, colliders)) = self.changes.colliders.take_until(shown_step) {
            stage.set_colliders(step, &colliders);
        }
    }

    /// Load and newest state, if they belong together. Any process of the user can publish a state:
    /// one of another size is none of this load.
    fn on_show(&self) -> Option<(&Load, &Snapshot)> {
        let (load, snapshot) = (self.load.as_ref()?, self.snapshot.as_ref()?);
        let header = snapshot.header();
        is_of(&load.header, header).then_some((load, snapshot))
    }

    /// Shows the newest state, if it is due and was not shown.
    fn show(&mut self, stage: &mut Stage, hub: &Hub) {
        let Some((load, snapshot)) = self.on_show() else { return };
        let header = snapshot.header();
        let now_ns = monotonic_ns();
        let is_awaited = hub.demand(snapshot.particles().len()).is_any();
        if !is_awaited || self.shown_step == Some(header.step) || now_ns < self.due_ns {
            return;
        }
        let micros = |ns: u64| single(ns as f64 / 1000.0);
        let flag = |own: u32, flag: u32| if header.flags & own == 0 { 0 } else { flag };
        let head = FrameHead {
            stamp: Stamp { epoch: 0, step: header.step },
            sim_time_s: header.step as f64 / f64::from(load.header.rate_hz.max(1)),
            flags: flag(SnapshotFlags::PAUSED, frame_flag::PAUSED)
                | flag(SnapshotFlags::REPLAY, frame_flag::REPLAY),
            torn_count: header.torn_count,
            solve_us: micros(header.solve_ns),
            wake_late_us: micros(header.wake_late_ns),
            number: 0,
            publish_monotonic_ns: header.publish_monotonic_ns,
        };
        hub.say(Topic::Steps, || Message::Step(StepRow::from(header)));
        stage.show(hub, head, snapshot.particles());
        let step = header.step;
        self.shown_step = Some(step);
        self.due_ns = now_ns + FRAME_PERIOD_NS;
    }

    fn particle_count(&self) -> usize {
        self.snapshot.as_ref().map_or(0, |snapshot| snapshot.particles().len())
    }

    /// How the node stands, for pages.
    pub(super) fn node(&self) -> Node {
        let Some(status) = &self.status else {
            return Node {
                state: NodeState::Alive,
                text: "a node is there; it has not said anything yet".to_owned(),
                ..Node::default()
            };
        };
        Node {
            state: NodeState::Alive,
            text: String::new(),
            run_id: Some(format!("{:016x}", status.run_id)),
            scene: Some(status.scene_name()),
            method: self.load.as_ref().map(Load::method),
            rate_hz: status.rate_hz,
            is_paused: status.is_paused(),
            is_replay: status.flags & StatusFlags::REPLAY != 0,
            time_scale: status.time_scale,
            process_id: Some(status.process_id),
        }
    }

    /// Answers what is open; nobody else will. Where the node goes on without this bridge, it lets
    /// go of what pages hold.
    pub(super) fn leave(mut self, hub: &Hub, end: &LinkEnd) {
        self.dispatch.expire(hub, u64::MAX);
        if *end == LinkEnd::Closed {
            self.let_go(hub);
        }
        hub.latch(Slot::Parameters, &Known::default().to_message());
    }

    /// Pages cannot do this any more: their tasks end with the server. A node that does not answer
    /// is waited for only so long.
    fn let_go(&mut self, hub: &Hub) {
        self.dispatch.release_all();
        let wait_ns = u64::try_from(RELEASE_TIMEOUT.as_nanos()).unwrap_or(u64::MAX);
        let end_ns = monotonic_ns() + wait_ns;
        loop {
            self.dispatch.flush(&mut self.client, hub);
            let news = News::drain(&mut self.tap);
            self.take_outcomes(&news, hub);
            let left_ns = end_ns.saturating_sub(monotonic_ns());
            if !self.dispatch.is_releasing() || left_ns == 0 {
                return;
            }
            self.tap.wait(Duration::from_nanos(left_ns).min(IDLE_PERIOD));
        }
    }
}
