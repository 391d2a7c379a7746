//! `recorder simulate`: a recording without a node.

use std::fmt;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use anyhow::Context;
use recorder::{Closing, OutcomeRow};
use serde::Serialize;
use sim_contract::Stop;
use sim_contract::clock::{SECOND_NS, monotonic_ns};
use sim_solver::Solver;

use crate::exit::Exit;
use crate::output::{self, AsJson, FileArgs, LogFile};
use crate::scene_source::{load_commands, load_scene};
use crate::simulation::{Job, Outcomes, simulate};
use crate::thread_args::ThreadArgs;

/// Steps between two looks at the signals and two moves of the progress bar.
const STEPS_PER_LOOK: u64 = 256;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    recorder simulate curtain --steps 24000\n  \
    recorder simulate curtain --steps 2400 -o drag.mcap --commands drag.jsonl\n  \
    recorder simulate live.mcap --steps 2400 --commands live.mcap -o again.mcap")]
pub(crate) struct SimulateArgs {
    /// A built-in scene, a TOML file (a path with / or ending in .toml), or the scene of a
    /// recording (ending in .mcap)
    scene: String,
    /// Steps to make after step 0, from 0
    #[arg(long, value_name = "N")]
    steps: u64,
    /// Recording to write [default: none, only the summary is printed]
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// Commands: JSON lines, or the outcomes of a recording (ending in .mcap) [default: none]
    #[arg(long, value_name = "FILE")]
    commands: Option<String>,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    file: FileArgs,
    #[command(flatten)]
    as_json: AsJson,
}

/// The summary.
#[derive(Debug, Serialize)]
struct Summary {
    scene: String,
    steps: u64,
    state_hash: String,
    applied: u64,
    rejected: u64,
    /// Simulated time per wall-clock time.
    real_time_factor: f64,
    wall_s: f64,
    output: Option<String>,
}

pub(crate) fn run(args: &SimulateArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    let scene = load_scene(&args.scene)?;
    let commands = args.commands.as_deref().map_or(Ok(Vec::new()), load_commands)?;
    let job = Job { scene, commands, steps: args.steps };
    let beyond = job.commands_beyond_the_end();
    if beyond > 0 {
        output::note(&format!(
            "warning: commands for steps after {}, the last one: {beyond}",
            args.steps
        ));
    }
    let mut solver = Solver::new(&job.scene);
    solver.set_threads(args.threads.count());
    let mut log =
        args.output.as_deref().map(|path| begin(args, path, &job, &solver)).transpose()?;

    let bar = output::progress_bar(args.steps);
    let before_ns = monotonic_ns();
    let outcomes = simulate(&job, solver, log.as_mut(), |step| {
        if !step.is_multiple_of(STEPS_PER_LOOK) {
            return ControlFlow::Continue(());
        }
        bar.set_position(step);
        if stop.is_asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
    .with_context(|| cut_off(args))?;
    bar.finish_and_clear();
    let path = log.map(|log| finish(log, &outcomes, args.steps)).transpose()?;
    let wall_ns = monotonic_ns() - before_ns;

    say_rejected(&outcomes);
    let summary = summary(&job, &outcomes, wall_ns, path.as_deref());
    output::result(args.as_json, &summary, &summary.to_string())?;
    Ok(if outcomes.steps < args.steps { Exit::Loss } else { Exit::Done })
}

/// What an error of writing means for the file.
fn cut_off(args: &SimulateArgs) -> String {
    let path = args.output.as_deref().map(output::name_of).unwrap_or_default();
    format!("{path} is cut off, what is readable is in {path}.part")
}

fn begin(args: &SimulateArgs, path: &Path, job: &Job, solver: &Solver) -> anyhow::Result<LogFile> {
    let file = args.file.create(path)?;
    args.file.begin(file, &job.description(solver), job.scene.to_toml().as_bytes(), 0)
}

fn finish(log: LogFile, outcomes: &Outcomes, steps: u64) -> anyhow::Result<PathBuf> {
    let stop_reason = if outcomes.steps < steps { "interrupted" } else { "steps reached" };
    let mut closing = Closing { stop_reason: stop_reason.to_owned(), counts: *log.counts() };
    closing.counts.set_received_to_written();
    Ok(log.finish(&closing)?.finish()?)
}

/// Names the first commands that were rejected; the recording has all of them.
fn say_rejected(outcomes: &Outcomes) {
    for outcome in &outcomes.rejections {
        let row = OutcomeRow::from(outcome);
        let kind = serde_json::to_value(row.action).unwrap_or_default();
        output::note(&format!(
            "warning: step {}: {} (client {}, sequence {}) was rejected: {}",
            row.step,
            kind["kind"].as_str().unwrap_or("a command"),
            row.client_id,
            row.sequence,
            row.reason
        ));
    }
}

fn summary(job: &Job, outcomes: &Outcomes, wall_ns: u64, path: Option<&Path>) -> Summary {
    let wall_s = wall_ns.max(1) as f64 / SECOND_NS as f64;
    let simulated_s = outcomes.steps as f64 / f64::from(job.scene.solver.rate_hz);
    Summary {
        scene: job.scene.name.clone(),
        steps: outcomes.steps,
        state_hash: format!("{:016x}", outcomes.state_hash),
        applied: outcomes.applied_count,
        rejected: outcomes.rejected_count,
        real_time_factor: simulated_s / wall_s,
        wall_s,
        output: path.map(output::name_of),
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "scene       {}", self.scene)?;
        writeln!(f, "steps       {}", self.steps)?;
        writeln!(f, "state_hash  {}", self.state_hash)?;
        writeln!(f, "commands    {} applied, {} rejected", self.applied, self.rejected)?;
        write!(f, "speed       {:.1} x real time ({:.2} s)", self.real_time_factor, self.wall_s)?;
        self.output.iter().try_for_each(|path| write!(f, "\nwritten     {path}"))
    }
}
