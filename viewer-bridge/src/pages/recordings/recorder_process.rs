//! A process `recorder record`: its start, its lines and its end.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Lines};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdout, Command, ExitStatus, Stdio};
use std::thread::{self, JoinHandle};

use anyhow::{Context, anyhow};
use rustix::process::{Pid, Signal, kill_process};
use serde::Deserialize;
use sim_contract::Endpoint;
use sim_host::console;

/// File name of the program.
const PROGRAM: &str = "recorder";
/// Free space of the disk below which a recording ends.
const DISK_RESERVE: &str = "1GB";
/// Start of the line in which a program gives the reason of its failure.
const ERROR: &str = "error: ";

/// A line that the recorder prints for a program.
#[derive(Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Line {
    /// The last one.
    Report(RecorderReport),
    /// Four times a second.
    Progress(Progress),
}

/// The state of a recording in progress.
#[derive(Debug, Deserialize)]
pub(super) struct Progress {
    pub(super) seconds: f64,
    pub(super) snapshots: u64,
    pub(super) size_bytes: u64,
    pub(super) lost: BTreeMap<String, u64>,
}

/// The report at the end.
#[derive(Debug, Deserialize)]
pub(super) struct RecorderReport {
    pub(super) snapshots: u64,
    pub(super) lost: BTreeMap<String, u64>,
    pub(super) stop_reason: StopReason,
}

/// The reason why a recording ended, in the words of the recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
pub(super) enum StopReason {
    #[serde(rename = "signal")]
    Signal,
    #[serde(rename = "owner gone")]
    OwnerGone,
    #[serde(rename = "new run")]
    NewRun,
    #[serde(rename = "new scene loaded")]
    NewLoad,
    #[serde(rename = "disk reserve reached")]
    Reserve,
    #[serde(other)]
    Other,
}

/// A running recorder.
#[derive(Debug)]
pub(super) struct RecorderProcess {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
    /// Returns the last error.
    messages: JoinHandle<Option<String>>,
}

/// The address of a running recorder, for signals.
#[derive(Debug, Clone, Copy)]
pub(super) struct RecorderId(Pid);

/// The end of a recorder.
#[derive(Debug)]
pub(super) struct RecorderEnd {
    pub(super) status: ExitStatus,
    /// The reason of a failure.
    pub(super) error: Option<String>,
}

impl RecorderId {
    /// Requests the end of the recording. Only once: a second signal ends the recorder at once.
    pub(super) fn interrupt(self) {
        // An error means that it has ended already.
        let _ended = kill_process(self.0, Signal::TERM);
    }
}

impl RecorderProcess {
    /// Starts a recording of a node into a file.
    pub(super) fn start(endpoint: &Endpoint, path: &Path) -> anyhow::Result<Self> {
        let program = find_program()?;
        let mut child = command(&program, endpoint, path)
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let stdout = child.stdout.take().context("the recorder has no output")?;
        let stderr = child.stderr.take().context("the recorder has no output")?;
        let messages = thread::Builder::new()
            .name("recorder-text".to_owned())
            .spawn(move || pass_messages(stderr))
            .context("cannot start a thread")?;
        Ok(Self { child, lines: BufReader::new(stdout).lines(), messages })
    }

    pub(super) fn id(&self) -> RecorderId {
        RecorderId(Pid::from_child(&self.child))
    }

    /// Waits for the next line. Returns `None` at the end of the output.
    pub(super) fn next_line(&mut self) -> Option<Line> {
        loop {
            let line = self.lines.next()?.ok()?;
            // A line of another version has nothing for the page.
            if let Ok(line) = serde_json::from_str(&line) {
                return Some(line);
            }
        }
    }

    /// Waits for the end of the process. Afterwards its [`RecorderId`] is invalid.
    pub(super) fn wait(mut self) -> anyhow::Result<RecorderEnd> {
        let status = self.child.wait().context("waiting for the recorder")?;
        let error = self.messages.join().map_err(|_| anyhow!("a thread panicked"))?;
        Ok(RecorderEnd { status, error })
    }
}

#[allow(
    clippy::disallowed_methods,
    reason = "a recording that pages start is made by the recorder"
)]
fn command(program: &Path, endpoint: &Endpoint, path: &Path) -> Command {
    let mut command = Command::new(program);
    command.args(["record", "--progress", "--json", "--min-free", DISK_RESERVE]);
    command.args(["--name", endpoint.name()]);
    if let Some(domain) = endpoint.domain() {
        command.args(["--domain", domain]);
    }
    command.arg("--output").arg(path);
    // Ctrl-C reaches the bridge alone, which then ends the recording.
    command.process_group(0).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Finds the recorder beside this program, or on the search path.
fn find_program() -> anyhow::Result<PathBuf> {
    let this = std::env::current_exe().ok();
    let beside = this.as_deref().and_then(Path::parent).map(Path::to_owned);
    let search = std::env::var_os("PATH").unwrap_or_default();
    let mut folders = beside.iter().cloned().chain(std::env::split_paths(&search));
    let found = folders.find_map(|folder| Some(folder.join(PROGRAM)).filter(|path| path.is_file()));
    found.ok_or_else(|| {
        let beside = beside.map_or_else(String::new, |folder| format!(" in {} or", folder.display()));
        anyhow!(
            "there is no program `{PROGRAM}`{beside} on the search path of the viewer; install it there \
             (`cargo build --release -p recorder`)"
        )
    })
}

/// Passes the messages of the recorder to the terminal of the bridge. Returns the last error.
fn pass_messages(stderr: ChildStderr) -> Option<String> {
    let mut last = None;
    for line in BufReader::new(stderr).lines().map_while(Result::ok) {
        console::note(&format!("{PROGRAM}: {line}"));
        if let Some(error) = line.strip_prefix(ERROR) {
            last = Some(error.to_owned());
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lines_of_the_recorder_are_understood() {
        let progress = r#"{"seconds":1.25,"file":0,"snapshots":240,"size_bytes":4096,"lost":{"/particles":3}}"#;
        let Ok(Line::Progress(progress)) = serde_json::from_str(progress) else { panic!() };
        assert_eq!((progress.snapshots, progress.lost["/particles"]), (240, 3));
        let report = r#"{"output":"run.mcap","files":1,"snapshots":7,"lost":{},"stop_reason":"new scene loaded"}"#;
        let Ok(Line::Report(report)) = serde_json::from_str(report) else { panic!() };
        assert_eq!((report.snapshots, report.stop_reason), (7, StopReason::NewLoad));
        let reserve = r#"{"snapshots":7,"lost":{},"stop_reason":"disk reserve reached"}"#;
        let Ok(Line::Report(report)) = serde_json::from_str(reserve) else { panic!() };
        assert_eq!(report.stop_reason, StopReason::Reserve);
        let other = r#"{"snapshots":7,"lost":{},"stop_reason":"something newer"}"#;
        let Ok(Line::Report(report)) = serde_json::from_str(other) else { panic!() };
        assert_eq!(report.stop_reason, StopReason::Other);
    }
}
