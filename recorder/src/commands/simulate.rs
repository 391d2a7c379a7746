//! `recorder simulate`: simulates a scene or a recording in this process, without a node.

mod changes;
mod completion;

use std::fmt;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::error::ErrorKind;
use recording::simulation::{
    Job, SimulationResult, Start, State, States, StepCount, begin_log, finish_log, recording_bytes,
    simulate,
};
use recording::{
    ContentSelection, LogEnd, LogOptions, LogReader, OutcomeRow, PartFile, TimedCommand, WriteError,
};
use serde::Serialize;
use sim_contract::{Action, Outcome, Reason, allowed_indices, printable_line};
use sim_host::clock::{SECOND_NS, monotonic_ns};
use sim_host::{Stop, part_path};
use sim_solver::{Scene, Solver};

use crate::cli::args::{FileArgs, LogFile, ThreadArgs};
use crate::cli::output::{self, AsJson, Exit, progress_bar, progress_spinner, with_usage};
use crate::cli::parse::whole_number;
use crate::input::{CommandSource, is_recording, load_scene};
use changes::{Changed, Changes, ChangesSurvey, parse_setting};
use completion::{Completed, Completion};

/// Steps between two updates of the progress bar.
const STEPS_PER_UPDATE: u64 = 256;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "A recording without --steps is simulated again from its first keyframe, compared with everything that it \
    has, and written with the particles of every snapshot. With --drop, --set or --commands, it is \
    simulated with other commands, from the last complete state before the first change to its last step; \
    `recorder diff` shows the effect.\n\n\
    Exit codes: 0 all steps computed; 1 failed; 3 interrupted before the last \
    step, or recording truncated or damaged. A rejected command is an outcome, not a failure.\n\nExamples:\n  \
    recorder simulate curtain --steps 24000\n  \
    recorder simulate curtain --steps 2400 -o drag.mcap --commands drag.jsonl\n  \
    recorder simulate rope --steps 480 -o rope.mcap --forces\n  \
    recorder simulate flight.mcap -o run.mcap\n  \
    recorder simulate run.mcap --drop 3 --set 480:damping=0.1 -o changed.mcap\n  \
    recorder simulate live.mcap --steps 2400 --commands live.mcap -o again.mcap"
)]
pub(crate) struct SimulateArgs {
    /// A built-in scene, a TOML file (a path with / or ending in .toml), or a recording with a
    /// scene (ending in .mcap)
    scene: String,
    /// Number of steps to compute after step 0 of the scene. Without it, a recording is simulated again with its
    /// own steps and commands
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = whole_number)]
    steps: Option<u64>,
    /// Recording to write [default: none, only the summary is printed]
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// Commands: a file of JSON lines, or a recording (ending in .mcap), whose outcomes are
    /// repeated [default: with --steps none, else those of the recording]
    #[arg(long, value_name = "FILE")]
    commands: Option<String>,
    /// Leave out the command with this index in /outcomes of the recording. Can be repeated
    #[arg(long, value_name = "INDEX", conflicts_with = "commands",
        allow_hyphen_values = true, value_parser = whole_number)]
    drop: Vec<u64>,
    /// Change a parameter from this step of the recording on. Can be repeated. PARAMETER is that of `ctl set`, such as
    /// damping, compliance.shear for one kind of constraint, or bending.1 for one generated block
    #[arg(long, value_name = "STEP:PARAMETER=VALUE",
        allow_hyphen_values = true, value_parser = parse_setting)]
    set: Vec<TimedCommand>,
    /// Record the forces on colliders, anchors and fixed particles in each step, too (/forces)
    #[arg(long)]
    forces: bool,
    /// Record the energy of each state in its row in /steps, too: kinetic, potential and elastic
    #[arg(long)]
    energy: bool,
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
    first_step: u64,
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
    if let Some(problem) = args.misplaced_change() {
        with_usage(&clap::Error::raw(ErrorKind::ArgumentConflict, problem));
    }
    if let Some(output) = &args.output {
        output::warn_of_extension(output, &["mcap"]);
    }
    let stop = Stop::install()?;
    match args.steps {
        Some(steps) => run_scene(args, steps, &stop),
        None if !is_recording(&args.scene) => {
            // A wrong scene is the worse mistake.
            load_scene(&args.scene, &stop)?;
            let text = "a scene needs --steps N; only a recording (ending in .mcap) has steps\n";
            with_usage(&clap::Error::raw(ErrorKind::MissingRequiredArgument, text))
        }
        None if args.has_changes() => run_changed(args, &stop),
        None if args.forces || args.energy => {
            let text = "--forces and --energy need --steps, --drop, --set or --commands: a recording that is simulated \
                        without changes keeps those that it has\n";
            with_usage(&clap::Error::raw(ErrorKind::MissingRequiredArgument, text))
        }
        None => run_recording(args, &stop),
    }
}

/// Simulates a recording again, and completes it.
fn run_recording(args: &SimulateArgs, stop: &Stop) -> anyhow::Result<Exit> {
    let path = Path::new(&args.scene);
    let log = LogReader::open_until(path, stop).with_context(|| args.scene.clone())?;
    let bar = progress_spinner();
    let before_ns = monotonic_ns();
    let completion =
        Completion::new(path, log, args.threads.count()).with_context(|| args.scene.clone())?;
    let create = || args.output.as_deref().map(|path| args.file.create(path)).transpose();
    let (completed, file) = completion
        .run(args.file.options(), create, stop.flag(), |step| {
            if step.is_multiple_of(STEPS_PER_UPDATE) {
                bar.set_message(format!("step {step}"));
            }
        })
        .with_context(|| args.scene.clone())?;
    bar.finish_and_clear();
    let output = file.map(PartFile::finish).transpose()?;
    let wall_ns = monotonic_ns() - before_ns;
    let Completed { scene, first_step, result, .. } = &completed;
    Simulated { scene, first_step: *first_step, result }.print(args, wall_ns, output.as_deref())?;
    if completed.end != LogEnd::Complete {
        output::warn_of_losses(path, &completed.end, "simulated as far as it goes", stop);
    }
    let is_complete = completed.end == LogEnd::Complete && !completed.is_interrupted;
    Ok(if is_complete { Exit::Done } else { Exit::Loss })
}

/// Simulates a recording again with changed commands.
fn run_changed(args: &SimulateArgs, stop: &Stop) -> anyhow::Result<Exit> {
    let source = args.commands(stop)?;
    let path = Path::new(&args.scene);
    let in_scene = || args.scene.clone();
    let survey = ChangesSurvey::read(path, stop).with_context(in_scene)?;
    let first_state = survey.first_state().with_context(in_scene)?;
    let replaced = source.map(|source| source.after(first_state)).transpose()?;
    let changes = Changes { dropped: args.drop.clone(), added: args.set.clone(), replaced };
    let changed = Changed::new(path, survey, changes, stop).with_context(in_scene)?;
    let end = changed.end.clone();
    let (job, solver, mut given) = changed.into_parts();
    let states = States { solver, given: |command: &TimedCommand| given.state_of(command) };
    let exit = run_job(args, &job, states, stop)?;
    if end == LogEnd::Complete {
        return Ok(exit);
    }
    output::warn_of_losses(path, &end, "simulated as far as it goes", stop);
    Ok(Exit::Loss)
}

/// Simulates a scene from its first step.
fn run_scene(args: &SimulateArgs, steps: u64, stop: &Stop) -> anyhow::Result<Exit> {
    let scene = load_scene(&args.scene, stop)?;
    let source = args.commands(stop)?;
    let commands = source.map_or(Ok(Vec::new()), |source| source.after(Start::default()))?;
    let job = Job::new(scene, commands, steps);
    if let (Some(warning), Some(source)) = (warning_of_late_commands(&job), &args.commands) {
        output::note(&format!("warning: {}: {warning}", printable_line(source)));
    }
    job.scene.check_memory(args.output.as_ref().map_or(0, |_| recording_bytes(&job.scene)))?;
    let solver = Solver::new(&job.scene);
    run_job(args, &job, States::first(solver), stop)
}

/// Simulates, and prints the summary.
fn run_job<E: From<WriteError> + Into<anyhow::Error>>(
    args: &SimulateArgs,
    job: &Job,
    mut states: States<impl FnMut(&TimedCommand) -> Result<Option<State>, E>>,
    stop: &Stop,
) -> anyhow::Result<Exit> {
    states.solver.set_threads(args.threads.count());
    states.solver.compute_forces(args.forces && args.output.is_some());
    let output = args.output.as_deref();
    let mut log = output.map(|path| begin(args, path, job, &states.solver)).transpose()?;
    let counts = ElementCounts::new(&job.scene, &states.solver);
    let first_step = job.start.step;
    let bar = progress_bar(job.steps - first_step);
    let before_ns = monotonic_ns();
    let result = simulate(job, states, log.as_mut(), stop.flag(), |step| {
        if step.is_multiple_of(STEPS_PER_UPDATE) {
            bar.set_position(step - first_step);
        }
    })
    .map_err(|error| in_output(args, error.into()))?;
    bar.finish_and_clear();
    let path = log.map(|log| finish(log, &result, job.steps)).transpose();
    let path = path.with_context(|| truncation(args))?;
    let wall_ns = monotonic_ns() - before_ns;

    note_rejections(&result, &counts);
    note_incomplete_contacts(&result);
    let simulated = Simulated { scene: &job.scene, first_step, result: &result };
    simulated.print(args, wall_ns, path.as_deref())?;
    Ok(if result.steps < job.steps { Exit::Loss } else { Exit::Done })
}

impl SimulateArgs {
    fn commands(&self, stop: &Stop) -> anyhow::Result<Option<CommandSource>> {
        self.commands.as_deref().map(|source| CommandSource::load(source, stop)).transpose()
    }

    /// Returns the problem of --drop or --set without a recording to change, or with the steps of a scene.
    fn misplaced_change(&self) -> Option<String> {
        let option = match (self.drop.is_empty(), self.set.is_empty()) {
            (true, true) => return None,
            (true, false) => "--set",
            (false, _) => "--drop",
        };
        let scene = &self.scene;
        if !is_recording(scene) {
            let steps = self.steps.unwrap_or(480);
            return Some(format!(
                "{option} changes a recording (ending in .mcap), and {scene} is a scene. Record it first: \
                 `recorder simulate {scene} --steps {steps} -o run.mcap`, then `recorder simulate run.mcap {option} \
                 ...`\n"
            ));
        }
        self.steps.map(|_| {
            format!(
                "{option} changes {scene} from one of its states to its last step, and --steps begins at step 0 of its \
                 scene: leave out --steps\n"
            )
        })
    }

    fn has_changes(&self) -> bool {
        self.commands.is_some() || !self.drop.is_empty() || !self.set.is_empty()
    }
}

/// Returns a warning if commands are for steps after the last one.
fn warning_of_late_commands(job: &Job) -> Option<String> {
    let (late_count, steps) = (job.commands_beyond_the_end(), job.steps);
    let last = job.commands.last().filter(|_| late_count > 0)?.step;
    let commands = match (late_count, job.commands.len()) {
        (1, 1) => "the only command is".to_owned(),
        (1, _) => "1 command is".to_owned(),
        (count, all) if count == all => format!("all {count} commands are"),
        (count, _) => format!("{count} commands are"),
    };
    Some(format!(
        "{commands} for steps after {steps}, the last one. Use --steps {last} or more to apply all"
    ))
}

/// Names the file that an error has left, if there is one.
fn in_output(args: &SimulateArgs, error: anyhow::Error) -> anyhow::Error {
    if args.output.is_some() { error.context(truncation(args)) } else { error }
}

/// Describes the file after a write error.
fn truncation(args: &SimulateArgs) -> String {
    let path = args.output.as_deref().unwrap_or(Path::new(""));
    output::incomplete(&output::path_text(path), &part_path(path))
}

fn begin(args: &SimulateArgs, path: &Path, job: &Job, solver: &Solver) -> anyhow::Result<LogFile> {
    let file = args.file.create(path)?;
    let (has_forces, has_energy) = (args.forces, args.energy);
    let selection = ContentSelection { has_forces, has_energy, ..ContentSelection::default() };
    let options = LogOptions { selection, ..args.file.options() };
    let log = begin_log(file, options, &job.description(solver), &job.scene);
    log.with_context(|| truncation(args))
}

fn finish(log: LogFile, result: &SimulationResult, steps: u64) -> anyhow::Result<PathBuf> {
    let stop_reason = if result.steps < steps { "interrupted" } else { "steps reached" };
    Ok(finish_log(log, stop_reason)?.finish()?)
}

/// Reports the first rejected commands. The recording has all of them.
fn note_rejections(result: &SimulationResult, counts: &ElementCounts) {
    for outcome in &result.rejections {
        let row = OutcomeRow::from(outcome);
        let kind = serde_json::to_value(row.action).unwrap_or_default();
        output::note(&format!(
            "warning: step {}: {} (client {}, sequence {}) was rejected: {}",
            row.step,
            kind["kind"].as_str().unwrap_or("a command"),
            row.client_id,
            row.sequence,
            cause(outcome, counts)
        ));
    }
}

/// Reports steps that left contacts out.
fn note_incomplete_contacts(result: &SimulationResult) {
    if let Some(StepCount { first_step, count }) = result.incomplete_contacts {
        output::note(&format!(
            "warning: from step {first_step} on, the particles were piled up so densely that some contacts were left \
             out (affected steps: {count}); more substeps or a smaller contact thickness avoid it"
        ));
    }
}

/// Numbers of the elements of a scene that commands name by an index.
struct ElementCounts {
    particles: usize,
    constraints: usize,
    anchors: usize,
    colliders: usize,
}

impl ElementCounts {
    fn new(scene: &Scene, solver: &Solver) -> Self {
        Self {
            particles: solver.particles().len(),
            constraints: solver.constraints().count(),
            anchors: scene.anchors.len(),
            colliders: scene.colliders.len(),
        }
    }

    /// Returns the allowed indices, if a command was rejected for an unknown one.
    fn allowed(&self, reason: Reason) -> Option<String> {
        Some(allowed_indices(match reason {
            Reason::UnknownParticle => self.particles,
            Reason::UnknownConstraint => self.constraints,
            Reason::UnknownAnchor => self.anchors,
            Reason::UnknownCollider => self.colliders,
            _ => return None,
        }))
    }
}

/// Returns the reason of a rejection with its meaning and its remedy.
fn cause(outcome: &Outcome, counts: &ElementCounts) -> String {
    let Some(reason) = outcome.reason() else { return outcome.reason_name().to_owned() };
    let action = outcome.command.action();
    let remedy = match reason {
        Reason::NoEffectHere => missing_condition(&action).map(str::to_owned),
        _ => counts.allowed(reason).or_else(|| outcome.remedy()),
    };
    let remedy = remedy.map_or_else(String::new, |remedy| format!(" ({remedy})"));
    format!("{}: {reason}{remedy}", reason.name())
}

/// Condition under which a command has an effect in a simulation.
fn missing_condition(action: &Action) -> Option<&'static str> {
    match action {
        Action::Load { .. } => {
            Some("a simulation has one scene; simulate the other one on its own")
        }
        Action::Restore { .. } => Some("only the commands of a recording have a state to restore"),
        _ => action.missing_condition(),
    }
}

/// The part of a summary that depends on the kind of simulation.
struct Simulated<'a> {
    scene: &'a Scene,
    first_step: u64,
    result: &'a SimulationResult,
}

impl Simulated<'_> {
    /// Prints the summary.
    fn print(&self, args: &SimulateArgs, wall_ns: u64, path: Option<&Path>) -> anyhow::Result<()> {
        let wall_s = wall_ns.max(1) as f64 / SECOND_NS as f64;
        let steps = self.result.steps - self.first_step;
        let simulated_s = steps as f64 / f64::from(self.scene.solver.rate_hz);
        let summary = Summary {
            scene: self.scene.name.clone(),
            first_step: self.first_step,
            steps,
            state_hash: format!("{:016x}", self.result.state_hash),
            applied: self.result.applied_count,
            rejected: self.result.rejected_count,
            real_time_factor: simulated_s / wall_s,
            wall_s,
            output: path.map(output::path_text),
        };
        output::result(args.as_json, &summary, &summary.to_string())
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "scene       {}", printable_line(&self.scene))?;
        match self.first_step {
            0 => writeln!(f, "steps       {}", self.steps)?,
            first => writeln!(f, "steps       {} after step {first}", self.steps)?,
        }
        writeln!(f, "state_hash  {}", self.state_hash)?;
        writeln!(f, "commands    {} applied, {} rejected", self.applied, self.rejected)?;
        write!(f, "speed       {:.1} x real time ({:.2} s)", self.real_time_factor, self.wall_s)?;
        self.output.iter().try_for_each(|path| write!(f, "\nwritten     {path}"))
    }
}

#[cfg(test)]
mod tests {
    use recording::parse_commands;
    use sim_solver::builtin;

    use super::*;

    fn job(steps: u64) -> Job {
        let scene = Scene::from_toml(builtin::text("rope").unwrap(), "rope").unwrap();
        let lines = "{\"step\":10,\"kind\":\"pause\"}\n{\"step\":40,\"kind\":\"pause\"}";
        Job::new(scene, parse_commands(lines, "test").unwrap(), steps)
    }

    #[test]
    fn commands_after_the_last_step_are_a_warning() {
        let warning = |steps| warning_of_late_commands(&job(steps));
        let all = "all 2 commands are for steps after 9, the last one. Use --steps 40 or more to apply all";
        assert_eq!(warning(9).as_deref(), Some(all));
        let one =
            "1 command is for steps after 10, the last one. Use --steps 40 or more to apply all";
        assert_eq!(warning(10).as_deref(), Some(one));
        assert_eq!(warning(40), None);
        assert_eq!(warning_of_late_commands(&Job { commands: Vec::new(), ..job(9) }), None);
    }
}
