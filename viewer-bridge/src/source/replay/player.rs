//! Plays a recording: obeys the clients, moves to the place of the playhead, and shows its state.

use std::sync::mpsc::Receiver;
use std::time::Duration;

use recording::{ReadError, RecordedState, TapeError};
use sim_contract::{Action, Forces, ForcesHeader, Parameter, ParameterValue, Reason};
use sim_host::clock::{SECOND_NS, monotonic_ns};

use super::check::Report;
use super::ghosts::Ghosts;
use super::open::Recording;
use super::playhead::{Advanced, Playhead};
use super::texts;
use crate::limits::{FRAMES_PER_SECOND_MAX, REPLAY_RATES};
use crate::message::{CommandKind, Hashes, Level, OutcomeText, ParametersText, Refusal};
use crate::request::{ClientId, Request, RequestKind, Requests};
use crate::sink::{Demand, Sinks, State, Update};
use crate::source::shown_state::ShownState;
use crate::wire::frame_flag;

/// Time between two frames.
const FRAME_PERIOD_NS: u64 = SECOND_NS / FRAMES_PER_SECOND_MAX as u64;
/// Time between two checks for the end of the program while nothing happens.
const IDLE_PERIOD: Duration = Duration::from_millis(50);
/// Time between two statistics.
const STATISTICS_PERIOD_NS: u64 = SECOND_NS / 4;
/// Requests that are handled before the next state is read. Of many seeks, only the last one counts.
const REQUESTS_AT_ONCE_MAX: usize = 1024;

/// Plays a recording.
#[derive(Debug)]
pub(super) struct Player<'a> {
    recording: &'a mut Recording,
    ghosts: &'a mut Ghosts,
    sinks: &'a Sinks,
    reports: Receiver<Report>,
    report: Report,
    shown: ShownState,
    playhead: Playhead,
    /// The state at the place of the playhead.
    state: RecordedState,
    /// The step whose forces were read, and those that the recording has of it.
    forces: Option<(u64, Option<Forces>)>,
    resets: ResetFinder,
    /// The parameters that were published last.
    parameters: Option<ParametersText>,
    /// Applied commands, which are answered with the step that shows their effect.
    answers: Vec<Answer>,
    /// The playback has changed since it was published.
    is_playback_changed: bool,
    /// The step on show, and whether the playback stood at it.
    on_show: Option<(u64, bool)>,
    next_frame_ns: u64,
    next_statistics_ns: u64,
}

/// The answer to an applied command.
#[derive(Debug)]
struct Answer {
    client: ClientId,
    outcome: OutcomeText,
}

impl<'a> Player<'a> {
    /// Starts at the first step.
    pub(super) fn new(
        recording: &'a mut Recording,
        ghosts: &'a mut Ghosts,
        reports: Receiver<Report>,
        sinks: &'a Sinks,
    ) -> Self {
        let (tape, state) = (&recording.tape, recording.first.clone());
        let playhead = Playhead::new(tape.first_step(), tape.last_step(), tape.run().rate_hz);
        let report = Report {
            marks: Vec::new(),
            hashes: Hashes::Checking,
            hash_text: "checking hashes".to_owned(),
        };
        Self {
            recording,
            ghosts,
            sinks,
            reports,
            report,
            shown: ShownState::default(),
            playhead,
            resets: ResetFinder::new(state.beginning()),
            state,
            forces: None,
            parameters: None,
            answers: Vec::new(),
            is_playback_changed: true,
            on_show: None,
            next_frame_ns: 0,
            next_statistics_ns: 0,
        }
    }

    /// Plays from now on, again and again.
    pub(super) fn start_looping(&mut self) {
        self.playhead.loop_between(None, None, monotonic_ns());
        self.playhead.resume(monotonic_ns());
    }

    /// Plays until the program ends.
    pub(super) fn run(mut self, requests: &Requests) -> Result<(), ReadError> {
        let scene = self.recording.load.to_scene(self.state.row.step, &self.state.particles);
        // The order in which the hub sends them to a page that arrives later.
        self.publish_node();
        self.publish_timeline();
        self.publish_playback();
        self.publish_ghost();
        self.shown.begin_load(self.sinks, scene);
        self.sinks.publish(&Update::Topology(self.recording.load.topology()));
        self.publish_changes();
        while !self.sinks.is_shutting_down() {
            self.handle_requests(requests)?;
            self.update_report();
            self.update_ghost();
            let now_ns = monotonic_ns();
            if self.playhead.advance(now_ns) == Advanced::ToEnd {
                self.is_playback_changed = true;
            }
            if self.is_awaited() || self.is_playback_changed {
                self.read_state(now_ns)?;
            }
            if self.is_playback_changed {
                self.publish_node();
                self.publish_playback();
            }
            self.show(now_ns);
            self.publish_answers();
            self.publish_statistics_if_due(now_ns);
        }
        Ok(())
    }

    fn is_awaited(&self) -> bool {
        self.sinks.has_demand(Demand::State)
    }

    /// Handles requests until the next frame is due or a request has changed the playback.
    fn handle_requests(&mut self, requests: &Requests) -> Result<(), ReadError> {
        let until_due = Duration::from_nanos(self.next_frame_ns.saturating_sub(monotonic_ns()));
        let is_moving = self.playhead.is_playing && self.is_awaited();
        let mut timeout = if is_moving { until_due } else { IDLE_PERIOD };
        for _ in 0..REQUESTS_AT_ONCE_MAX {
            let Some(request) = requests.next(timeout) else { break };
            self.handle(request)?;
            timeout = Duration::ZERO;
        }
        Ok(())
    }

    fn handle(&mut self, Request { client, kind }: Request) -> Result<(), ReadError> {
        match kind {
            RequestKind::State => self.on_show = None,
            // A recording has no grabs.
            RequestKind::Credit | RequestKind::Left => {}
            RequestKind::Command(command) => match self.obey(&command.kind)? {
                Ok(()) => {
                    self.is_playback_changed = true;
                    let outcome = OutcomeText::applied(command.id, command.kind.name());
                    self.answers.push(Answer { client, outcome });
                }
                Err(reason) => {
                    let name = command.kind.name();
                    let outcome = &OutcomeText::refused(command.id, name, reason);
                    self.sinks.publish(&Update::Answer { client, outcome });
                }
            },
        }
        Ok(())
    }

    /// Obeys a command that controls the playback. A recording cannot be changed.
    fn obey(&mut self, kind: &CommandKind) -> Result<Result<(), Refusal>, ReadError> {
        let now_ns = monotonic_ns();
        let playhead = &mut self.playhead;
        match kind {
            CommandKind::Action(Action::Pause) => playhead.pause(now_ns),
            CommandKind::Action(Action::Resume) => playhead.resume(now_ns),
            CommandKind::Action(Action::Set {
                parameter,
                value: ParameterValue::Number(rate),
                ..
            }) if parameter.as_str() == Parameter::TimeScale.name() => {
                if !REPLAY_RATES.contains(rate) {
                    return Ok(Err(Reason::OutOfRange.into()));
                }
                playhead.set_rate(*rate, now_ns);
            }
            CommandKind::Loop { is_on: false, .. } => playhead.stop_looping(now_ns),
            CommandKind::Loop { is_on: true, first_step, last_step } => {
                if !playhead.loop_between(*first_step, *last_step, now_ns) {
                    return Ok(Err(Reason::OutOfRange.into()));
                }
            }
            CommandKind::Ghost { name } => {
                if let Err(refusal) = self.ghosts.choose(name.as_deref(), self.recording) {
                    return Ok(Err(refusal));
                }
                self.on_show = None;
                self.publish_ghost();
            }
            CommandKind::Seek { step } => {
                let step = self.recording.tape.step_at(*step)?;
                playhead.go_to(step, now_ns);
            }
            CommandKind::Action(Action::Step { .. }) | CommandKind::StepBack { .. }
                if playhead.is_playing =>
            {
                return Ok(Err(Reason::NoEffectHere.into()));
            }
            CommandKind::Action(Action::Step { count }) => {
                let step = self.step_by(i64::from(*count), now_ns)?;
                self.playhead.go_to(step, now_ns);
            }
            CommandKind::StepBack { count } => {
                let step = self.step_by(-i64::from(*count), now_ns)?;
                self.playhead.go_to(step, now_ns);
            }
            _ => return Ok(Err(Refusal::OnlyLive)),
        }
        Ok(Ok(()))
    }

    /// Returns the recorded step `count` recorded steps ahead, or back.
    fn step_by(&mut self, count: i64, now_ns: u64) -> Result<u64, ReadError> {
        let tape = &mut self.recording.tape;
        let here = tape.step_at(self.playhead.step(now_ns))?;
        let distance = count.unsigned_abs().saturating_mul(tape.stride());
        if count < 0 {
            return tape.step_at(here.saturating_sub(distance));
        }
        let there = tape.step_at(here.saturating_add(distance))?;
        // Across a gap in the recording, the next step is farther away.
        if there > here { Ok(there) } else { tape.step_after(here) }
    }

    /// Reads the state at the place of the playhead.
    fn read_state(&mut self, now_ns: u64) -> Result<(), ReadError> {
        let step = self.recording.tape.step_at(self.playhead.step(now_ns))?;
        if step != self.state.row.step {
            match self.recording.tape.state_at(step) {
                Ok(state) => self.set_state(state),
                Err(TapeError::Read(error)) => return Err(error),
                // The state became unreadable since the search; the present one stays.
                Err(_) => {}
            }
        }
        self.read_forces()?;
        if self.ghosts.read(self.shown.epoch(), &self.state, &self.recording.load.constraints)? {
            self.on_show = None;
        }
        let faults = self
            .recording
            .tape
            .drain_faults()
            .into_iter()
            .map(|fault| (self.recording.file.as_str(), fault));
        let ghost_faults = self.ghosts.drain_faults();
        let ghost_name = self.ghosts.text().name.as_deref().unwrap_or_default();
        for (file, fault) in faults.chain(ghost_faults.into_iter().map(|fault| (ghost_name, fault)))
        {
            let text = &format!("{file}: {fault}; it is skipped");
            self.sinks.publish(&Update::Notice { level: Level::Warning, text });
        }
        Ok(())
    }

    /// Reads the forces of the state while a client wants them. A state that is on show without them is shown again.
    fn read_forces(&mut self) -> Result<(), ReadError> {
        let step = self.state.row.step;
        if !self.sinks.has_demand(Demand::Forces) {
            self.forces = None;
        } else if self.forces.as_ref().is_none_or(|(read_step, _)| *read_step != step) {
            let row = self.recording.tape.forces_at(step)?;
            let (run_id, rate_hz) =
                (self.recording.tape.run().run_id, self.recording.tape.run().rate_hz);
            let header = ForcesHeader { run_id, step, rate_hz, ..ForcesHeader::default() };
            let forces = row.map(|row| Forces { header, rows: row.rows() });
            if forces.is_some() {
                self.on_show = None;
            }
            self.forces = Some((step, forces));
        }
        Ok(())
    }

    fn set_state(&mut self, state: RecordedState) {
        let passes_reset = self.resets.passes_reset(state.beginning());
        self.state = state;
        self.publish_changes();
        if passes_reset {
            self.sinks.publish(&Update::Reset { step: self.state.row.step });
        }
    }

    /// Shows the pins, tears, colliders and parameters of the state.
    fn publish_changes(&mut self) {
        let (state, step) = (&self.state, self.state.row.step);
        self.shown.set_pins(self.sinks, step, &state.particles);
        let constraint_count = self.recording.load.constraints.len();
        let torn = &state.torn;
        if torn.indices().all(|constraint| (constraint as usize) < constraint_count) {
            self.shown.set_torn(self.sinks, step, &torn.constraints);
        }
        if let Some(row) = &state.colliders {
            self.shown.set_colliders(self.sinks, step, &row.states());
        }
        self.publish_parameters();
    }

    /// Publishes the parameters at this step, if they have changed. Those of the scene, as incomplete, where the
    /// recording lacks them.
    fn publish_parameters(&mut self) {
        let initial = self.recording.load.summary.parameters.clone();
        let recorded = self.state.parameters.as_ref().map(|row| row.values.clone());
        let is_complete = recorded.is_some();
        let values = recorded.unwrap_or_else(|| initial.clone());
        let text = ParametersText {
            is_complete,
            values: Some(values.with(Parameter::TimeScale, self.playhead.rate)),
            initial: Some(initial),
            initial_colliders: self.recording.load.summary.surfaces.clone(),
        };
        if self.parameters.as_ref() != Some(&text) {
            self.sinks.publish(&Update::Parameters(&text));
            self.parameters = Some(text);
        }
    }

    /// Shows the state if it is new and a frame is due. A frame is due at once after a command.
    fn show(&mut self, now_ns: u64) {
        let row = self.state.row;
        let is_due = now_ns >= self.next_frame_ns || !self.answers.is_empty();
        if !is_due || !self.is_awaited() {
            return;
        }
        self.next_frame_ns = now_ns + FRAME_PERIOD_NS;
        // A state that stays is shown again, because pages receive it exactly only while nothing moves.
        let is_paused = !self.playhead.is_playing;
        if self.on_show == Some((row.step, is_paused)) {
            return;
        }
        self.on_show = Some((row.step, is_paused));
        let paused = if is_paused { frame_flag::PAUSED } else { 0 };
        let state = State {
            epoch: self.shown.epoch(),
            row,
            sim_time_s: self.recording.time_s(row.step),
            flags: frame_flag::REPLAY | paused,
            publish_monotonic_ns: now_ns,
            particles: &self.state.particles,
            forces: self.forces.as_ref().and_then(|(_, forces)| forces.as_ref()),
            ghost: self.ghosts.state(),
        };
        self.shown.show(self.sinks, state);
    }

    /// Answers the applied commands. The state on show has their effect.
    fn publish_answers(&mut self) {
        for Answer { client, mut outcome } in self.answers.drain(..) {
            outcome.step = Some(self.state.row.step);
            if outcome.id.is_some() {
                self.sinks.publish(&Update::Answer { client, outcome: &outcome });
            }
        }
    }

    /// Takes the newest report of the check.
    fn update_report(&mut self) {
        let Some(report) = self.reports.try_iter().last() else { return };
        self.report = report;
        self.publish_timeline();
    }

    fn publish_timeline(&self) {
        let timeline = texts::timeline(self.recording, &self.report);
        self.sinks.publish(&Update::Timeline(&timeline));
    }

    /// Takes what the thread of the ghost has found.
    fn update_ghost(&mut self) {
        if self.ghosts.update() {
            self.publish_ghost();
        }
    }

    fn publish_ghost(&self) {
        self.sinks.publish(&Update::Ghost(self.ghosts.text()));
    }

    /// Publishes the state and the parameters of the node that a recording stands for.
    fn publish_node(&mut self) {
        self.sinks.publish(&Update::Node(&texts::node(self.recording, &self.playhead)));
        self.publish_parameters();
    }

    fn publish_playback(&mut self) {
        self.is_playback_changed = false;
        let playback = texts::playback(self.recording, &self.playhead, self.state.row.step);
        self.sinks.publish(&Update::Playback(&playback));
    }

    fn publish_statistics_if_due(&mut self, now_ns: u64) {
        if now_ns < self.next_statistics_ns {
            return;
        }
        self.next_statistics_ns = now_ns + STATISTICS_PERIOD_NS;
        if let Some(status) = &self.state.status {
            self.sinks.publish(&Update::Status(status));
        }
        if self.sinks.has_demand(Demand::Statistics) {
            let values = self.parameters.as_ref().and_then(|text| text.values.as_ref());
            let gravity = values.map_or([0.0; 3], |values| values.vector(Parameter::Gravity));
            let (state, shown, playhead) = (&self.state, &self.shown, &self.playhead);
            let statistics = texts::statistics(self.recording, state, shown, playhead, gravity);
            self.sinks.publish(&Update::Statistics(&statistics));
        }
    }
}

/// Finds recorded resets between the states on show. The beginning of a state is the step at which its
/// scene was at its beginning; it is `None` if the header is unreadable.
#[derive(Debug, Clone, Copy)]
struct ResetFinder {
    /// Beginning of the last state with a readable header.
    beginning: Option<u64>,
}

impl ResetFinder {
    fn new(beginning: Option<u64>) -> Self {
        Self { beginning }
    }

    /// Returns `true` if a reset lies between the state before and this one, in either direction. A
    /// state without a readable header is skipped, so a reset beside it is found with the next state.
    fn passes_reset(&mut self, beginning: Option<u64>) -> bool {
        let before = self.beginning;
        self.beginning = beginning.or(before);
        before.is_some() && self.beginning != before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_is_found_in_either_direction() {
        let mut resets = ResetFinder::new(Some(0));
        let passes = [0, 12, 12, 0, 0].map(|beginning| resets.passes_reset(Some(beginning)));
        assert_eq!(passes, [false, true, false, true, false]);
    }

    #[test]
    fn a_state_without_a_readable_header_is_no_reset_and_hides_none() {
        let mut resets = ResetFinder::new(Some(0));
        let passes = [None, Some(0), None, Some(13), Some(13)]
            .map(|beginning| resets.passes_reset(beginning));
        assert_eq!(passes, [false, false, false, true, false]);
        assert!(!ResetFinder::new(None).passes_reset(Some(1)));
    }
}
