//! Plays a recording for pages: obeys them, winds the tape to where the timeline stands, and shows
//! what is there.

use std::sync::mpsc::Receiver;
use std::time::Duration;

use recorder::{Message, ReadError, TapeState, Topic};
use sim_contract::PlainF32;
use sim_contract::clock::{SECOND_NS, monotonic_ns};

use super::Replay;
use super::check::Report;
use super::playhead::{Passed, Playhead};
use crate::limits::FRAMES_PER_SECOND_MAX;
use crate::message::reason;
use crate::message::{
    Command, Hashes, Level, Node, NodeState, OutcomeText, ParametersText, Playback, Status,
    Timeline, ToPage,
};
use crate::pages::hub::Hub;
use crate::pages::hub::Slot;
use crate::shown_state::{Stage, single};
use crate::source::{Ask, Request, Requests};
use crate::wire::{FrameHead, Stamp, frame_flag};

/// Time from a frame to the next.
const FRAME_PERIOD_NS: u64 = SECOND_NS / FRAMES_PER_SECOND_MAX as u64;
/// How often the end of the server is looked for while nothing is to do.
const IDLE_PERIOD: Duration = Duration::from_millis(50);
/// How often statistics are sent.
const STATISTICS_PERIOD_NS: u64 = SECOND_NS / 4;
/// Requests that are taken before the tape is wound: of many seeks, the last one counts.
const REQUESTS_PER_ROUND_MAX: usize = 1024;

/// Plays a recording.
#[derive(Debug)]
pub(super) struct Player<'a> {
    pub(super) replay: &'a mut Replay,
    pub(super) hub: &'a Hub,
    reports: Receiver<Report>,
    report: Report,
    pub(super) stage: Stage,
    pub(super) playhead: Playhead,
    /// What is on show.
    pub(super) state: TapeState,
    pub(super) parameters: Option<ParametersText>,
    /// What they follow from: how many changes of the recording, and the pace.
    parameters_of: Option<(Option<usize>, f32)>,
    /// Commands that were obeyed, to be answered with the step that shows it.
    answers: Vec<(u32, OutcomeText)>,
    /// Whether pages are to be told how the recording is played.
    is_changed: bool,
    /// The state that was shown last.
    shown_step: Option<u64>,
    due_ns: u64,
    next_statistics_ns: u64,
}

impl<'a> Player<'a> {
    /// Stands at the first step.
    pub(super) fn new(replay: &'a mut Replay, reports: Receiver<Report>, hub: &'a Hub) -> Self {
        let (tape, state) = (&replay.tape, replay.first.clone());
        let playhead = Playhead::new(tape.first_step(), tape.last_step(), tape.run().rate_hz);
        let report = Report {
            marks: Vec::new(),
            hashes: Hashes::Checking,
            hash_text: "checking hashes".to_owned(),
            settings: None,
        };
        Self {
            replay,
            hub,
            reports,
            report,
            stage: Stage::default(),
            playhead,
            state,
            parameters: None,
            parameters_of: None,
            answers: Vec::new(),
            is_changed: true,
            shown_step: None,
            due_ns: 0,
            next_statistics_ns: 0,
        }
    }

    /// Plays until the server ends.
    pub(super) fn run(mut self, requests: &Requests) -> Result<(), ReadError> {
        let scene = self.replay.load.to_scene(self.state.row.step, &self.state.particles);
        self.tell_timeline();
        self.tell_playback();
        self.stage.begin(self.hub, scene);
        self.set_changes();
        while !self.hub.is_closed() {
            self.take_requests(requests)?;
            self.take_reports();
            let now_ns = monotonic_ns();
            if self.playhead.advance(now_ns) == Passed::End {
                self.is_changed = true;
            }
            if self.is_awaited() || self.is_changed {
                self.wind(now_ns)?;
            }
            if self.is_changed {
                self.tell_playback();
            }
            self.show(now_ns);
            self.answer();
            self.tell_statistics_if_due(now_ns);
        }
        Ok(())
    }

    /// Whether a page waits for a frame.
    fn is_awaited(&self) -> bool {
        self.hub.demand(self.state.particles.len()).is_any()
    }

    /// Takes what pages ask for, until the next frame is due or something is to be shown.
    fn take_requests(&mut self, requests: &Requests) -> Result<(), ReadError> {
        let until_due = Duration::from_nanos(self.due_ns.saturating_sub(monotonic_ns()));
        let is_going = self.playhead.is_playing && self.is_awaited();
        let mut timeout = if is_going { until_due } else { IDLE_PERIOD };
        for _ in 0..REQUESTS_PER_ROUND_MAX {
            let Some(request) = requests.next(timeout) else { break };
            self.take(request)?;
            timeout = Duration::ZERO;
        }
        Ok(())
    }

    fn take(&mut self, Request { client, ask }: Request) -> Result<(), ReadError> {
        match ask {
            Ask::Frame => self.shown_step = None,
            // Nothing is held.
            Ask::Credit | Ask::Left => {}
            Ask::Command { id, command } => {
                let result = self.obey(&command)?;
                let outcome = outcome(id, &command, result);
                if result.is_ok() {
                    self.is_changed = true;
                    self.answers.push((client, outcome));
                } else {
                    self.hub.send(client, &ToPage::Outcome(outcome));
                }
            }
        }
        Ok(())
    }

    /// Obeys, or says why not: a recording cannot be changed.
    fn obey(&mut self, command: &Command) -> Result<Result<(), &'static str>, ReadError> {
        let now_ns = monotonic_ns();
        let head = &mut self.playhead;
        match command {
            Command::Pause {} => head.pause(now_ns),
            Command::Resume {} => head.resume(now_ns),
            Command::Rate { value } => head.set_rate(*value, now_ns),
            Command::Loop { is_on } => head.is_looping = *is_on,
            Command::Seek { step } => {
                let step = self.replay.tape.step_at(*step)?;
                head.go_to(step, now_ns);
            }
            Command::Step { .. } if head.is_playing => return Ok(Err("no_effect_here")),
            Command::Step { count } => {
                let step = self.step_by(*count, now_ns)?;
                self.playhead.go_to(step, now_ns);
            }
            _ => return Ok(Err(reason::ONLY_LIVE)),
        }
        Ok(Ok(()))
    }

    /// The recorded step that many recorded ones on, or back.
    fn step_by(&mut self, count: i32, now_ns: u64) -> Result<u64, ReadError> {
        let tape = &mut self.replay.tape;
        let here = tape.step_at(self.playhead.step(now_ns))?;
        let distance = u64::from(count.unsigned_abs()).saturating_mul(tape.stride());
        if count < 0 {
            return tape.step_at(here.saturating_sub(distance));
        }
        let there = tape.step_at(here.saturating_add(distance))?;
        // Where steps are missing, the next one is further away.
        if there > here { Ok(there) } else { tape.step_after(here) }
    }

    /// Winds the tape to where the timeline stands.
    fn wind(&mut self, now_ns: u64) -> Result<(), ReadError> {
        let step = self.replay.tape.step_at(self.playhead.step(now_ns))?;
        if step != self.state.row.step {
            match self.replay.tape.state_at(step) {
                Ok(state) => self.set_state(state),
                Err(recorder::TapeError::Read(error)) => return Err(error),
                // It was readable when it was looked for: what is on show stays.
                Err(_) => {}
            }
        }
        for text in self.replay.tape.drain_faults() {
            let text = format!("{}: {text}; it is left out", self.replay.file);
            self.hub.broadcast(&ToPage::Notice { level: Level::Warning, text });
        }
        Ok(())
    }

    fn set_state(&mut self, state: TapeState) {
        // The step at which the scene of a state was at its beginning.
        let beginning = |state: &TapeState| state.row.step.wrapping_sub(state.row.scene_step);
        let is_other_beginning = beginning(&state) != beginning(&self.state);
        self.state = state;
        self.set_changes();
        if is_other_beginning {
            self.hub.broadcast(&ToPage::Reset { step: self.state.row.step });
        }
    }

    /// Puts pins, tears, colliders and parameters on the stage.
    fn set_changes(&mut self) {
        let (state, hub, step) = (&self.state, self.hub, self.state.row.step);
        self.stage.set_pins(hub, step, &state.particles);
        let constraint_count = self.replay.load.constraints.len();
        let torn = &state.torn.constraints;
        if torn.iter().all(|constraint| (*constraint as usize) < constraint_count) {
            let causes = state.torn.causes.iter();
            let causes: Vec<_> =
                causes.map(|cause| cause.map_or(u8::MAX, |cause| cause as u8)).collect();
            self.stage.set_torn(hub, step, torn, &causes);
        }
        if let Some(row) = &state.colliders {
            self.stage.set_colliders(step, &row.states());
        }
        self.set_parameters();
    }

    /// The parameters at this step, once all that was set is known.
    fn set_parameters(&mut self) {
        let settings = self.report.settings.as_ref();
        let count = settings.map(|log| log.count_until(self.state.row.step));
        let of = Some((count, self.playhead.rate));
        if of == self.parameters_of {
            return;
        }
        self.parameters_of = of;
        let initial = self.replay.load.summary.parameters;
        let (mut values, is_complete) = match settings.zip(count) {
            Some((log, count)) => log.after(count, initial),
            None => (initial, false),
        };
        values.time_scale = PlainF32(self.playhead.rate);
        let text = ParametersText { is_complete, values: Some(values), initial: Some(initial) };
        self.hub.latch(Slot::Parameters, &ToPage::Parameters(Box::new(text.clone())));
        self.parameters = Some(text);
    }

    /// Shows the state, if it was not shown: at once where a page asked for it.
    fn show(&mut self, now_ns: u64) {
        let row = self.state.row;
        let is_due = now_ns >= self.due_ns || !self.answers.is_empty();
        if !is_due || !self.is_awaited() {
            return;
        }
        self.due_ns = now_ns + FRAME_PERIOD_NS;
        if self.shown_step == Some(row.step) {
            return;
        }
        let micros = |ns: u64| single(ns as f64 / 1000.0);
        let head = FrameHead {
            stamp: Stamp { epoch: 0, step: row.step },
            sim_time_s: self.time_s(row.step),
            flags: frame_flag::REPLAY,
            torn_count: row.torn_count,
            solve_us: micros(row.solve_ns),
            wake_late_us: micros(row.wake_late_ns),
            number: 0,
            publish_monotonic_ns: now_ns,
        };
        self.shown_step = Some(row.step);
        self.hub.say(Topic::Steps, || Message::Step(row));
        self.stage.show(self.hub, head, &self.state.particles);
    }

    fn time_s(&self, step: u64) -> f64 {
        step as f64 / f64::from(self.replay.tape.run().rate_hz)
    }

    /// Answers what was obeyed: all of it is in the state on show.
    fn answer(&mut self) {
        for (client, mut outcome) in self.answers.drain(..) {
            outcome.step = Some(self.state.row.step);
            if outcome.id.is_some() {
                self.hub.send(client, &ToPage::Outcome(outcome));
            }
        }
    }

    fn take_reports(&mut self) {
        let Some(report) = self.reports.try_iter().last() else { return };
        self.report = report;
        self.tell_timeline();
        self.set_parameters();
    }

    /// Tells pages what the recording holds.
    fn tell_timeline(&self) {
        let tape = &self.replay.tape;
        let timeline = Timeline {
            file: self.replay.file.clone(),
            scene: tape.run().scene_name.clone(),
            rate_hz: tape.run().rate_hz,
            first_step: tape.first_step(),
            last_step: tape.last_step(),
            first_time_s: self.time_s(tape.first_step()),
            last_time_s: self.time_s(tape.last_step()),
            marks: self.report.marks.clone(),
            hashes: self.report.hashes,
            hash_text: self.report.hash_text.clone(),
        };
        self.hub.latch(Slot::Timeline, &ToPage::Timeline(Box::new(timeline)));
    }

    /// Tells pages how the recording is played.
    fn tell_playback(&mut self) {
        self.is_changed = false;
        let (head, step) = (&self.playhead, self.state.row.step);
        let playback = Playback {
            is_playing: head.is_playing,
            rate: head.rate,
            is_looping: head.is_looping,
            step,
            time_s: self.time_s(step),
        };
        self.hub.latch(Slot::Playback, &ToPage::Playback(playback));
        let (load, run) = (&self.replay.load, self.replay.tape.run());
        let node = Node {
            state: NodeState::Alive,
            text: String::new(),
            run_id: Some(format!("{:016x}", run.run_id)),
            scene: Some(run.scene_name.clone()),
            method: Some(load.method()),
            rate_hz: run.rate_hz,
            is_paused: !head.is_playing,
            is_replay: true,
            time_scale: f64::from(head.rate),
            process_id: None,
        };
        self.hub.latch(Slot::Node, &ToPage::Node(node));
        self.set_parameters();
    }

    fn tell_statistics_if_due(&mut self, now_ns: u64) {
        if now_ns >= self.next_statistics_ns {
            self.next_statistics_ns = now_ns + STATISTICS_PERIOD_NS;
            if let Some(status) = &self.state.status {
                self.hub.say(Topic::Status, || Message::Status(status.clone()));
            }
            self.tell_statistics();
        }
    }
}

fn outcome(id: Option<u32>, command: &Command, result: Result<(), &'static str>) -> OutcomeText {
    let reason = result.err().unwrap_or("");
    OutcomeText {
        id,
        kind: command.name(),
        status: if result.is_ok() { Status::Applied } else { Status::Rejected },
        step: None,
        applied: u32::from(result.is_ok()),
        rejected: u32::from(result.is_err()),
        reason,
        text: reason::text(reason).to_owned(),
    }
}
