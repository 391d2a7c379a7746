//! Actions on the recorders, and on the other programs that write and read recordings.

use rustix::process::Signal;

use crate::faults::action::Ending;
use crate::faults::actor::{Actor, Ends};
use crate::faults::recording::{Claim, Recording};
use crate::faults::world::{Recorder, World};
use crate::finished::Finished;
use crate::programs::Program;

const RECORDER_ENDS: Ends = Ends {
    codes: &[0, 3],
    errors: &[
        "no node runs as",
        "nothing was recorded",
        "the recording is incomplete",
        "File too large",
    ],
    needs_no_signal: true,
};
/// Ends of a playback.
const PLAYER_ENDS: Ends = Ends { codes: &[0], errors: &[], needs_no_signal: true };
/// Ends of a simulation. It refuses a recording that begins in the middle of a run.
const SIMULATION_ENDS: Ends =
    Ends { codes: &[0], errors: &["earlier commands of its run"], needs_no_signal: true };
/// Ends of `info` and `verify`, which report losses.
const REPORTS: Ends = Ends { codes: &[0, 3], errors: &[], needs_no_signal: true };
/// Ends of `info` and `verify` for a file in which nothing was recorded.
const REPORTS_NOTHING: Ends = Ends {
    codes: &[0, 3],
    errors: &["is empty: a recorder", "is not an MCAP file", "has no snapshot with a keyframe"],
    needs_no_signal: true,
};
/// End of `recorder check` for a sound file.
const CHECKS: Ends = Ends { codes: &[0], errors: &[], needs_no_signal: true };
/// Ends of `recorder repair`: the last record may be cut.
const REPAIRS: Ends = Ends { codes: &[0, 3], errors: &[], needs_no_signal: true };

impl World {
    /// Starts a recorder, after it has ended the one in the slot.
    pub(super) fn start_recorder(&mut self, slot: usize, args: &str) {
        self.end_recorder(slot, Ending::Interrupt);
        let mut recorder = self.create_recorder(args);
        recorder.actor.wait_until_ready();
        self.recorders[slot] = Some(recorder);
    }

    /// Kills a recorder during its start.
    pub(super) fn kill_recorder_at_start(&mut self, changes: u32) {
        let Recorder { actor, file, .. } = self.create_recorder("--compression none");
        let finished = actor.kill_after(changes, &self.files, &mut self.journal);
        self.check_recording(&file, Claim::from_end(&finished, false));
    }

    fn create_recorder(&mut self, args: &str) -> Recorder {
        let file = self.new_file();
        let words: Vec<_> = ["record", "-o", &file].into_iter().chain(args.split(' ')).collect();
        let actor = Actor::start(Program::Recorder, &self.sandbox, &words, RECORDER_ENDS);
        let has_steps = args.contains("--steps");
        Recorder { actor, file, load_count: self.load_count, has_steps }
    }

    /// Ends a recorder and checks its file.
    pub(super) fn end_recorder(&mut self, slot: usize, ending: Ending) {
        let Some(mut recorder) = self.recorders[slot].take() else { return };
        let is_running = recorder.actor.is_running() && !recorder.has_steps;
        let is_same_load = recorder.load_count == self.load_count && self.node.is_some();
        let Recorder { actor, file, .. } = recorder;
        let finished = actor.end(ending, &self.files, &mut self.journal);
        let is_killed = is_running && is_same_load && matches!(ending, Ending::Kill);
        self.check_recording(&file, Claim::from_end(&finished, is_killed));
    }

    pub(super) fn set_recorder_stopped(&mut self, slot: usize, is_stopped: bool) {
        if let Some(recorder) = &mut self.recorders[slot] {
            recorder.actor.set_stopped(is_stopped);
        }
    }

    pub(super) fn limit_file_size(&mut self, slot: usize, size_bytes: u64) {
        if let Some(recorder) = &mut self.recorders[slot] {
            recorder.actor.limit_file_size(size_bytes);
        }
    }

    /// Plays a recording under another name.
    pub(super) fn play(&mut self, ending: Ending, changes: u32) {
        let Some(file) = self.kept.newest() else { return };
        let args = ["play", &file, "--name", "played", "--rate", "50"];
        let mut player = Actor::start(Program::Recorder, &self.sandbox, &args, PLAYER_ENDS);
        self.files.wait_for_changes(changes, || player.is_ready() || !player.is_running());
        player.end(ending, &self.files, &mut self.journal);
    }

    /// Simulates the scene and the commands of a recording, or a built-in scene. A simulation that is killed
    /// leaves a readable file.
    pub(super) fn simulate(&mut self, steps: u32, changes: Option<u32>) {
        let (file, steps) = (self.new_file(), steps.to_string());
        let source = self.kept.newest().unwrap_or_else(|| "rope-bridge".to_owned());
        let mut args = vec!["simulate", &source, "--steps", &steps, "-o", &file];
        if self.kept.newest().is_some() {
            args.extend(["--commands", &source]);
        }
        let simulation = Actor::start(Program::Recorder, &self.sandbox, &args, SIMULATION_ENDS);
        let finished = match changes {
            None => simulation.wait(&mut self.journal),
            Some(changes) => simulation.kill_after(changes, &self.files, &mut self.journal),
        };
        self.check_recording(&file, Claim::from_end(&finished, false));
    }

    fn new_file(&mut self) -> String {
        self.sandbox.path(&self.kept.next_name())
    }

    /// Checks the file that a recorder or a simulation left, with `info`, `verify` and the reader of the
    /// library.
    fn check_recording(&mut self, file: &str, claim: Claim) {
        let Some(recording) = Recording::find(file, claim) else { return };
        let ends = if recording.rows.is_empty() { REPORTS_NOTHING } else { REPORTS };
        let info = self.run(Program::Recorder, &["info", "--json", &recording.path], ends);
        recording.check_info(&info);
        let verified = self.run(Program::Recorder, &["verify", "--json", &recording.path], ends);
        recording.check_verified(&info, &verified);
        if !recording.rows.is_empty() {
            self.check_repaired(&recording);
        }
        self.kept.add(recording);
    }

    /// Checks that a file passes `recorder check`: a finished one as it is, another one after its repair.
    fn check_repaired(&mut self, recording: &Recording) {
        if recording.is_finished() {
            self.run(Program::Recorder, &["check", &recording.path], CHECKS);
            return;
        }
        let repaired = format!("{}.repaired", recording.path);
        self.run(Program::Recorder, &["repair", &recording.path, &repaired], REPAIRS);
        self.run(Program::Recorder, &["check", &repaired], CHECKS);
        std::fs::remove_file(repaired).expect("a file of this run");
    }
}

impl Claim {
    /// Returns the claim of a recorder about its file, by its end.
    fn from_end(finished: &Finished, is_killed: bool) -> Self {
        match finished.code {
            Some(0) => Self::Complete,
            Some(3) => Self::Lossy,
            _ if is_killed && finished.signal == Some(Signal::KILL.as_raw()) => Self::Killed,
            _ => Self::None,
        }
    }
}
