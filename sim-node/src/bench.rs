//! `bench`: measures the loop, its readers and its clients on this machine.
//!
//! Each measurement runs the node itself, not a model of it, on a thread of its own, in a domain that
//! only this process uses. Readers and other clients are processes of their own. A bare loop, which
//! only sleeps, alternates with the node's loop, so that both meet the same load of the machine.

mod children;
pub(crate) mod client;
mod measurement;
mod report;
mod table;
mod times;

use std::io::{IsTerminal, stderr};

use anyhow::anyhow;
use sim_contract::ScratchDomain;
use sim_host::{Stop, report_bus_errors};

use crate::args::{BenchArgs, ClientRole};
use crate::node::{Phase, PhaseTimes, RealTime};
use crate::{output, scene_source};
use measurement::{Bench, Mode, NodeRun};
use report::Machine;
use report::{Build, CommandRow, LatencyRow, LockstepRow, LoopRow, PhaseRow, Report, Wait};
use times::{Percentiles, Samples};

/// Rounds of the bare loop and of the node's loop.
const ROUND_COUNT: usize = 2;
/// Nodes that a command is sent to.
const COMMAND_MODES: [Mode; 3] = [Mode::AsFastAsPossible, Mode::Paused, Mode::Paced];

/// Measures and prints the report.
pub(crate) fn bench(args: &BenchArgs) -> anyhow::Result<()> {
    report_bus_errors()?;
    let mut scene = scene_source::load(&args.scene)?;
    scene.override_solver(args.rate, None).map_err(|problem| anyhow!("--{problem}"))?;
    let bench = Bench {
        scene,
        duration: args.duration,
        real_time: args.real_time.options(),
        interrupt: Stop::install()?,
        domain: ScratchDomain::new("bench"),
    };
    let report = measure(&bench, &args.reader_counts())?;
    if args.json { output::json(&report) } else { output::text(&table::text(&report)) }
}

fn measure(bench: &Bench, reader_counts: &[usize]) -> anyhow::Result<Report> {
    let machine = Machine::observe();
    // A polling reader occupies a core, and the loop needs one.
    let polling_max = machine.core_count.saturating_sub(1);
    let polling_counts: Vec<_> =
        reader_counts.iter().copied().filter(|count| (1..=polling_max).contains(count)).collect();
    let count = ROUND_COUNT * (1 + reader_counts.len()) + polling_counts.len();
    let mut progress = Progress { index: 0, count: count + COMMAND_MODES.len() + 1 };

    let mut loops = Loops::new(reader_counts)?;
    for _ in 0..ROUND_COUNT {
        loops.run_round(bench, &mut progress)?;
    }
    let mut latencies = Vec::new();
    for group in &loops.groups {
        if group.reader_count > 0 {
            latencies.push(group.latency_row(Wait::Event));
        }
    }
    for reader_count in polling_counts {
        progress.begin(&format!("the loop with {}, polling", table::readers(reader_count)));
        let mut group = Group::new(reader_count)?;
        group.add(&bench.run_node(Mode::Paced, &vec![ClientRole::PollingReader; reader_count])?);
        latencies.push(group.latency_row(Wait::Poll));
    }
    let commands = COMMAND_MODES.map(|mode| command_row(bench, mode, &mut progress));
    let bare_loop = loops.bare.percentiles();
    Ok(Report {
        scene: bench.scene.name.clone(),
        particle_count: bench.scene.counts().particles,
        rate_hz: bench.scene.solver.rate_hz,
        thread_count: loops.thread_count,
        duration_s: bench.duration.as_secs_f64(),
        build: if cfg!(debug_assertions) { Build::Debug } else { Build::Release },
        machine,
        real_time: loops.real_time,
        bare_loop,
        loops: loops.groups.iter().map(|group| group.loop_row(bare_loop)).collect(),
        latencies,
        commands: commands.into_iter().collect::<Result<_, _>>()?,
        lockstep: lockstep_row(bench, &mut progress)?,
    })
}

/// Count of the measurements, shown on a terminal.
struct Progress {
    index: usize,
    count: usize,
}

impl Progress {
    fn begin(&mut self, title: &str) {
        self.index += 1;
        if stderr().is_terminal() {
            output::note(&format!("measuring {} of {}: {title}", self.index, self.count));
        }
    }
}

/// The bare loop and the node's loop, over all rounds.
struct Loops {
    bare: Samples,
    groups: Vec<Group>,
    real_time: RealTime,
    thread_count: usize,
}

/// Nodes with the same number of readers.
struct Group {
    reader_count: usize,
    wake_late: Samples,
    late_step_count: u64,
    /// By phase.
    phases: [Samples; Phase::ALL.len()],
    outside_solver: Samples,
    latency: Samples,
    missed_count: u64,
}

impl Loops {
    fn new(reader_counts: &[usize]) -> anyhow::Result<Self> {
        let groups = reader_counts.iter().map(|count| Group::new(*count));
        Ok(Self {
            bare: Samples::new()?,
            groups: groups.collect::<Result<_, _>>()?,
            real_time: RealTime::default(),
            thread_count: 0,
        })
    }

    /// Runs the bare loop, then a node with each number of readers.
    fn run_round(&mut self, bench: &Bench, progress: &mut Progress) -> anyhow::Result<()> {
        progress.begin("a loop that only sleeps");
        let bare = bench.run_bare_loop()?;
        if self.thread_count == 0 {
            bare.lines.iter().for_each(|line| output::note(line));
        }
        self.real_time = bare.real_time;
        self.bare.add_list(&bare.wake_late.list());
        for group in &mut self.groups {
            progress.begin(&format!("the loop with {}", table::readers(group.reader_count)));
            let roles = vec![ClientRole::Reader; group.reader_count];
            let run = bench.run_node(Mode::Paced, &roles)?;
            self.thread_count = run.thread_count;
            group.add(&run);
        }
        Ok(())
    }
}

impl Group {
    fn new(reader_count: usize) -> anyhow::Result<Self> {
        let empty = Samples::new()?;
        Ok(Self {
            reader_count,
            wake_late: empty.clone(),
            late_step_count: 0,
            phases: Phase::ALL.map(|_| empty.clone()),
            outside_solver: empty.clone(),
            latency: empty,
            missed_count: 0,
        })
    }

    fn add(&mut self, run: &NodeRun) {
        self.wake_late.add_list(&run.wake_late.list());
        self.late_step_count += run.late_steps;
        let PhaseTimes { phases, outside_solver } = &run.phases;
        for (samples, histogram) in self.phases.iter_mut().zip(phases) {
            samples.add(histogram);
        }
        self.outside_solver.add(outside_solver);
        for client in &run.clients {
            self.latency.add_list(&client.samples);
            self.missed_count += client.missed_count;
        }
    }

    fn loop_row(&self, bare: Percentiles) -> LoopRow {
        let wake_late = self.wake_late.percentiles();
        let [drain, solve, publish, wake, keep, observe] =
            self.phases.each_ref().map(Samples::percentiles);
        let outside_solver = self.outside_solver.percentiles();
        LoopRow {
            reader_count: self.reader_count,
            wake_late,
            wake_late_ratio_p50: ratio(wake_late.p50_ns, bare.p50_ns),
            wake_late_ratio_p99: ratio(wake_late.p99_ns, bare.p99_ns),
            late_step_count: self.late_step_count,
            phases: PhaseRow { drain, solve, publish, wake, keep, observe, outside_solver },
        }
    }

    fn latency_row(&self, wait: Wait) -> LatencyRow {
        LatencyRow {
            reader_count: self.reader_count,
            wait,
            latency: self.latency.percentiles(),
            missed_count: self.missed_count,
        }
    }
}

/// Quotient of two times with three decimal places; `None` without a divisor.
fn ratio(time_ns: u64, bare_ns: u64) -> Option<f64> {
    let quotient = time_ns as f64 / bare_ns as f64;
    (bare_ns > 0).then(|| (quotient * 1000.0).round() / 1000.0)
}

fn command_row(bench: &Bench, mode: Mode, progress: &mut Progress) -> anyhow::Result<CommandRow> {
    progress.begin(&format!("commands to a node {}", mode.text()));
    let run = bench.run_node(mode, &[ClientRole::Commander])?;
    let mut round_trip = Samples::new()?;
    run.clients.iter().for_each(|client| round_trip.add_list(&client.samples));
    Ok(CommandRow { node: mode, round_trip: round_trip.percentiles() })
}

fn lockstep_row(bench: &Bench, progress: &mut Progress) -> anyhow::Result<LockstepRow> {
    progress.begin("the lockstep with one member");
    let run = bench.run_node(Mode::AsFastAsPossible, &[ClientRole::Member])?;
    let mut round_trip = Samples::new()?;
    run.clients.iter().for_each(|client| round_trip.add_list(&client.samples));
    let round_trip = round_trip.percentiles();
    let rates = run.clients.iter().map(|client| client.rate(round_trip.count));
    Ok(LockstepRow { steps_per_s: rates.sum::<f64>().round(), round_trip })
}
