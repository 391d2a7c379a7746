//! `recorder record`: records everything that a node publishes, into one file or into several.

mod args;
mod batch;
mod queue;
mod report;
mod session;
mod split;
mod splitter;
mod start;
mod writer;

use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use anyhow::{anyhow, bail};
use recording::{Existing, PartFile, counted};
use sim_contract::{
    AttachError, Domain, Endpoint, LockstepError, NodeAnswer, OwnerState, SNAPSHOTS_BUFFERED, Tap,
};
use sim_host::clock::{SECOND_NS, monotonic_ns, realtime_ns, sleep_until};
use sim_host::{Stop, console, report_bus_errors};

use crate::cli::output::{self, Exit};
pub(crate) use args::{RecordArgs, StateArgs};
use batch::{Messages, StopReason};
use queue::Queue;
use report::{LiveLine, Report, Written};
use session::Session;
use split::{TimeLimit, WritePosition};
use splitter::trigger::{Trigger, UserSignal};
use splitter::{SplitOptions, Splitter};
use start::LoadError;
use writer::WriteOptions;
use writer::black_box::BlackBox;
use writer::extras::Extras;
use writer::names::FileNames;

/// Longest wait for messages before the next check for signals.
const WAIT_MAX: Duration = Duration::from_millis(50);
/// Period of the check whether the owner is alive.
const OWNER_CHECK_NS: u64 = SECOND_NS / 5;
/// Pause between two attempts to attach to a node that is not there yet.
const ATTACH_PAUSE_NS: u64 = SECOND_NS / 50;
/// Longest wait for a status, which a node publishes ten times a second.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(1);

/// Warning about SIGUSR1.
const IGNORED_SIGNAL: &str = "warning: SIGUSR1 writes the memory of a black box, but --black-box is not given: the \
                              recording goes on";

pub(crate) fn run(args: &RecordArgs) -> anyhow::Result<Exit> {
    args.check().unwrap_or_else(|error| output::with_usage(&error));
    if let Some(output) = &args.output {
        output::warn_of_extension(output, &["mcap"]);
    }
    let stop = Stop::install()?;
    report_bus_errors()?;
    let endpoint = args.endpoint.endpoint()?;
    let extras = Extras::open(&args.extras)?;
    let (names, ring_files) = names(args, &endpoint)?;
    // Before the wait for a node, because SIGUSR1 would end the process.
    let signal = UserSignal::install()?;
    let trigger = args.black_box.map(|span| Trigger::new(span, signal.clone()));
    PartFile::check(&names.path(0), args.file.existing())?;
    check_reserve(args, &names)?;
    let Some(mut tap) = attach(args, &endpoint, &stop)? else {
        bail!("nothing was recorded: no node has come up as {endpoint}");
    };
    let selection = args.selection.selection();
    if selection.has_forces {
        tap.read_forces()?;
    }
    let queue_bytes = usize::try_from(args.queue_bytes).unwrap_or(usize::MAX / 2);
    let options = WriteOptions {
        selection,
        file: args.file.clone(),
        names,
        ring: args.split.ring(),
        earlier: ring_files,
        is_synced: !args.no_sync,
        flush_interval: args.flush_interval,
        extras,
        black_box: args.black_box.map(|span| BlackBox::new(span, queue_bytes)),
    };
    let file = first_file(args, &options, &endpoint)?;

    let queue = Arc::new(Queue::new(queue_bytes));
    let position = Arc::new(WritePosition::default());
    let session = Session::new(args.steps).with_energy(selection.has_energy);
    let writing = writer::start(Arc::clone(&queue), Arc::clone(&position), options, file)?;
    let live = LiveLine::new(Arc::clone(&queue), Arc::clone(&position), args.progress);
    let options = SplitOptions {
        split: args.split.clone(),
        is_following: args.follows(),
        selection,
        time_limit: args.duration.map(|duration| TimeLimit::new(duration, monotonic_ns())),
        trigger,
        limit_bytes: args.queue_bytes,
    };
    let mut recording = Recording {
        tap,
        splitter: Splitter::new(session, Arc::clone(&queue), Arc::clone(&position), options),
        live,
        queue,
        position,
        writing,
        next_owner_check_ns: 0,
        is_owner_alive: true,
        ended_run: None,
        signal,
    };
    let result = recording.run(args, &stop);
    let report = recording.finish(result, args, &endpoint)?;
    output::result(args.as_json, &report, &report.to_string())?;
    Ok(if report.is_complete() { Exit::Done } else { Exit::Loss })
}

/// Creates the first file, and says that the recorder is ready. A black box creates it with the first event.
fn first_file(
    args: &RecordArgs,
    options: &WriteOptions,
    endpoint: &Endpoint,
) -> anyhow::Result<Option<PartFile>> {
    let file = options.create(0)?;
    let path = output::path_text(&options.names.path(0));
    let Some(span) = args.black_box else {
        output::note(&format!("ready recording {endpoint} into {path}"));
        return Ok(Some(file));
    };
    // That the file can be created is known now.
    file.discard()?;
    let span = humantime::format_duration(span);
    output::note(&format!("ready keeping the last {span} of {endpoint}; the first file is {path}"));
    Ok(None)
}

/// Returns the names of the files, and the files of a ring that it continues.
fn names(args: &RecordArgs, endpoint: &Endpoint) -> anyhow::Result<(FileNames, Vec<PathBuf>)> {
    let names = args.names(endpoint.name(), realtime_ns());
    // It replaces no file of an earlier event.
    let is_black_box = args.black_box.is_some();
    if args.is_ring() && (is_black_box || args.file.existing() == Existing::Refuse) {
        return names.after_ring();
    }
    if is_black_box {
        return Ok((names.after_earlier_files()?.0, Vec::new()));
    }
    let count = names.check(args.file.existing())?;
    if count > 0 {
        let path = output::path_text(&names.path(0));
        let files = counted(count as u64, "file");
        output::note(&format!(
            "warning: beside {path}, there is an earlier recording with {files}; each stays until a file with its \
             number begins"
        ));
    }
    Ok((names, Vec::new()))
}

/// Refuses to begin a single file on a disk without its reserve.
fn check_reserve(args: &RecordArgs, names: &FileNames) -> anyhow::Result<()> {
    let path = names.path(0);
    if names.is_single() && args.split.ring().is_short(&path) {
        let path = output::path_text(&path);
        // The viewer shows this to a user who has not given --min-free, with its own remedy.
        bail!("{path}: its disk has less free space than the recording is to leave");
    }
    Ok(())
}

/// Attaches to the node. With `--wait`, waits for one until a signal or the end of `--duration`, and
/// returns `None` if none has come up.
fn attach(args: &RecordArgs, endpoint: &Endpoint, stop: &Stop) -> anyhow::Result<Option<Tap>> {
    let begin_ns = monotonic_ns();
    let mut is_told = false;
    loop {
        let tap = if args.lockstep {
            Tap::attach_in_lockstep(endpoint)
        } else {
            Tap::attach(endpoint).map_err(LockstepError::Attach)
        };
        let error = match tap {
            Ok(tap) => return Ok(Some(tap)),
            Err(LockstepError::Attach(error)) => error,
            Err(error) => return Err(error.into()),
        };
        match error {
            AttachError::NoNode { .. } | AttachError::NoServices { .. } if args.wait => {}
            AttachError::NoNode { .. } => {
                return Err(anyhow!(error).context("use --wait to wait for a node"));
            }
            _ => return Err(error.into()),
        }
        if !std::mem::replace(&mut is_told, true) {
            output::note(&format!("waiting for a node that runs as {endpoint}"));
        }
        let passed = Duration::from_nanos(monotonic_ns() - begin_ns);
        if stop.is_requested() || args.duration.is_some_and(|duration| passed >= duration) {
            return Ok(None);
        }
        sleep_until(monotonic_ns() + ATTACH_PAUSE_NS);
    }
}

/// A recording in progress.
#[derive(Debug)]
struct Recording {
    tap: Tap,
    splitter: Splitter,
    live: LiveLine,
    queue: Arc<Queue>,
    position: Arc<WritePosition>,
    writing: JoinHandle<anyhow::Result<Written>>,
    next_owner_check_ns: u64,
    is_owner_alive: bool,
    /// The run in the file when the owner was last found dead.
    ended_run: Option<u64>,
    signal: UserSignal,
}

impl Recording {
    /// Reads until the recording ends.
    fn run(&mut self, args: &RecordArgs, stop: &Stop) -> anyhow::Result<StopReason> {
        loop {
            // Checked before reading, so that messages from before the end are read.
            let reason = self.reason_to_stop(stop);
            let end = self.read()?.map(StopReason::Run);
            match end.or(reason) {
                Some(StopReason::OwnerGone) if args.follows() => self.end_file_of_owner(),
                Some(reason) => return Ok(reason),
                None => {}
            }
            if args.black_box.is_none() && self.signal.take() {
                output::note(IGNORED_SIGNAL);
            }
            if !self.live.update(&self.splitter)? {
                return Ok(StopReason::ReaderGone);
            }
            // In the lockstep, the node waits until the queue has room.
            if (self.queue.size_bytes() as u64) < args.queue_bytes / 2 {
                self.tap.ready()?;
            }
            self.tap.wait(WAIT_MAX);
        }
    }

    fn reason_to_stop(&mut self, stop: &Stop) -> Option<StopReason> {
        let now_ns = monotonic_ns();
        if now_ns >= self.next_owner_check_ns {
            self.next_owner_check_ns = now_ns + OWNER_CHECK_NS;
            self.is_owner_alive = self.tap.is_owner_alive();
            self.ended_run = self.splitter.run_id().filter(|_| !self.is_owner_alive);
        }
        if stop.is_requested() {
            Some(StopReason::Signal)
        } else if self.queue.is_closed() {
            Some(StopReason::WriteError)
        } else if self.position.ends_for_reserve() {
            Some(StopReason::Reserve)
        } else if self.splitter.is_time_over(now_ns) {
            Some(StopReason::Duration)
        } else {
            (!self.is_owner_alive).then_some(StopReason::OwnerGone)
        }
    }

    /// Passes everything that has arrived to the queue. Returns the end of the recording, if it is
    /// reached.
    fn read(&mut self) -> Result<Option<batch::RunEnd>, LoadError> {
        let mut messages = Messages::default();
        // Bounded, so that a node that is faster than this loop cannot keep it from ending.
        for _ in 0..SNAPSHOTS_BUFFERED {
            let state = self.tap.next_state(|message| messages.add(message));
            let Some(state) = state else { break };
            self.splitter.accept_state(&state, &mut messages)?;
            self.splitter.count_unreadable(&self.tap.drain_errors());
            if self.splitter.is_at_end() {
                break;
            }
        }
        let end = self.splitter.accept_messages(messages);
        self.splitter.set_lost(self.tap.lost_changes());
        self.splitter.count_unreadable(&self.tap.drain_errors());
        Ok(end)
    }

    /// Ends the file of a node that has ended, and waits for the next one: the tap reads its messages
    /// from the first. The file of a node that has started since the last check goes on.
    fn end_file_of_owner(&mut self) {
        let reason = StopReason::OwnerGone.text();
        if self.ended_run.is_some_and(|run_id| self.splitter.end_file_of(run_id, reason)) {
            output::note("the node has ended; waiting for the next run");
        }
    }

    /// Ends the file, and waits until everything is written.
    fn finish(
        mut self,
        result: anyhow::Result<StopReason>,
        args: &RecordArgs,
        endpoint: &Endpoint,
    ) -> anyhow::Result<Report> {
        let stop_reason = match &result {
            Ok(reason) => reason.text().to_owned(),
            Err(error) => format!("{error:#}"),
        };
        output::end_live();
        self.splitter.end_file(stop_reason.clone());
        self.queue.close();
        let mut written =
            self.writing.join().map_err(|_| anyhow!("the writing thread panicked"))??;
        written.add_undeclared(&self.splitter.undeclared());
        let reason = result?;
        if !args.follows()
            && let Some(hint) = reason.hint()
        {
            console::note(&format!("note: {hint}"));
        }
        let report = Report::new(&written, self.splitter.skipped_count(), stop_reason.clone());
        if !report.has_files() && args.black_box.is_none() {
            bail!("nothing was recorded ({stop_reason}): {}", cause_of_no_state(endpoint));
        }
        Ok(report)
    }
}

/// Returns the reason why a node has published no complete state, with its cure.
fn cause_of_no_state(endpoint: &Endpoint) -> String {
    let nodes = Domain::new(endpoint).map(|domain| domain.nodes(ANSWER_TIMEOUT));
    let node = match nodes {
        Ok(Ok(nodes)) => nodes.into_iter().find(|node| node.name == endpoint.name()),
        // The domain cannot be read, so the node is not known to be silent or gone.
        Ok(Err(_)) | Err(_) => return awaits_step(endpoint),
    };
    match node.map(|node| (node.answer, node.process_id)) {
        Some((NodeAnswer::Silent, process_id)) => {
            OwnerState::Alive { process_id, endpoint: endpoint.clone() }.to_string()
        }
        Some(_) => awaits_step(endpoint),
        None => format!("{endpoint} ended before it published a snapshot with a keyframe"),
    }
}

fn awaits_step(endpoint: &Endpoint) -> String {
    format!(
        "{endpoint} published no snapshot with a keyframe. A node that a command has changed in a pause does so at \
         its next step: `sim-node ctl step 1{}`",
        endpoint.options()
    )
}

#[cfg(test)]
mod tests;
