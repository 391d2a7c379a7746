//! `run`: runs a scene and prints messages for the user.

use std::io::{IsTerminal, Write, stderr};

use anyhow::anyhow;
use serde::Serialize;
use sim_contract::Endpoint;
use sim_host::{Stop, report_bus_errors};
use sim_solver::{Scene, Solver};

use crate::args::RunArgs;
use crate::node::{Node, Options, RealTime};
use crate::{output, scene_source};

/// Summary at the end of a run.
#[derive(Debug, Serialize)]
struct Summary {
    scene: String,
    rate_hz: u32,
    threads: usize,
    steps: u64,
    real_time_factor: f64,
    late_steps: u64,
    skipped_periods: u64,
    rejected_commands: u64,
    wake_late_ns_p50: u64,
    wake_late_ns_p99: u64,
    solve_ns_p50: u64,
    solve_ns_p99: u64,
    state_hash: String,
    real_time: RealTime,
}

/// Runs a scene.
pub(crate) fn run(args: &RunArgs) -> anyhow::Result<()> {
    report_bus_errors()?;
    let mut scene = scene_source::load(&args.scene)?;
    scene.override_solver(args.rate, args.substeps).map_err(|problem| anyhow!("--{problem}"))?;
    let endpoint = args.endpoint.endpoint()?;
    let options = Options {
        rate_hz: args.rate,
        substeps: args.substeps,
        threads: args.threads,
        steps: args.steps,
        duration: args.duration,
        starts_paused: args.paused,
        waits_for_time: !args.as_fast_as_possible,
        every: args.every,
        lockstep_timeout: args.lockstep_timeout,
        history_bytes: usize::try_from(args.history.as_u64()).unwrap_or(usize::MAX),
        real_time: args.real_time.options(),
    };
    scene.check_memory(scene.published_bytes())?;
    warn(&scene);
    // Building a large scene takes seconds. Until the node owns anything, a signal ends it at once.
    let solver = Solver::new(&scene);
    let stop = Stop::install()?;
    let mut node = Node::new(&endpoint, scene, solver, options)?;
    for line in node.prepare()? {
        output::note(&line);
    }
    print_ready(&endpoint, &node);
    let is_terminal = stderr().is_terminal();
    let shows_status = is_terminal && !args.json;
    let result = node.run(&stop, |node| {
        if shows_status {
            show_status(node);
        }
    });
    let summary = Summary::new(&node);
    // The name is free before the summary is printed: its reader may start the next node.
    drop(node);
    result?;
    summary.print(args.json, shows_status)
}

fn warn(scene: &Scene) {
    for warning in sim_solver::warnings(scene) {
        output::note(&format!("warning: {warning}"));
    }
}

fn print_ready(endpoint: &Endpoint, node: &Node) {
    let settings = &node.scene.solver;
    let threads = node.solver.threads();
    output::note(&format!(
        "ready: {endpoint}: scene {}, {} particles, {} constraints, {} Hz x {} substeps, \
         {threads} thread{}; see it with: viewer-bridge{}",
        node.scene.name,
        node.solver.particle_count(),
        node.solver.constraint_count(),
        settings.rate_hz,
        settings.substeps,
        if threads == 1 { "" } else { "s" },
        endpoint.options(),
    ));
}

/// Prints one status line on the terminal, over the previous one.
fn show_status(node: &Node) {
    let status = node.status();
    let micros = |ns: u64| ns as f64 / 1000.0;
    // A failure to show the status is no reason to stop.
    let _ignored = write!(
        stderr(),
        "\r\x1b[Kstep {} {} x{:.3} real time | step time p50 {:.1} µs p99 {:.1} µs | {} late | {} readers",
        status.step,
        if status.is_paused() { "paused" } else { "at" },
        status.real_time_factor,
        micros(status.solve_ns_p50),
        micros(status.solve_ns_p99),
        status.late_steps,
        status.reader_count,
    );
}

impl Summary {
    fn new(node: &Node) -> Self {
        let (status, run) = (node.status(), &node.statistics.run);
        Self {
            scene: node.scene.name.clone(),
            rate_hz: node.scene.solver.rate_hz,
            threads: node.solver.threads(),
            steps: node.step,
            real_time_factor: node.real_time_factor(),
            late_steps: status.late_steps,
            skipped_periods: status.skipped_periods,
            rejected_commands: status.rejected_count,
            wake_late_ns_p50: run.wake_late_ns(0.5),
            wake_late_ns_p99: run.wake_late_ns(0.99),
            solve_ns_p50: run.solve_ns(0.5),
            solve_ns_p99: run.solve_ns(0.99),
            state_hash: format!("{:016x}", node.solver.state_hash()),
            real_time: node.real_time,
        }
    }

    fn print(&self, as_json: bool, is_after_status: bool) -> anyhow::Result<()> {
        if as_json {
            return output::json(self);
        }
        if is_after_status {
            output::note("");
        }
        output::note(&format!(
            "done: {} steps, x{:.3} real time, {} late, state hash {}",
            self.steps, self.real_time_factor, self.late_steps, self.state_hash
        ));
        Ok(())
    }
}
