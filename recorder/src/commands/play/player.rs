//! The loop of a replay: obeys commands and keys, and publishes each snapshot when it is due.

use std::collections::VecDeque;

use recording::Frame;
use sim_contract::{Action, Command, Endpoint, Owner, Reason, ReceivedCommand};
use sim_host::Stop;
use sim_host::clock::{SECOND_NS, monotonic_ns, sleep_until};

use super::control::{Control, Pace, Request, SeekTarget};
use super::keyboard::{Key, Keyboard};
use super::lockstep::Lockstep;
use super::playlist::{Place, Playlist};
use super::recording::Start;
use super::replay::{Playback, Replay};
use crate::cli::output;

/// Longest wait before the next check for commands, keys, readers and signals.
const WAIT_MAX_NS: u64 = SECOND_NS / 100;
/// Pause between two checks for messages of the members of the lockstep.
const MEMBERS_WAIT_NS: u64 = 50_000;
/// Period of the status messages: 10 Hz.
const STATUS_PERIOD_NS: u64 = SECOND_NS / 10;
/// Time for which the services stay after the last snapshot, so that its readers can finish.
const LINGER_NS: u64 = SECOND_NS / 10;

/// The part of the files to play, and the readers to wait for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// Time of the first snapshot, from the start of the files.
    pub(super) start_ns: u64,
    /// Time of the last snapshot to play.
    pub(super) end_ns: u64,
    pub(super) loops: bool,
    /// Number of readers before the first snapshot.
    pub(super) readers: u64,
}

/// Plays files.
#[derive(Debug)]
pub(super) struct Player {
    pub(super) endpoint: Endpoint,
    pub(super) playlist: Playlist,
    pub(super) plan: Plan,
    pub(super) control: Control,
    pub(super) pace: Pace,
    pub(super) lockstep: Lockstep,
    pub(super) speed: Speed,
    pub(super) keyboard: Option<Keyboard>,
    /// Received commands without an answer.
    pub(super) commands: VecDeque<ReceivedCommand>,
    pub(super) next_status_ns: u64,
    pub(super) is_quit: bool,
    /// The last snapshot of the run is published.
    pub(super) is_at_end: bool,
}

/// The measured speed of the playback.
#[derive(Debug, Default)]
pub(super) struct Speed {
    /// Clock and time of the replay at the begin of the measurement.
    since: Option<(u64, u64)>,
    real_time_factor: f64,
}

impl Speed {
    fn restart(&mut self) {
        self.since = None;
    }

    /// Measures over the last second. Returns simulated time per wall-clock time.
    fn update(&mut self, now_ns: u64, time_ns: u64) -> f64 {
        let (since_ns, since_time_ns) = *self.since.get_or_insert((now_ns, time_ns));
        if now_ns >= since_ns + SECOND_NS {
            let passed_ns = time_ns.saturating_sub(since_time_ns) as f64;
            self.real_time_factor = passed_ns / (now_ns - since_ns) as f64;
            self.since = Some((now_ns, time_ns));
        }
        self.real_time_factor
    }
}

/// The begin of a run.
#[derive(Debug)]
pub(super) struct Beginning {
    place: Place,
    /// The command that asked for it.
    command: Option<Command>,
}

impl Player {
    /// Plays run after run. Calls `on_ready` once the services are there.
    pub(super) fn play(&mut self, stop: &Stop, on_ready: impl FnOnce()) -> anyhow::Result<()> {
        let mut on_ready = Some(on_ready);
        let mut owner = None;
        let mut next = Some(self.beginning());
        while let Some(Beginning { place, command }) = next {
            let (mut replay, first) = self.begin_run(owner.take(), place)?;
            if let Some(on_ready) = on_ready.take() {
                on_ready();
            }
            if let Some(command) = command {
                let step = first.row.step;
                replay.answer(moved_to(command, step), step, Ok(()))?;
            }
            next = self.play_run(&mut replay, first, stop)?;
            owner = Some(replay.into_owner());
        }
        Ok(())
    }

    fn beginning(&self) -> Beginning {
        Beginning { place: self.playlist.place_at(self.plan.start_ns), command: None }
    }

    fn begin_run(&mut self, owner: Option<Owner>, place: Place) -> anyhow::Result<(Replay, Frame)> {
        let Start { frame, state } = self.playlist.start_at(place)?;
        let replay = Replay::new(&self.endpoint, owner, &self.playlist.recorded()?, state)?;
        self.control.begin_run();
        self.lockstep.begin_run();
        self.pace.restart();
        self.speed.restart();
        Ok((replay, frame))
    }

    /// Publishes the snapshots of a run, until it ends or another place is asked for. Returns the next run;
    /// `None` at the end of the replay.
    fn play_run(
        &mut self,
        replay: &mut Replay,
        first: Frame,
        stop: &Stop,
    ) -> anyhow::Result<Option<Beginning>> {
        let mut last_step = first.row.step;
        let mut next = Some(first);
        let mut ended_ns = None;
        while !stop.is_requested() && !self.is_quit {
            if let Some(beginning) = self.attend(replay, next.as_ref(), last_step)? {
                return Ok(Some(beginning));
            }
            let now_ns = monotonic_ns();
            let due_ns = match &next {
                _ if self.awaits_members(replay, now_ns) => u64::MAX,
                Some(frame) => self.due_ns(replay, frame.row.step, now_ns),
                None => self.end_ns(&mut ended_ns, now_ns),
            };
            match next.take_if(|_| due_ns <= now_ns) {
                Some(frame) => {
                    last_step = frame.row.step;
                    next = self.publish(replay, &frame)?;
                }
                None if due_ns <= now_ns => return Ok(self.next_run()),
                None => self.wait(replay, due_ns, now_ns),
            }
        }
        Ok(None)
    }

    /// Waits until a snapshot is due, or the members of the lockstep are ready, for at most the time between two
    /// checks.
    fn wait(&mut self, replay: &Replay, due_ns: u64, now_ns: u64) {
        let end_ns = due_ns.min(now_ns + WAIT_MAX_NS);
        if !self.awaits_members(replay, now_ns) {
            return sleep_until(end_ns);
        }
        let mut now_ns = now_ns;
        while now_ns < end_ns && self.awaits_members(replay, now_ns) {
            sleep_until(now_ns + MEMBERS_WAIT_NS);
            now_ns = monotonic_ns();
        }
    }

    /// Returns `true` if the next snapshot, or the end, waits for members of the lockstep.
    fn awaits_members(&mut self, replay: &Replay, now_ns: u64) -> bool {
        self.lockstep.receive(replay.owner(), replay.published(), now_ns);
        match replay.step() {
            Some(step) if self.control.is_moving() => self.lockstep.is_waiting(step, now_ns),
            _ => {
                self.lockstep.rest();
                false
            }
        }
    }

    /// Returns when a snapshot is due. `u64::MAX` while the replay is paused or waits for readers.
    fn due_ns(&mut self, replay: &Replay, step: u64, now_ns: u64) -> u64 {
        if self.plan.readers > 0 {
            if (replay.reader_count() as u64) < self.plan.readers {
                return u64::MAX;
            }
            self.plan.readers = 0;
        }
        if !self.control.is_moving() {
            self.pace.restart();
            return u64::MAX;
        }
        self.pace.deadline_ns(self.playlist.time_ns(step), now_ns)
    }

    /// Returns when the run ends after its last snapshot. A paused replay stays there.
    fn end_ns(&mut self, ended_ns: &mut Option<u64>, now_ns: u64) -> u64 {
        self.control.end();
        if self.control.is_paused {
            *ended_ns = None;
            return u64::MAX;
        }
        *ended_ns.get_or_insert(now_ns) + LINGER_NS
    }

    /// Publishes a snapshot. Returns the next one, which is read ahead, so that it is decompressed during
    /// the wait.
    fn publish(&mut self, replay: &mut Replay, frame: &Frame) -> anyhow::Result<Option<Frame>> {
        if replay.step().is_none() {
            replay.publish_latched()?;
        }
        replay.publish(frame)?;
        self.control.count_step();
        let next = self.playlist.next_frame(replay.state())?;
        Ok(next.filter(|frame| self.playlist.time_ns(frame.row.step) <= self.plan.end_ns))
    }

    /// Returns the run after one that has ended.
    fn next_run(&self) -> Option<Beginning> {
        let next = self.playlist.place_after_run();
        let next = next.filter(|place| self.playlist.time_of(*place) <= self.plan.end_ns);
        match next {
            Some(place) => Some(Beginning { place, command: None }),
            None => self.plan.loops.then(|| self.beginning()),
        }
    }

    /// Obeys commands and keys, serves late subscribers, and publishes the status. Returns the place that
    /// was asked for.
    fn attend(
        &mut self,
        replay: &mut Replay,
        next: Option<&Frame>,
        last_step: u64,
    ) -> anyhow::Result<Option<Beginning>> {
        self.is_at_end = next.is_none();
        let next_step = next.map_or(last_step + 1, |frame| frame.row.step);
        replay.receive_commands(&mut self.commands);
        while let Some(ReceivedCommand { command, .. }) = self.commands.pop_front() {
            // A fresh status follows, so that `ctl status` shows the effect.
            self.next_status_ns = 0;
            let request = Request::from_action(&command.action());
            let result = match request {
                Ok(request) => self.obey(request, last_step)?,
                Err(reason) => Err(reason),
            };
            if let Ok(Some(place)) = result {
                return Ok(Some(Beginning { place, command: Some(command) }));
            }
            replay.answer(command, next_step, result.map(|_| ()))?;
        }
        while let Some(key) = self.keyboard.as_mut().and_then(Keyboard::next) {
            self.next_status_ns = 0;
            self.is_quit |= key == Key::Quit;
            let Some(request) = key.request(self.control) else { continue };
            // A key without an effect here needs no answer.
            if let Ok(Some(place)) = self.obey(request, last_step)? {
                return Ok(Some(Beginning { place, command: None }));
            }
        }
        if !self.control.is_moving() {
            self.complete_state(replay)?;
        }
        self.show(replay, last_step)?;
        Ok(None)
    }

    /// Publishes the keyframe of the snapshot at which the replay stands, for a reader that has joined since.
    /// A node does so, too, so that a state can be read from one that is paused.
    fn complete_state(&mut self, replay: &mut Replay) -> anyhow::Result<()> {
        if let Some(step) = replay.take_step_to_complete()
            && let Some(bytes) = self.playlist.keyframe_of(step)?
        {
            replay.complete(step, bytes)?;
        }
        Ok(())
    }

    /// Obeys a request, or returns the place that it asks for. `step` is the last published one.
    fn obey(
        &mut self,
        request: Request,
        step: u64,
    ) -> anyhow::Result<Result<Option<Place>, Reason>> {
        match request {
            Request::Pause => self.control.set_paused(true),
            Request::Resume => self.control.set_paused(false),
            Request::Step(_) if self.is_at_end && self.control.is_paused => {
                return Ok(Err(Reason::OutOfRange));
            }
            Request::Step(count) => return Ok(self.control.step(count).map(|()| None)),
            Request::Rate(rate) => {
                self.control.rate = rate;
                self.pace.set_rate(rate, monotonic_ns());
            }
            Request::Seek(target) => return Ok(self.find(target, step)?.map(Some)),
        }
        Ok(Ok(None))
    }

    fn find(&mut self, target: SeekTarget, step: u64) -> anyhow::Result<Result<Place, Reason>> {
        let Plan { start_ns, end_ns, .. } = self.plan;
        let place = match target {
            SeekTarget::Step(step) => self.playlist.place_of(step),
            SeekTarget::BackSteps(count) => {
                step.checked_sub(count).and_then(|step| self.playlist.place_of(step))
            }
            SeekTarget::Previous => Some(self.playlist.place_before(step)?),
            SeekTarget::By(ns) => {
                let time_ns = self.playlist.time_ns(step).saturating_add_signed(ns);
                Some(self.playlist.place_at(time_ns.clamp(start_ns, end_ns)))
            }
            SeekTarget::Percent(percent) => {
                let time_ns = u128::from(end_ns - start_ns) * u128::from(percent) / 100;
                let time_ns = u64::try_from(time_ns).unwrap_or(u64::MAX);
                Some(self.playlist.place_at(start_ns.saturating_add(time_ns)))
            }
        };
        let times = start_ns..=end_ns;
        let place = place.filter(|place| times.contains(&self.playlist.time_of(*place)));
        Ok(place.ok_or(Reason::OutOfRange))
    }

    /// Publishes the status and shows the line, if they are due.
    fn show(&mut self, replay: &Replay, step: u64) -> anyhow::Result<()> {
        let now_ns = monotonic_ns();
        if now_ns < self.next_status_ns {
            return Ok(());
        }
        self.next_status_ns = now_ns + STATUS_PERIOD_NS;
        let Plan { start_ns, end_ns, .. } = self.plan;
        let time_ns = self.playlist.time_ns(step).saturating_sub(start_ns);
        replay.publish_status(&Playback {
            control: self.control,
            step,
            real_time_factor: self.speed.update(now_ns, time_ns),
            lockstep: &self.lockstep,
            is_at_end: self.is_at_end,
        })?;
        show_line(&Shown { time_ns, duration_ns: end_ns - start_ns, step, control: self.control });
        Ok(())
    }
}

/// Returns the command with the step that it has found, as a node answers a rewind.
fn moved_to(command: Command, step: u64) -> Command {
    let action = Action::Rewind { to_step: Some(step), back_steps: None };
    Command::new(command.client_id, command.sequence, action)
}

/// The content of the line.
#[derive(Debug)]
pub(super) struct Shown {
    /// Time of the last published snapshot, from the start of the replay.
    pub(super) time_ns: u64,
    pub(super) duration_ns: u64,
    pub(super) step: u64,
    pub(super) control: Control,
}

/// Shows the line in the place of the last one.
fn show_line(shown: &Shown) {
    output::show_live(text(shown));
}

fn text(shown: &Shown) -> String {
    let seconds = |ns: u64| ns as f64 / SECOND_NS as f64;
    let Shown { time_ns, duration_ns, step, control } = shown;
    let (time, duration) = (seconds(*time_ns), seconds(*duration_ns));
    let paused = if control.is_paused { ", paused" } else { "" };
    let rate = if control.rate.is_finite() { control.rate.to_string() } else { "max".to_owned() };
    format!("{time:.2} s of {duration:.2} s, step {step}, rate {rate}{paused}")
}

#[cfg(test)]
mod live_tests {
    use super::*;

    #[test]
    fn the_line_has_the_time_the_step_and_the_rate() {
        let mut control = Control::new(false, 0.25);
        let line = |control| {
            let (time_ns, duration_ns) = (1_500_000_000, 10 * SECOND_NS);
            text(&Shown { time_ns, duration_ns, step: 360, control })
        };
        assert_eq!(line(control), "1.50 s of 10.00 s, step 360, rate 0.25");
        control.rate = f64::INFINITY;
        assert_eq!(line(control), "1.50 s of 10.00 s, step 360, rate max");
        control.rate = 0.25;
        control.set_paused(true);
        assert_eq!(line(control), "1.50 s of 10.00 s, step 360, rate 0.25, paused");
    }
}
