//! The loop: wait for the deadline, apply commands, step, publish, observe.

mod boundary;
mod grab_connections;
mod history;
mod inbox;
mod job;
mod load;
mod lockstep;
mod pace;
mod progress;
mod publisher;
mod real_time;
mod statistics;
mod threads;
mod warnings;

use std::time::Duration;

use sim_contract::{Endpoint, NodeStatus, ReceivedCommand};
use sim_host::Stop;
use sim_host::clock::{SECOND_NS, monotonic_ns, sleep_until, thread_time_ns};
use sim_solver::{Scene, Solver, Spare};

use grab_connections::GrabConnections;
use history::History;
use inbox::Inbox;
use job::Job;
use job::Overrides;
use job::Work;
use lockstep::{Event, Lockstep, Published};
use pace::Pace;
use pace::Polling;
use pace::Rest;
use progress::Progress;
pub(crate) use publisher::shared_memory_bytes;
use publisher::{Position, Publisher, StepTimes};
pub(crate) use real_time::Cpus;
pub(crate) use real_time::prepare;
pub(crate) use real_time::{RealTime, RealTimeOptions};
use statistics::Phases;
use statistics::Statistics;
pub(crate) use statistics::TIME_NS_MAX;
pub(crate) use statistics::{Phase, PhaseTimes};
use warnings::Warnings;

/// Time between two status messages: 10 Hz.
const STATUS_PERIOD_NS: u64 = SECOND_NS / 10;
/// Polling interval for commands while the next step is far away. It bounds the wait for an outcome,
/// and adds no wake-ups at 50 Hz or more in real time.
const WAITING_POLL_NS: u64 = SECOND_NS / 50;
/// Polling interval for commands while paused. It is shorter, because the first step after `step` or
/// `resume` follows at once.
const PAUSED_POLL_NS: u64 = SECOND_NS / 500;

/// Options of a run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Options {
    /// Replaces the rate of each scene.
    pub(crate) rate_hz: Option<u32>,
    /// Replaces the substeps of each scene.
    pub(crate) substeps: Option<u32>,
    /// Replaces the number of threads that suits each scene.
    pub(crate) threads: Option<u8>,
    /// Number of steps after which a run ends.
    pub(crate) steps: Option<u64>,
    /// Simulated time after which a run ends, rounded up to whole steps.
    pub(crate) duration: Option<Duration>,
    pub(crate) starts_paused: bool,
    pub(crate) waits_for_time: bool,
    /// Number of steps from one published snapshot to the next.
    pub(crate) every: u64,
    /// Longest wait for a member of the lockstep.
    pub(crate) lockstep_timeout: Duration,
    /// Memory for past states.
    pub(crate) history_bytes: usize,
    pub(crate) real_time: RealTimeOptions,
}

/// The boundary before the next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Boundary {
    /// Commands are applied.
    Open,
    /// A command has put a state in place, which the next step shows without further changes.
    Closed,
    /// A load has begun a run, and published its step 0.
    OfNewRun,
}

impl Options {
    fn overrides(&self) -> Overrides {
        Overrides { rate_hz: self.rate_hz, substeps: self.substeps }
    }

    /// Number of steps after which a run at this rate ends.
    fn last_step(&self, rate_hz: u32) -> Option<u64> {
        let steps_in = |time: Duration| {
            let steps = (time.as_nanos() * u128::from(rate_hz)).div_ceil(u128::from(SECOND_NS));
            u64::try_from(steps).unwrap_or(u64::MAX)
        };
        self.steps.or(self.duration.map(steps_in))
    }
}

/// A running simulation.
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) scene: Scene,
    pub(crate) solver: Solver,
    options: Options,
    publisher: Publisher,
    inbox: Inbox,
    /// Buffer that every boundary reuses.
    arrived: Vec<ReceivedCommand>,
    grab_connections: GrabConnections,
    lockstep: Lockstep,
    history: History,
    /// Commands that are prepared beside the loop.
    job: Option<Job>,
    /// Another thread that drops what a load has replaced.
    disposal: Option<Work<()>>,
    /// Client whose next command needs a job.
    waiting: Option<u64>,
    /// Memory for the next one.
    spare: Option<Spare>,
    /// A command has been applied since the last step.
    is_commanded: bool,
    boundary: Boundary,
    cpus: Cpus,
    pub(crate) real_time: RealTime,
    /// Rests of a loop with real-time scheduling.
    rest: Option<Rest>,
    polling: Polling,
    /// Lateness of a step whose time has come, but whose members are not ready.
    met: Option<u64>,
    progress: Progress,
    pace: Pace,
    pub(crate) statistics: Statistics,
    pub(crate) step: u64,
    /// The run ends after this step.
    last_step: Option<u64>,
    /// CLOCK_MONOTONIC at the start of the run.
    start_ns: u64,
    /// Time spent paused.
    paused_ns: u64,
    /// CLOCK_MONOTONIC up to which `paused_ns` is counted.
    mark_ns: u64,
    next_status_ns: u64,
    /// Set once a file of the services is gone.
    is_file_missing: bool,
    warnings: Warnings,
}

impl Node {
    /// Takes the name and publishes the scene, without starting the run. The solver has one thread.
    pub(crate) fn new(
        endpoint: &Endpoint,
        scene: Scene,
        solver: Solver,
        options: Options,
    ) -> anyhow::Result<Self> {
        // Before the publisher, which checks that there is memory for the rest.
        let history = History::new(options.history_bytes, &solver)?;
        let publisher = Publisher::new(endpoint, &scene, &solver, options.every)?;
        let now_ns = monotonic_ns();
        Ok(Self {
            options,
            publisher,
            inbox: Inbox::default(),
            arrived: Vec::new(),
            grab_connections: GrabConnections::default(),
            lockstep: Lockstep::new(options.lockstep_timeout),
            history,
            job: None,
            disposal: None,
            waiting: None,
            spare: None,
            is_commanded: false,
            boundary: Boundary::Open,
            cpus: Cpus::observe(),
            real_time: RealTime::default(),
            rest: None,
            polling: Polling::default(),
            met: None,
            progress: Progress {
                is_paused: options.starts_paused,
                steps_due: 0,
                is_state_due: false,
                time_scale: 1.0,
            },
            pace: Pace::new(scene.solver.rate_hz, now_ns),
            statistics: Statistics::new(now_ns)?,
            step: 0,
            last_step: options.last_step(scene.solver.rate_hz),
            start_ns: now_ns,
            paused_ns: 0,
            mark_ns: now_ns,
            next_status_ns: now_ns,
            is_file_missing: false,
            warnings: Warnings::default(),
            scene,
            solver,
        })
    }

    /// Runs until the last step or a request to stop. Calls `observer` once a second.
    pub(crate) fn run(&mut self, stop: &Stop, observer: impl Fn(&Self)) -> anyhow::Result<()> {
        self.start_ns = monotonic_ns();
        // Pauses count from here, or a run that ends paused would have paused for longer than it lasted.
        self.mark_ns = self.start_ns;
        self.pace.restart(self.start_ns);
        self.publisher.publish_step(&self.solver, self.position(), StepTimes::default())?;
        self.check_history();
        self.keep_state();
        self.observe(&observer)?;
        while !stop.is_requested() && !self.is_done() {
            let due = self.met.take().or_else(|| self.wait());
            if stop.is_requested() {
                break;
            }
            if !self.wait_for_members()? {
                self.met = due;
                self.observe(&observer)?;
                continue;
            }
            self.publisher.phases.begin();
            let was_stepping = self.progress.is_stepping();
            self.apply_commands(due.is_some(), stop)?;
            self.publisher.phases.end(Phase::Drain);
            if stop.is_requested() {
                break;
            }
            if self.boundary == Boundary::OfNewRun {
                self.boundary = Boundary::Open;
                self.observe(&observer)?;
                continue;
            }
            // A resumed node first waits for the members, which it did not while paused.
            let has_waited = was_stepping || !self.lockstep.has_members();
            if let Some(wake_late_ns) = due
                && self.progress.is_stepping()
                && has_waited
            {
                if !self.make_step(wake_late_ns, stop)? {
                    break;
                }
            } else {
                self.publisher.publish_between(&self.solver, self.position())?;
            }
            self.observe(&observer)?;
            self.publisher.phases.end(Phase::Observe);
            self.publisher.phases.record();
        }
        // Those of the last boundary, if its step was not made.
        self.publisher.publish_outcomes()
    }

    fn is_done(&self) -> bool {
        self.last_step.is_some_and(|last| self.step >= last)
    }

    /// Waits for the deadline of the next step, at most one polling interval. Returns the lateness of
    /// the step; `None` if it is not due yet.
    ///
    /// A paused node has no deadline: a command that lets it step makes the step due at once.
    fn wait(&mut self) -> Option<u64> {
        if !self.progress.is_stepping() {
            sleep_until(self.polling.next_ns(monotonic_ns(), PAUSED_POLL_NS));
            let now_ns = monotonic_ns();
            self.paused_ns += now_ns - self.mark_ns;
            self.mark_ns = now_ns;
            self.pace.restart(now_ns);
            return Some(0);
        }
        if !self.options.waits_for_time {
            return Some(0);
        }
        if self.progress.is_state_due {
            // It came while the node waited, and shows at once, as it does while paused.
            self.pace.restart(monotonic_ns());
            return Some(0);
        }
        let (now_ns, deadline_ns) = (monotonic_ns(), self.pace.deadline_ns());
        if now_ns + WAITING_POLL_NS < deadline_ns {
            sleep_until(self.polling.next_ns(now_ns, WAITING_POLL_NS));
            return None;
        }
        let rest = self.rest.as_mut();
        sleep_until(
            rest.map_or(deadline_ns, |rest| rest.end_ns(now_ns, deadline_ns, thread_time_ns)),
        );
        Some(self.pace.meet(monotonic_ns()))
    }

    /// Waits until the members of the lockstep are ready for the next step, at most one polling interval.
    /// Returns `true` if they are. A paused node waits for nobody.
    fn wait_for_members(&mut self) -> anyhow::Result<bool> {
        let is_stepping = self.progress.is_stepping();
        let Self { lockstep, publisher, step, warnings, .. } = self;
        let step = *step;
        let mut events = Vec::new();
        let mut report = |event| events.push(event);
        // A step that was not published has no turns.
        let is_ready = if is_stepping && publisher.has_published(step) {
            lockstep.wait(publisher, step, monotonic_ns() + WAITING_POLL_NS, &mut report)
        } else {
            lockstep.receive(publisher, Published::new(publisher, step), &mut report);
            true
        };
        lockstep.search(publisher, &mut report);
        for event in &events {
            lockstep.changes.add(event.to_change(step));
            match event {
                Event::TimedOut { .. } => warnings.print(&event.describe(step)),
                _ => warnings.note(&event.describe(step)),
            }
        }
        if !events.is_empty() {
            // At once: clients wait for their membership, and a load may begin another run.
            self.publisher.publish_status(&self.status())?;
        }
        Ok(is_ready)
    }

    /// Makes and publishes a step. Returns `false` if it was given up because of a request to stop.
    fn make_step(&mut self, wake_late_ns: u64, stop: &Stop) -> anyhow::Result<bool> {
        let before_ns = monotonic_ns();
        let frozen_count = self.solver.frozen_count();
        let overflow_count = self.solver.contact_overflow_count();
        if !self.solver.step_unless(stop.flag()) {
            return Ok(false);
        }
        let solve_ns = monotonic_ns() - before_ns;
        self.publisher.phases.end(Phase::Solve);
        if self.solver.frozen_count() > frozen_count {
            let count = self.solver.frozen_count() - frozen_count;
            self.warnings.print(&format!(
                "step {}: froze {count} particles whose state was not finite; `ctl reset` restores \
                 them",
                self.step + 1
            ));
        }
        if self.solver.contact_overflow_count() > overflow_count {
            self.warnings.print(&format!(
                "step {}: the particles are piled up so densely that some contacts were left out; more \
                 substeps or a smaller contact thickness avoid it",
                self.step + 1
            ));
        }
        self.step += 1;
        self.progress.count_step();
        if !self.progress.is_stepping() {
            // A fresh status follows, so that `ctl status` shows the steps.
            self.next_status_ns = 0;
        }
        self.statistics.record(wake_late_ns, solve_ns, self.pace.period_ns());
        self.statistics.skipped_periods = self.pace.skipped_periods;
        let times = StepTimes { wake_late_ns, solve_ns };
        if let Err(error) = self.publisher.publish_forces(&self.solver, self.step) {
            self.warnings.print(&format!("no forces are published: {error}"));
        }
        self.publisher.publish_step(&self.solver, self.position(), times)?;
        self.keep_state();
        Ok(true)
    }

    /// Warns if the history is too small for the scene.
    fn check_history(&mut self) {
        if !self.history.has_room(&self.solver) {
            self.warnings.print(
                "no past state is kept, because a state of this scene is larger than --history",
            );
        }
    }

    /// Keeps the state of a step for a rewind.
    fn keep_state(&mut self) {
        self.boundary = Boundary::Open;
        let is_commanded = std::mem::take(&mut self.is_commanded);
        self.history.keep(self.step, &self.solver, is_commanded);
        self.publisher.phases.end(Phase::Keep);
    }

    /// Serves late subscribers, calls the observer, and publishes the status.
    fn observe(&mut self, observer: &impl Fn(&Self)) -> anyhow::Result<()> {
        self.publisher.refresh();
        let now_ns = monotonic_ns();
        if self.progress.is_stepping() {
            self.mark_ns = now_ns;
        }
        self.warnings.note_dropped(now_ns);
        if self.statistics.end_second(now_ns, self.scene.solver.rate_hz) {
            self.check_files();
            observer(self);
        }
        if now_ns >= self.next_status_ns {
            self.next_status_ns = now_ns + STATUS_PERIOD_NS;
            self.publisher.publish_status(&self.status())?;
        }
        Ok(())
    }

    /// Warns once if a file of the services is gone.
    fn check_files(&mut self) {
        if !self.is_file_missing
            && let Some(path) = self.publisher.missing_file()
        {
            self.is_file_missing = true;
            self.warnings.print(&format!(
                "{} is gone, perhaps removed by a cleaner of /tmp: connected programs continue, but \
                 no other program can attach until this node is restarted",
                path.display()
            ));
        }
    }

    /// Records the times of the phases of each step from now on.
    pub(crate) fn record_phases(&mut self) -> anyhow::Result<()> {
        self.publisher.phases = Phases::recording()?;
        Ok(())
    }

    /// Returns the recorded times; `None` unless [`Self::record_phases`] was called.
    pub(crate) fn phase_times(&self) -> Option<&PhaseTimes> {
        self.publisher.phases.times()
    }

    pub(crate) fn status(&self) -> NodeStatus {
        let Self { publisher, scene, solver, statistics, lockstep, .. } = self;
        let mut status = publisher.status(scene, solver, self.position(), statistics);
        status.rejected_count += lockstep.refused_count;
        status.member_changes = lockstep.changes;
        for (entry, member) in
            status.members.iter_mut().zip(lockstep.members(Published::new(publisher, self.step)))
        {
            *entry = member;
            status.member_count += 1;
        }
        status
    }

    /// Simulated time per wall-clock time of the whole run, without its pauses.
    pub(crate) fn real_time_factor(&self) -> f64 {
        let run_ns = monotonic_ns() - self.start_ns - self.paused_ns;
        let simulated_s = self.step as f64 / f64::from(self.scene.solver.rate_hz);
        simulated_s / (run_ns.max(1) as f64 / SECOND_NS as f64)
    }

    fn position(&self) -> Position {
        let is_last = self.is_done() || !self.progress.is_stepping();
        let Progress { is_paused, time_scale, .. } = self.progress;
        Position { step: self.step, is_paused, time_scale, is_last }
    }
}
