//! The content of a recording that a verification does not compare.

use crate::counted;
use crate::log::Topic;

use super::finding::StepGap;

/// Content that a file has only once, so that nothing in it can contradict an edit.
const ALWAYS: [&str; 9] = [
    "the times of reception (log_time) of messages and of the scene",
    "wake_late_ns and solve_ns in /steps, which the node measured",
    "the number and the values of messages on /status, which the node measured",
    "time_scale in /parameters and the paused flag of keyframes, which belong to the node",
    "the outcomes of pause, resume, step and load beyond their order, and \"new_run\" of a load",
    "run_id, epoch_ns, contract_version and recorder_version in the metadata 'run', as far as other \
     parts agree with them",
    "stop_reason and the numbers of received, lost and missing messages in the metadata 'recorder'",
    "the name of the mcap library in the header of the file",
    "the indexes and the statistics of the file",
];
/// Content that a recording of a node has only once.
const LIVE: [&str; 4] = [
    "values of the scene that no recorded state depends on",
    "fields of commands in /outcomes that have no effect on a state, such as client_id and sequence, \
     and \"disconnected\" of a release",
    "the members of the lockstep in /events, which only the node knows",
    "snapshot_index in /steps beyond its order and the number of missing snapshots",
];

/// The extent of a verification.
#[derive(Debug, Clone, Default)]
pub(super) struct Coverage {
    /// The id of the run is the hash of the scene and all commands, and it was compared.
    pub(super) has_run_hash: bool,
    /// The messages have the form of an older recorder.
    pub(super) is_older_format: bool,
    /// The topics that the recording leaves out.
    pub(super) left_out: Vec<Topic>,
    /// Snapshots before the first one with a keyframe.
    pub(super) skipped_count: u64,
    /// The last step to compare, if the recording has later ones.
    pub(super) last_step: Option<u64>,
    /// The first state was restored from the recording, not computed from the scene.
    pub(super) is_restored: bool,
    /// States that a command put in place, and that the simulation had not computed before.
    pub(super) given_count: u64,
    /// The steps of the snapshots before the state to start from.
    pub(super) skipped: Option<StepGap>,
    /// Messages after the last snapshot, or of steps after it.
    pub(super) trailing_count: usize,
    /// Messages before the first snapshot with a keyframe that describe no state of the simulation.
    pub(super) earlier_count: usize,
    /// Tears with a cause that the recorder did not know.
    pub(super) unknown_cause_count: usize,
    /// Names of content of other programs.
    pub(super) foreign: Vec<String>,
}

impl Coverage {
    /// Describes the content that was not compared.
    pub(super) fn not_covered(&self) -> Vec<String> {
        let mut all: Vec<String> = ALWAYS.map(ToOwned::to_owned).into();
        if !self.has_run_hash {
            all.extend(LIVE.map(ToOwned::to_owned));
        }
        if self.is_older_format {
            all.push("the exact form of messages, because the format is older".to_owned());
        }
        let left_out = self.left_out.iter();
        all.extend(left_out.map(|one| format!("{}, which the recording leaves out", one.name())));
        if self.is_restored {
            all.push("the first state, from which the simulation started".to_owned());
        }
        if self.given_count > 0 {
            let count = self.given_count;
            let states = counted(count, "state");
            all.push(format!("{states} taken from the file, which a command put in place"));
        }
        if self.skipped_count > 0 {
            let snapshots = counted(self.skipped_count, "snapshot");
            all.push(format!("{snapshots} before the state to start from"));
        }
        if let Some(step) = self.last_step {
            all.push(format!("everything after step {step}, the last one to compare"));
        }
        if self.earlier_count > 0 {
            let messages = counted(self.earlier_count as u64, "message");
            all.push(format!("{messages} before the first state"));
        }
        if self.trailing_count > 0 {
            let messages = counted(self.trailing_count as u64, "message");
            all.push(format!("{messages} after the last snapshot"));
        }
        if self.unknown_cause_count > 0 {
            let tears = counted(self.unknown_cause_count as u64, "tear");
            all.push(format!("the causes of {tears}, which the recording calls unknown"));
        }
        all.extend(self.foreign.iter().map(|name| format!("{name}, which no recorder writes")));
        all
    }
}
