//! One measurement: a loop on a thread of its own for a given time, with its clients.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::{Context, ensure};
use serde::Serialize;
use sim_contract::ScratchDomain;
use sim_host::Stop;
use sim_host::clock::{SECOND_NS, monotonic_ns, sleep_until};
use sim_solver::{Scene, Solver};

use super::children::Children;
use super::client::ClientResult;
use super::times::Samples;
use crate::args::ClientRole;
use crate::node::{Cpus, Node, Options, PhaseTimes, RealTime, RealTimeOptions, prepare};

/// Memory for past states: the default of `run`.
const HISTORY_BYTES: usize = 64 << 20;
/// Interval between two looks at the end of a measurement.
const POLL_NS: u64 = SECOND_NS / 50;
/// Longest wait of a node for the member of the lockstep, which a busy machine may delay.
const LOCKSTEP_TIMEOUT: Duration = Duration::from_secs(10);

/// Settings of all measurements.
#[derive(Debug)]
pub(super) struct Bench {
    pub(super) scene: Scene,
    /// Time of each measurement.
    pub(super) duration: Duration,
    pub(super) real_time: RealTimeOptions,
    pub(super) domain: ScratchDomain,
    /// Ctrl-C.
    pub(super) interrupt: Stop,
}

/// Pace of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Mode {
    /// In real time.
    Paced,
    /// It makes no step.
    Paused,
    /// It never waits, so it has no real-time scheduling.
    AsFastAsPossible,
}

/// Result of a node.
pub(super) struct NodeRun {
    pub(super) wake_late: Samples,
    pub(super) late_steps: u64,
    pub(super) phases: PhaseTimes,
    pub(super) thread_count: usize,
    pub(super) clients: Vec<ClientResult>,
}

/// Result of a bare loop.
pub(super) struct BareRun {
    pub(super) wake_late: Samples,
    pub(super) real_time: RealTime,
    /// Lines for people about the real-time properties.
    pub(super) lines: Vec<String>,
}

/// Time of a measurement.
#[derive(Debug, Default)]
struct Limit {
    stop: Stop,
    /// End of the measurement; 0 until it begins.
    end_ns: AtomicU64,
}

impl Mode {
    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Paced => "in real time",
            Self::Paused => "while paused",
            Self::AsFastAsPossible => "as fast as possible",
        }
    }
}

impl Bench {
    /// Measures a loop that only sleeps, at the rate of the scene.
    pub(super) fn run_bare_loop(&self) -> anyhow::Result<BareRun> {
        self.run(|limit| {
            let prepared = prepare(self.real_time, &mut Cpus::observe())?;
            let rate_hz = u64::from(self.scene.solver.rate_hz);
            let mut wake_late = Samples::new()?;
            let start_ns = self.begin(limit);
            let deadlines = (1..).map(|count| start_ns + count * SECOND_NS / rate_hz);
            for deadline_ns in deadlines {
                sleep_until(deadline_ns);
                if limit.stop.is_requested() {
                    break;
                }
                wake_late.record(monotonic_ns().saturating_sub(deadline_ns));
            }
            Ok(BareRun { wake_late, real_time: prepared.real_time, lines: prepared.lines })
        })
    }

    /// Measures a node with clients.
    pub(super) fn run_node(&self, mode: Mode, roles: &[ClientRole]) -> anyhow::Result<NodeRun> {
        self.run(|limit| {
            let solver = Solver::new(&self.scene);
            let options = self.options(mode);
            let mut node = Node::new(&self.domain.endpoint(), self.scene.clone(), solver, options)?;
            // They would inherit real-time scheduling.
            let clients = Children::start(&self.domain, roles)?;
            node.record_phases()?;
            node.prepare()?;
            self.begin(limit);
            node.run(&limit.stop, |_| {})?;
            // The node still owns its name, so no client finds itself without one.
            let clients = clients.finish()?;
            let mut wake_late = Samples::new()?;
            wake_late.add(node.statistics.run.wake_late());
            Ok(NodeRun {
                wake_late,
                late_steps: node.statistics.late_steps,
                phases: node.phase_times().context("the phases are recorded")?.clone(),
                thread_count: node.solver.threads(),
                clients,
            })
        })
    }

    fn options(&self, mode: Mode) -> Options {
        let real_time = match mode {
            Mode::AsFastAsPossible => {
                RealTimeOptions { cpu: self.real_time.cpu, ..Default::default() }
            }
            Mode::Paced | Mode::Paused => self.real_time,
        };
        Options {
            rate_hz: None,
            substeps: None,
            threads: None,
            steps: None,
            duration: None,
            history_bytes: HISTORY_BYTES,
            starts_paused: mode == Mode::Paused,
            waits_for_time: mode != Mode::AsFastAsPossible,
            every: 1,
            lockstep_timeout: LOCKSTEP_TIMEOUT,
            real_time,
        }
    }

    /// Begins the time of a measurement, and returns its start.
    fn begin(&self, limit: &Limit) -> u64 {
        let now_ns = monotonic_ns();
        let duration_ns = u64::try_from(self.duration.as_nanos()).unwrap_or(u64::MAX);
        limit.end_ns.store(now_ns.saturating_add(duration_ns), Ordering::Relaxed);
        now_ns
    }

    /// Runs `work` on a thread of its own, whose scheduling ends with it, and requests its end.
    fn run<T: Send>(
        &self,
        work: impl FnOnce(&Limit) -> anyhow::Result<T> + Send,
    ) -> anyhow::Result<T> {
        let limit = Limit::default();
        let result = thread::scope(|scope| {
            let worker = scope.spawn(|| work(&limit));
            while !worker.is_finished() {
                sleep_until(monotonic_ns() + POLL_NS);
                let end_ns = limit.end_ns.load(Ordering::Relaxed);
                let is_over = end_ns > 0 && monotonic_ns() >= end_ns;
                if is_over || self.interrupt.is_requested() {
                    limit.stop.flag().store(true, Ordering::Relaxed);
                }
            }
            worker.join().unwrap_or_else(|panic| resume_unwind(panic))
        });
        ensure!(!self.interrupt.is_requested(), "interrupted before the end of the measurement");
        result
    }
}
