//! The recordings that pages start: one at a time, each made by a process `recorder record`.
//!
//! The recorder ends its file cleanly on a signal, and also when nobody reads its progress any longer. So
//! it neither stays behind nor loses its file if this process is killed.

mod recorder_process;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};

use anyhow::Context;
use sim_contract::Endpoint;
use sim_host::clock::realtime_ns;
use sim_host::console::note;

use super::hub::{Hub, lock};
use crate::message::{NodeState, RecordingState, RecordingText, Refusal};
use crate::source::recording_files;
use recorder_process::{Line, Progress, RecorderId, RecorderProcess, RecorderReport, StopReason};

/// Remedy for a folder that cannot hold a recording.
const CHOOSE_A_FOLDER: &str =
    "free space on its disk, or choose another folder with `viewer-bridge --recordings DIR`";

/// The recordings of one bridge.
#[derive(Debug)]
pub struct Recordings {
    hub: Arc<Hub>,
    endpoint: Endpoint,
    /// Folder of the files; `None` if pages may not record.
    folder: Option<PathBuf>,
    present: Mutex<Present>,
}

/// The present recording, or the last one.
#[derive(Debug, Default)]
struct Present {
    shown: RecordingText,
    /// The recorder, once it handles signals.
    recorder: Option<RecorderId>,
    /// The end was requested.
    is_stopping: bool,
    /// The bridge ends; no further recording begins.
    is_closed: bool,
    thread: Option<JoinHandle<()>>,
}

impl Present {
    fn is_running(&self) -> bool {
        matches!(self.shown.state, RecordingState::Recording | RecordingState::Finishing)
    }

    /// Requests the end, at once or when the recorder is ready for it.
    fn stop(&mut self) {
        self.is_stopping = true;
        self.shown.state = RecordingState::Finishing;
        if let Some(recorder) = self.recorder {
            recorder.interrupt();
        }
    }
}

impl Recordings {
    /// Records the node at `endpoint` for the pages of `hub`, into `folder`. Without a folder, pages
    /// cannot record.
    pub fn new(hub: Arc<Hub>, endpoint: Endpoint, folder: Option<PathBuf>) -> Self {
        let shown = RecordingText {
            state: if folder.is_some() {
                RecordingState::Idle
            } else {
                RecordingState::Unavailable
            },
            text: folder.as_ref().map_or_else(
                || Refusal::RecordingNotAllowed.text("record").into_owned(),
                |_| String::new(),
            ),
            ..RecordingText::default()
        };
        hub.publish_recording(&shown);
        let present = Mutex::new(Present { shown, ..Present::default() });
        Self { hub, endpoint, folder, present }
    }

    /// Starts a recording.
    pub(super) fn start(self: &Arc<Self>) -> Result<(), Refusal> {
        let folder = self.folder.clone().ok_or(Refusal::RecordingNotAllowed)?;
        let node = self.hub.node();
        if node.state != NodeState::Alive {
            return Err(Refusal::NoNode);
        }
        let mut present = lock(&self.present);
        if present.is_running() {
            return Err(Refusal::AlreadyRecording);
        }
        if present.is_closed {
            return Err(Refusal::Busy);
        }
        let this = Arc::clone(self);
        let scene = node.scene.unwrap_or_default();
        let thread = thread::Builder::new()
            .name("recording".to_owned())
            .spawn(move || this.record(&folder, &scene))
            .map_err(|_| Refusal::Busy)?;
        let shown = RecordingText { state: RecordingState::Recording, ..RecordingText::default() };
        *present = Present { shown, thread: Some(thread), ..Present::default() };
        self.publish(&present);
        Ok(())
    }

    /// Requests the end of the recording.
    pub(super) fn stop(&self) -> Result<(), Refusal> {
        let mut present = lock(&self.present);
        if !present.is_running() {
            return Err(Refusal::NotRecording);
        }
        if !present.is_stopping {
            present.stop();
            self.publish(&present);
        }
        Ok(())
    }

    /// Ends the recording, and waits until its file is complete.
    pub fn finish(&self) {
        let mut present = lock(&self.present);
        present.is_closed = true;
        if present.is_running() {
            note("waiting until the recording is complete");
            if !present.is_stopping {
                present.stop();
                self.publish(&present);
            }
        }
        let thread = present.thread.take();
        drop(present);
        if let Some(thread) = thread {
            // A panic has been reported.
            let _panicked = thread.join();
        }
    }

    fn publish(&self, present: &MutexGuard<'_, Present>) {
        self.hub.publish_recording(&present.shown);
    }

    /// Makes a recording, and shows its end.
    fn record(&self, folder: &Path, scene: &str) {
        let result = self.run_recorder(folder, scene);
        let mut present = lock(&self.present);
        let (state, text) = match result {
            Ok(text) => (RecordingState::Finished, text),
            Err(error) => (RecordingState::Failed, format!("{error:#}")),
        };
        if state == RecordingState::Failed {
            note(&format!("warning: the recording failed: {text}"));
        }
        present.shown = RecordingText { state, text, ..present.shown.clone() };
        self.publish(&present);
    }

    /// Runs the recorder to its end. Returns an explanation of an end that no page has asked for.
    fn run_recorder(&self, folder: &Path, scene: &str) -> anyhow::Result<String> {
        fs::create_dir_all(folder).with_context(|| {
            format!("cannot create the folder {}; {CHOOSE_A_FOLDER}", folder.display())
        })?;
        let path = recording_files::free_path(folder, scene, realtime_ns());
        let mut recorder = RecorderProcess::start(&self.endpoint, &path)?;
        let mut report = None;
        while let Some(line) = recorder.next_line() {
            match line {
                Line::Progress(progress) => self.show_progress(&path, progress, recorder.id()),
                Line::Report(line) => report = Some(line),
            }
        }
        // Nobody signals a process that may have ended.
        lock(&self.present).recorder = None;
        let end = recorder.wait()?;
        match report {
            Some(report) => Ok(self.show_report(&path, report)),
            None => Err(self.explain(end.error, &end.status.to_string())),
        }
    }

    /// Shows the progress. The first line shows that the recorder handles signals.
    fn show_progress(&self, path: &Path, progress: Progress, recorder: RecorderId) {
        let Progress { seconds, snapshots, size_bytes, lost } = progress;
        let mut present = lock(&self.present);
        if present.recorder.is_none() && present.is_stopping {
            recorder.interrupt();
        }
        present.recorder = Some(recorder);
        let RecordingText { state, text, .. } = std::mem::take(&mut present.shown);
        let path = Some(path.display().to_string());
        present.shown =
            RecordingText { state, text, name: None, path, seconds, snapshots, size_bytes, lost };
        self.publish(&present);
    }

    /// Adds the last numbers. The page learns of them with the end.
    fn show_report(&self, path: &Path, report: RecorderReport) -> String {
        let mut present = lock(&self.present);
        let shown = &mut present.shown;
        shown.name = recording_files::name_of(path);
        shown.path = Some(path.display().to_string());
        (shown.snapshots, shown.lost) = (report.snapshots, report.lost);
        if let Ok(metadata) = fs::metadata(path) {
            shown.size_bytes = metadata.len();
        }
        match report.stop_reason {
            StopReason::Signal => "",
            StopReason::OwnerGone => "the recording ended with the node",
            StopReason::NewRun => "the recording ended because another run began",
            StopReason::NewLoad => "the recording ended because another scene was loaded",
            StopReason::Reserve => "the recording ended because less than 1 GB is free on its disk",
            StopReason::Other => "the recording ended by itself",
        }
        .to_owned()
    }

    /// Explains a recording that failed.
    fn explain(&self, error: Option<String>, status: &str) -> anyhow::Error {
        let error = error.unwrap_or_else(|| {
            format!(
                "the recorder ended ({status}); `recorder repair` copies what its .part file has"
            )
        });
        let is_alive = self.hub.node().state == NodeState::Alive;
        let is_of_folder = is_alive && !lock(&self.present).is_stopping;
        let remedy = if is_of_folder { format!("; {CHOOSE_A_FOLDER}") } else { String::new() };
        anyhow::anyhow!("{error}{remedy}")
    }
}
