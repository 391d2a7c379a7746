//! The result of a verification.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Serialize, Serializer};
use sim_messages::printable_line;

use super::finding::{Difference, SnapshotFinding, StepGap};
use super::part::PartResult;
use super::past_states::AllStates;
use crate::counted;
use crate::log::LogEnd;

/// Content that no state depends on.
const NOT_COVERED: [&str; 3] = [
    "values of the scene that no recorded state depends on",
    "measured times, messages on /status and /events, and the paused flag of keyframes",
    "how numbers and texts are written, and the metadata and the index of the file",
];

/// The result of a verification. It serializes to the JSON that `recorder verify --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerifyReport {
    /// The result in one word.
    pub verdict: Verdict,
    /// The step from which the simulation started.
    pub first_step: u64,
    /// The last bit-identical step, if there is one.
    pub last_identical_step: Option<u64>,
    /// Number of simulated and compared steps.
    pub steps_identical: u64,
    /// The step that the verdict concerns.
    pub step: Option<u64>,
    /// Description of the finding, for people.
    pub what: Option<String>,
    /// Steps whose states could not be simulated, because outcomes are missing.
    pub gaps: Vec<StepGap>,
    /// Steps of the snapshots before the complete state from which the simulation started.
    pub skipped: Option<StepGap>,
    #[serde(flatten)]
    /// The first field that differs, if particles do.
    pub difference: Option<Difference>,
    /// The end of the file. `None` if the verification has not reached it.
    #[serde(rename = "file_end", serialize_with = "serialize_end")]
    pub end: Option<LogEnd>,
    /// Number of messages that the recording lacks, for topics with such messages, and "unreadable"
    /// ones.
    pub lost: BTreeMap<&'static str, u64>,
    /// The content that is not compared.
    pub not_covered: Vec<String>,
}

/// The result of a verification in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every compared bit is equal.
    Identical,
    /// The simulation or the header of the file differs.
    Diverged,
    /// Outcomes are missing. The states that do not depend on them are equal.
    OutcomeLogIncomplete,
    /// The verification was stopped. Everything up to there is equal.
    Interrupted,
}

#[allow(clippy::ref_option, reason = "the signature is that of serde")]
fn serialize_end<S: Serializer>(end: &Option<LogEnd>, serializer: S) -> Result<S::Ok, S::Error> {
    match end {
        Some(end) => serializer.collect_str(end),
        None => serializer.serialize_str("not reached"),
    }
}

impl VerifyReport {
    /// The report before the first snapshot.
    pub(super) fn new() -> Self {
        Self {
            verdict: Verdict::Identical,
            first_step: 0,
            last_identical_step: None,
            steps_identical: 0,
            step: None,
            what: None,
            gaps: Vec::new(),
            skipped: None,
            difference: None,
            end: None,
            lost: BTreeMap::new(),
            not_covered: NOT_COVERED.map(ToOwned::to_owned).into(),
        }
    }

    /// Returns the end of a file that is not complete.
    pub fn incomplete_end(&self) -> Option<&LogEnd> {
        self.end.as_ref().filter(|end| **end != LogEnd::Complete)
    }

    /// Adds the results of all parts, in order.
    pub(super) fn add_parts(&mut self, parts: Vec<PartResult>) {
        self.first_step = parts.first().map_or(0, |part| part.first_step);
        let earlier_count: usize = parts.iter().map(|part| part.earlier_count).sum();
        let mut states = AllStates::default();
        for mut part in parts {
            let misplaced = part.past.take().and_then(|past| states.add(past));
            if let Some(SnapshotFinding::Diverged { step, .. }) = &misplaced {
                part.cut(*step);
            }
            self.steps_identical += part.identical_count;
            self.last_identical_step = part.last_identical_step.or(self.last_identical_step);
            self.gaps.append(&mut part.gaps);
            part.findings.into_iter().chain(misplaced).for_each(|finding| self.add(finding));
            if self.verdict == Verdict::Diverged {
                break;
            }
        }
        if self.first_step > 0 {
            let what = "the first state, from which the simulation started";
            self.not_covered.push(what.to_owned());
        }
        let of_file = "taken from the file, which a command put in place";
        self.add_not_covered(states.given_count, "state", of_file);
        self.add_not_covered(earlier_count as u64, "message", "before the first state");
    }

    /// Adds content that was not compared, if there is any.
    pub(super) fn add_not_covered(&mut self, count: u64, noun: &str, what: &str) {
        if count > 0 {
            self.not_covered.push(format!("{} {what}", counted(count, noun)));
        }
    }

    /// Adds a finding.
    pub(super) fn add(&mut self, finding: SnapshotFinding) {
        match finding {
            SnapshotFinding::NotCompared | SnapshotFinding::Identical => {}
            SnapshotFinding::Diverged { step, what, difference } => {
                self.verdict = Verdict::Diverged;
                (self.step, self.what, self.difference) = (Some(step), Some(what), difference);
            }
            SnapshotFinding::OtherContent { what } => {
                self.verdict = Verdict::Diverged;
                (self.step, self.what) = (None, Some(what));
            }
            SnapshotFinding::Interrupted => self.verdict = Verdict::Interrupted,
            // The report names the first one.
            SnapshotFinding::Incomplete { .. } if self.verdict == Verdict::OutcomeLogIncomplete => {
            }
            SnapshotFinding::Incomplete { step, what } => {
                self.verdict = Verdict::OutcomeLogIncomplete;
                (self.step, self.what) = (Some(step), Some(what));
            }
        }
    }
}

impl fmt::Display for VerifyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let steps = |kind: &str| counted(self.steps_identical, &format!("{kind}step"));
        let what = printable_line(self.what.as_deref().unwrap_or(""));
        let step = self.step.unwrap_or(0);
        match self.verdict {
            Verdict::Identical if self.steps_identical == 0 => {
                write!(f, "no step to compare after step {}", self.first_step)
            }
            Verdict::Identical => {
                let last = self.last_identical_step.unwrap_or(self.first_step);
                write!(f, "{} bit-identical ({}..={last})", steps(""), self.first_step)
            }
            Verdict::Diverged if self.step.is_none() => {
                write!(f, "the file differs: {what} ({} bit-identical)", steps(""))
            }
            Verdict::Diverged => {
                write!(f, "step {step} differs: {what} ({} before it bit-identical)", steps(""))
            }
            Verdict::OutcomeLogIncomplete => write!(
                f,
                "outcome log incomplete from step {step}: {what} ({} bit-identical)",
                steps("other ")
            ),
            Verdict::Interrupted => write!(f, "interrupted; {} so far bit-identical", steps("")),
        }
    }
}
