//! The thread of a ghost: opens the recording, and compares it with the one on show.

use std::cmp::Ordering as StepOrder;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;

use anyhow::{Context, bail};
use recording::verification::{SnapshotDifference, snapshot_difference};
use recording::{Frame, FrameReader, IndexedLog, LogEnd, ReadError, Tape};
use sim_contract::ConstraintState;
use sim_host::Stop;
use sim_host::clock::{SECOND_NS, monotonic_ns};

use super::super::open::{self, Recording, file_of};
use crate::message::GhostState;

/// Time between two reports.
const REPORT_PERIOD_NS: u64 = SECOND_NS / 2;

/// A report of the thread.
#[derive(Debug)]
pub(super) enum Report {
    /// The ghost is open, and has the particles and constraints of the recording on show.
    Opened(Box<Tape>),
    /// The comparison.
    Progress { state: GhostState, text: String, first_different_step: Option<u64> },
}

/// The recording on show.
#[derive(Debug)]
pub(super) struct Shown {
    log: IndexedLog,
    file: String,
    particle_count: u32,
    rate_hz: u32,
    first_step: u64,
    constraints: Vec<ConstraintState>,
}

impl Shown {
    pub(super) fn from_recording(recording: &Recording) -> Self {
        let run = recording.tape.run();
        Self {
            log: recording.tape.log().clone(),
            file: recording.file.clone(),
            particle_count: run.particle_count,
            rate_hz: run.rate_hz,
            first_step: recording.tape.first_step(),
            constraints: recording.load.constraints.clone(),
        }
    }

    /// Checks that the states of another recording can be compared with this one's, particle by particle.
    fn check(&self, ghost: &Recording) -> anyhow::Result<()> {
        let run = ghost.tape.run();
        let remedy = "a ghost must be a recording of the same particles and constraints";
        if run.particle_count != self.particle_count {
            let (own, other) = (self.particle_count, run.particle_count);
            bail!("it has {other} particles instead of {own}; {remedy}");
        }
        let ends = |constraints: &[ConstraintState]| -> Vec<_> {
            constraints.iter().map(|one| (one.a, one.b)).collect()
        };
        if ends(&ghost.load.constraints) != ends(&self.constraints) {
            bail!("its constraints connect different particles; {remedy}");
        }
        if run.rate_hz != self.rate_hz {
            let (own, other) = (self.rate_hz, run.rate_hz);
            bail!(
                "it has {other} steps per second instead of {own}, so equal steps are different times"
            );
        }
        Ok(())
    }
}

/// A ghost to open and compare.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) shown: Shown,
    pub(super) name: String,
    pub(super) path: PathBuf,
    pub(super) stop: Stop,
    pub(super) is_cancelled: Arc<AtomicBool>,
}

impl Job {
    /// Runs to the end, or until the ghost is no longer chosen.
    pub(super) fn run(self, reports: &Sender<Report>) {
        let result = self.open_and_compare(reports);
        let report = match result {
            Ok(compared) => self.result(&compared),
            Err(error) => Report::Progress {
                state: GhostState::Failed,
                text: format!("{}: {error:#}", self.name),
                first_different_step: None,
            },
        };
        // Nobody receives the reports of a ghost that is no longer chosen.
        let _sent = reports.send(report);
    }

    fn open_and_compare(&self, reports: &Sender<Report>) -> anyhow::Result<Compared> {
        let is_cancelled = || self.is_cancelled.load(Ordering::Relaxed);
        if is_cancelled() {
            return Ok(Compared::default());
        }
        let ghost = open::open(&self.path, &self.stop, &mut |_| {})?;
        self.shown.check(&ghost)?;
        let (first, last) = (ghost.tape.first_step(), ghost.tape.last_step());
        let log = ghost.tape.log().clone();
        let _sent = reports.send(Report::Opened(Box::new(ghost.tape)));
        let mut next_report_ns = monotonic_ns();
        let on_step = |step: u64| {
            if monotonic_ns() >= next_report_ns {
                next_report_ns = monotonic_ns() + REPORT_PERIOD_NS;
                let done = u128::from(step.saturating_sub(first));
                let percent = 100 * done / u128::from((last - first).max(1));
                let text = format!("comparing with {}: {percent} %", self.name);
                let (state, first_different_step) = (GhostState::Comparing, None);
                let _sent = reports.send(Report::Progress { state, text, first_different_step });
            }
            !is_cancelled()
        };
        compare([&self.shown.log, &log], &self.stop, on_step).context("comparing")
    }

    /// Puts the result into words.
    fn result(&self, compared: &Compared) -> Report {
        let Self { name, shown, .. } = self;
        let mut first_different_step = None;
        let (state, mut text) = match (&compared.first, compared.common_steps) {
            (Some(first), _) => {
                first_different_step = Some(first.step);
                // As on the clock of the page, which begins with the file.
                let steps = first.step.saturating_sub(shown.first_step);
                let time_s = steps as f64 / f64::from(shown.rate_hz);
                let place = &first.place;
                let text =
                    format!("{name} differs from step {} ({time_s:.3} s): {place}", first.step);
                (GhostState::Different, text)
            }
            (None, 0) => {
                let text = format!("{name} and this recording have no step in common");
                (GhostState::Failed, text)
            }
            (None, count) => {
                let text = format!("{name}: {count} common steps, equal in every bit");
                (GhostState::Equal, text)
            }
        };
        if compared.first.is_none() {
            let files = [shown.file.clone(), file_of(&self.path)];
            for (file, end) in files.iter().zip(&compared.ends).filter(|(_, end)| !end.is_empty()) {
                text += &format!("; {file} is {end}");
            }
        }
        Report::Progress { state, text, first_different_step }
    }
}

/// The result of a comparison, up to the first difference.
#[derive(Debug, Default)]
struct Compared {
    /// Number of equal steps that both have.
    common_steps: u64,
    first: Option<FirstDifference>,
    /// Where each file ends that lacks its end; otherwise empty.
    ends: [String; 2],
}

/// The first difference.
#[derive(Debug, PartialEq, Eq)]
struct FirstDifference {
    step: u64,
    /// The particle and the field, for the user.
    place: String,
}

/// Compares the hashes and every bit of the particles in the steps that both files have, up to the first
/// difference. `on_step` is called after each, and returns whether to go on.
///
/// # Errors
/// A file cannot be read, or a signal has arrived.
fn compare(
    [a, b]: [&IndexedLog; 2],
    stop: &Stop,
    mut on_step: impl FnMut(u64) -> bool,
) -> Result<Compared, ReadError> {
    let [mut a, mut b] = [FrameReader::new(a.reader(stop)?), FrameReader::new(b.reader(stop)?)];
    let mut compared = Compared::default();
    let (mut frame_a, mut frame_b) = (a.next_frame()?, b.next_frame()?);
    while let (Some(one), Some(other)) = (&frame_a, &frame_b) {
        let order = one.row.step.cmp(&other.row.step);
        if order == StepOrder::Equal {
            compared.first = difference(one, other);
            if compared.first.is_some() {
                return Ok(compared);
            }
            compared.common_steps += 1;
        }
        if !on_step(one.row.step) {
            return Ok(compared);
        }
        if order != StepOrder::Greater {
            frame_a = a.next_frame()?;
        }
        if order != StepOrder::Less {
            frame_b = b.next_frame()?;
        }
    }
    compared.ends = [a, b].map(|reader| end_text(reader.end()));
    Ok(compared)
}

fn end_text(end: Option<&LogEnd>) -> String {
    end.filter(|end| **end != LogEnd::Complete).map(ToString::to_string).unwrap_or_default()
}

fn difference(a: &Frame, b: &Frame) -> Option<FirstDifference> {
    let place = match snapshot_difference(a, b)? {
        SnapshotDifference::Particle(found) => {
            format!("particle {}, {}", found.particle, found.field)
        }
        SnapshotDifference::TornConstraints => "the torn constraints".to_owned(),
    };
    Some(FirstDifference { step: a.row.step, place })
}
