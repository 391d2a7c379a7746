//! `recorder record`: records everything that a node publishes into one file.

mod accepted;
mod first_state;
mod intake;
mod load;
mod messages;
mod queue;
mod report;

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use recorder::{Backlog, LogWriter, Message, PartFile, WriteError};
use sim_contract::clock::{SECOND_NS, monotonic_ns, realtime_ns};
use sim_contract::{Endpoint, SNAPSHOTS_BUFFERED, Stop, Tap, report_bus_errors};

use crate::cli::endpoint_args::EndpointArgs;
use crate::cli::exit::Exit;
use crate::cli::file_args::{FileArgs, LogFile, default_path};
use crate::cli::output::{self, AsJson};
use crate::cli::parse::{self, whole_number, whole_number_in};
use accepted::{Accepted, RunEnd, RunHeader};
use intake::Intake;
use load::{LoadError, Now};
use messages::Messages;
use queue::{Content, Item, Popped, Queue};
use report::Report;

/// Longest wait for messages before the next check for signals.
const WAIT_MAX: Duration = Duration::from_millis(50);
/// Period of the check whether the owner is alive.
const OWNER_CHECK_NS: u64 = SECOND_NS / 5;
/// Flush period: the most that a killed recorder or a power cut loses.
const FLUSH_NS: u64 = SECOND_NS;

/// Default memory for snapshots that wait.
const QUEUE_BYTES_DEFAULT: u64 = 256 << 20;

#[derive(Debug, clap::Args)]
#[command(
    after_help = "Ends cleanly on Ctrl-C, on SIGTERM or SIGHUP, at a limit, when the node ends, or when another run \
    starts (as with play --loop).\n\n\
    Exit codes: 0 all recorded; 1 failed; 3 messages lost.\n\nExamples:\n  \
    recorder record -o run.mcap\n  \
    recorder record --name left --duration 10s --compression none\n  \
    recorder record -o run.mcap --steps 2400 --json"
)]
pub(crate) struct RecordArgs {
    #[command(flatten)]
    endpoint: EndpointArgs,
    /// File to write. Its name ends in `.part` until it is finished
    /// [default: NAME_<UTC time>.mcap]
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// End after this time, such as 10s or 500ms. It counts from the start of the program, so it
    /// includes the wait for the first step that can be recorded [default: no limit]
    #[arg(long, value_name = "TIME", allow_hyphen_values = true,
        value_parser = parse::duration)]
    duration: Option<Duration>,
    /// End N steps after the first recorded step [default: no limit]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = whole_number)]
    steps: Option<u64>,
    /// Memory for snapshots that wait to be written, in bytes, at least 1 MiB. Snapshots that do
    /// not fit are lost and counted
    #[arg(long, value_name = "BYTES", default_value_t = QUEUE_BYTES_DEFAULT,
        allow_hyphen_values = true, value_parser = queue_bytes)]
    queue_bytes: u64,
    /// Do not wait each second until the recording is on the disk. A power cut may then lose much
    /// more than the last second
    #[arg(long)]
    no_sync: bool,
    #[command(flatten)]
    file: FileArgs,
    #[command(flatten)]
    as_json: AsJson,
}

/// Options of a recording of one step.
#[derive(Debug, Clone, clap::Args)]
pub(crate) struct SingleStateArgs {
    #[command(flatten)]
    endpoint: EndpointArgs,
    /// File to write [default: NAME_<UTC time>.mcap]
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// Longest wait for a state, such as 10s or 500ms
    #[arg(long, value_name = "TIME", default_value = "5s", allow_hyphen_values = true,
        value_parser = parse::duration)]
    timeout: Duration,
    #[command(flatten)]
    file: FileArgs,
    #[command(flatten)]
    as_json: AsJson,
}

impl From<SingleStateArgs> for RecordArgs {
    fn from(args: SingleStateArgs) -> Self {
        let SingleStateArgs { endpoint, output, timeout, file, as_json } = args;
        Self {
            endpoint,
            output,
            duration: Some(timeout),
            steps: Some(0),
            queue_bytes: QUEUE_BYTES_DEFAULT,
            no_sync: false,
            file,
            as_json,
        }
    }
}

fn queue_bytes(text: &str) -> Result<u64, String> {
    whole_number_in(text, &(1 << 20..=1 << 40))
}

pub(crate) fn run(args: &RecordArgs) -> anyhow::Result<Exit> {
    let stop = Stop::install()?;
    report_bus_errors()?;
    let endpoint = args.endpoint.endpoint()?;
    let tap = Tap::attach(&endpoint)?;
    let path = args.output.clone().unwrap_or_else(|| default_path(endpoint.name(), realtime_ns()));
    let file = args.file.create(&path)?;
    let part_path = file.part_path().to_owned();
    let file = if args.no_sync { file } else { file.with_sync_on_flush() };
    output::note(&format!("ready recording {endpoint} into {}", output::path_text(&path)));

    let queue_bytes = usize::try_from(args.queue_bytes).unwrap_or(usize::MAX / 2);
    let mut recording = Recording {
        tap,
        intake: Intake::new(args.steps),
        queue: Arc::new(Queue::new(queue_bytes)),
        file: Some(file),
        part_path,
        writing: None,
        last_step: 0,
        begin_ns: monotonic_ns(),
        next_owner_check_ns: 0,
        is_owner_alive: true,
    };
    let result = recording.run(args, &stop);
    let report = recording.finish(result, &endpoint)?;
    output::result(args.as_json, &report, &report.to_string())?;
    Ok(if report.is_complete() { Exit::Done } else { Exit::Loss })
}

/// The reason why a recording ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopReason {
    Signal,
    Duration,
    OwnerGone,
    Run(RunEnd),
    WriteError,
}

impl StopReason {
    fn text(self) -> &'static str {
        match self {
            Self::Signal => "signal",
            Self::Duration => "duration reached",
            Self::OwnerGone => "owner gone",
            Self::Run(RunEnd::NewRun) => "new run",
            Self::Run(RunEnd::NewLoad) => "new scene loaded",
            Self::Run(RunEnd::EndStep) => "steps reached",
            Self::WriteError => "write error",
        }
    }
}

/// A recording in progress.
#[derive(Debug)]
struct Recording {
    tap: Tap,
    intake: Intake,
    queue: Arc<Queue>,
    /// The file, until its header is written.
    file: Option<PartFile>,
    part_path: PathBuf,
    /// The writing thread, once the recording has started.
    writing: Option<JoinHandle<anyhow::Result<LogFile>>>,
    /// The last step in the queue.
    last_step: u64,
    begin_ns: u64,
    next_owner_check_ns: u64,
    is_owner_alive: bool,
}

impl Recording {
    /// Reads until the recording ends.
    fn run(&mut self, args: &RecordArgs, stop: &Stop) -> anyhow::Result<StopReason> {
        loop {
            // Checked before reading, so that messages from before the end are read.
            let reason = self.reason_to_stop(args, stop);
            let accepted = self.read()?;
            let end = accepted.end.map(StopReason::Run);
            self.enqueue(accepted, args, realtime_ns())?;
            if let Some(reason) = end.or(reason) {
                return Ok(reason);
            }
            self.tap.wait(WAIT_MAX);
        }
    }

    fn reason_to_stop(&mut self, args: &RecordArgs, stop: &Stop) -> Option<StopReason> {
        let now_ns = monotonic_ns();
        if now_ns >= self.next_owner_check_ns {
            self.next_owner_check_ns = now_ns + OWNER_CHECK_NS;
            self.is_owner_alive = self.tap.is_owner_alive();
        }
        let passed = Duration::from_nanos(now_ns - self.begin_ns);
        if stop.is_requested() {
            Some(StopReason::Signal)
        } else if self.queue.is_closed() {
            Some(StopReason::WriteError)
        } else if args.duration.is_some_and(|duration| passed >= duration) {
            Some(StopReason::Duration)
        } else {
            (!self.is_owner_alive).then_some(StopReason::OwnerGone)
        }
    }

    /// Copies everything that has arrived out of shared memory. Returns the part that goes into the
    /// recording, in the order of publication.
    fn read(&mut self) -> Result<Accepted, LoadError> {
        let mut messages = Messages::default();
        let mut accepted = Accepted::default();
        // Bounded, so that a node that is faster than this loop cannot keep it from ending.
        for _ in 0..SNAPSHOTS_BUFFERED {
            let state = self.tap.next_state(|message| messages.add(message));
            let Some(state) = state else { break };
            self.intake.accept_state(&state, Now::read(), &mut accepted)?;
            self.count_unreadable();
            if accepted.end.is_some() {
                break;
            }
        }
        self.intake.accept_messages(messages, Now::read(), &mut accepted);
        self.intake.set_lost(self.tap.lost_changes());
        self.count_unreadable();
        accepted.sort();
        Ok(accepted)
    }

    fn count_unreadable(&mut self) {
        if let Some(warning) = self.intake.count_unreadable(&self.tap.drain_errors()) {
            output::note(&warning);
        }
    }

    /// Passes a batch to the writing thread.
    fn enqueue(
        &mut self,
        accepted: Accepted,
        args: &RecordArgs,
        log_time_ns: u64,
    ) -> anyhow::Result<()> {
        if let Some(mut header) = accepted.header {
            self.queue.begin(Backlog::new(&header.run, header.scene.len()));
            for row in std::mem::take(&mut header.rows) {
                self.queue.push(Item { content: Content::Update(row), log_time_ns });
            }
            self.begin(args, header, log_time_ns)?;
        }
        for content in accepted.contents {
            if let Content::Snapshot(row, _) = &content {
                self.last_step = row.step;
            }
            self.queue.push(Item { content, log_time_ns });
        }
        Ok(())
    }

    /// Starts the writing thread, which writes the header. The reading thread never waits for the disk.
    fn begin(
        &mut self,
        args: &RecordArgs,
        header: RunHeader,
        log_time_ns: u64,
    ) -> anyhow::Result<()> {
        let Some(file) = self.file.take() else { return Ok(()) };
        output::note(&format!("recording from step {}", self.intake.first_step().unwrap_or(0)));
        let (queue, options) = (CloseOnDrop(Arc::clone(&self.queue)), args.file.clone());
        let writing = thread::Builder::new().name("writer".to_owned()).spawn(move || {
            let log = options.begin(file, &header.run, &header.scene, log_time_ns)?;
            Ok(write(&queue.0, log)?)
        });
        self.writing = Some(writing.context("cannot start the writing thread")?);
        Ok(())
    }

    /// Writes the rest of the queue and the closing metadata, and gives the file its name.
    fn finish(
        self,
        result: anyhow::Result<StopReason>,
        endpoint: &Endpoint,
    ) -> anyhow::Result<Report> {
        self.queue.close();
        let Some(writing) = self.writing else {
            if let Some(file) = self.file {
                file.discard()?;
            }
            let reason = result?.text();
            bail!(
                "nothing was recorded ({reason}): {endpoint} published no snapshot with a keyframe"
            );
        };
        let written = writing.join().map_err(|_| anyhow!("the writing thread panicked"))?;
        let part = output::path_text(&self.part_path);
        let log = written
            .with_context(|| format!("the recording is incomplete; its readable part is {part}"))?;
        let stop_reason = match &result {
            Ok(reason) => reason.text().to_owned(),
            Err(error) => format!("{error:#}"),
        };
        let mut closing = self.intake.closing(stop_reason);
        closing.counts.set_written(log.counts());
        closing.counts.set_lost(&self.queue.lost());
        let kept = || format!("the recording is complete except for its end, in {part}");
        let file = log.finish(&closing).with_context(kept)?;
        let path = file.finish().map_err(|error| {
            let is_complete = error.leaves_complete_file();
            if is_complete { anyhow!(error) } else { anyhow!(error).context(kept()) }
        })?;
        result?;
        let steps = self.intake.first_step().unwrap_or(0)..=self.last_step;
        Ok(Report::new(path, closing, steps))
    }
}

/// Closes the queue when the writing thread ends for any reason, so that the reading thread sees it.
struct CloseOnDrop(Arc<Queue>);

impl Drop for CloseOnDrop {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// The writing thread: writes every item, flushes every second, and waits until that is on the disk.
fn write<W: Write>(queue: &Queue, mut log: LogWriter<W>) -> Result<LogWriter<W>, WriteError> {
    let mut next_flush_ns = monotonic_ns() + FLUSH_NS;
    loop {
        match queue.pop(WAIT_MAX) {
            Popped::Item(Item { content: Content::Update(message), log_time_ns }) => {
                log.write(&message, log_time_ns)?;
            }
            Popped::Item(Item { content: Content::Snapshot(row, particles), log_time_ns }) => {
                log.write(&Message::Step(row), log_time_ns)?;
                log.write(&Message::Particles { step: row.step, particles }, log_time_ns)?;
            }
            Popped::Timeout => {}
            Popped::Closed => return Ok(log),
        }
        let now_ns = monotonic_ns();
        if now_ns >= next_flush_ns {
            next_flush_ns = now_ns + FLUSH_NS;
            log.flush()?;
        }
    }
}

#[cfg(test)]
mod tests;
