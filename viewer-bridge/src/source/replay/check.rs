//! Reads a recording once from its start, in a thread of its own: compares every state with its recorded
//! hash, and collects the marks of the timeline.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;

use recording::{
    HashSeeds, IndexedLog, LogEnd, LoggedMessage, Message, OutcomeRow, ReadError, StepRow,
};
use sim_contract::ParticleState;
use sim_host::clock::{SECOND_NS, monotonic_ns};

use super::marks::Marks;
use crate::message::{Hashes, Mark, MarkKind};

/// Time between two reports.
const REPORT_PERIOD_NS: u64 = SECOND_NS;

/// The result so far.
#[derive(Debug, Clone)]
pub(super) struct Report {
    pub(super) marks: Vec<Mark>,
    pub(super) hashes: Hashes,
    /// The result of the hashes for the user.
    pub(super) hash_text: String,
}

/// A recording to check.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) log: IndexedLog,
    pub(super) first: StepRow,
    pub(super) last_step: u64,
}

/// Reads to the end, or until it is cancelled.
pub(super) fn check(mut job: Job, reports: &Sender<Report>, is_cancelled: &AtomicBool) {
    let mut check = Check::new(&job);
    let count = job.log.chunks().len();
    let mut next_report_ns = monotonic_ns() + REPORT_PERIOD_NS;
    for chunk in 0..count {
        if is_cancelled.load(Ordering::Relaxed) {
            return;
        }
        check.add_chunk(job.log.read_chunk(chunk));
        if monotonic_ns() >= next_report_ns {
            next_report_ns = monotonic_ns() + REPORT_PERIOD_NS;
            // The receiver only goes away after the cancellation.
            let _sent = reports.send(check.interim(chunk, count));
        }
    }
    let _sent = reports.send(check.finish(job.log.end()));
}

#[derive(Debug)]
struct Check {
    marks: Marks,
    seeds: HashSeeds,
    row: Option<StepRow>,
    /// A step is late if it began later than this, in ns.
    period_ns: u64,
    equal_count: u64,
    /// Number of states whose hash could not be checked.
    unknown_count: u64,
    different_count: u64,
    first_different: Option<u64>,
    damaged_count: u64,
}

impl Check {
    fn new(job: &Job) -> Self {
        let first_step = job.first.step;
        Self {
            marks: Marks::new(first_step, job.last_step),
            seeds: HashSeeds::default(),
            row: None,
            period_ns: SECOND_NS / u64::from(job.log.run().rate_hz.max(1)),
            equal_count: 0,
            unknown_count: 0,
            different_count: 0,
            first_different: None,
            damaged_count: 0,
        }
    }

    fn add_chunk(&mut self, read: Result<Vec<LoggedMessage>, ReadError>) {
        let Ok(messages) = read else {
            self.damaged_count += 1;
            self.seeds.mark_gap();
            self.row = None;
            return;
        };
        for logged in &messages {
            self.add(&logged.message);
        }
    }

    fn add(&mut self, message: &Message) {
        self.seeds.process(message);
        match message {
            Message::Tears(row) => {
                let count = u32::try_from(row.constraints.len()).unwrap_or(u32::MAX);
                self.marks.add(Mark::new(MarkKind::Tear, row.step, count));
            }
            Message::Outcome(row) => self.add_outcome(row),
            Message::Step(row) => {
                if row.wake_late_ns > self.period_ns {
                    self.marks.add(Mark::new(MarkKind::Late, row.step, 1));
                }
                self.row = Some(*row);
            }
            Message::Particles { step, particles } => self.compare(*step, particles),
            _ => {}
        }
    }

    fn add_outcome(&mut self, row: &OutcomeRow) {
        if row.is_applied() {
            self.marks.add(Mark::from_action(&row.action, row.step));
        }
    }

    fn compare(&mut self, step: u64, particles: &[ParticleState]) {
        let row = self.row.take().filter(|row| row.step == step);
        match row.and_then(|row| self.seeds.is_equal(&row, particles)) {
            Some(true) => self.equal_count += 1,
            Some(false) => {
                self.different_count += 1;
                self.first_different.get_or_insert(step);
            }
            None => self.unknown_count += 1,
        }
    }

    fn interim(&self, chunk: usize, count: usize) -> Report {
        let percent = 100 * (chunk + 1) / count.max(1);
        Report {
            marks: self.marks.list(),
            hashes: Hashes::Checking,
            hash_text: format!("checking hashes: {percent} %"),
        }
    }

    fn finish(self, end: &LogEnd) -> Report {
        let count = self.equal_count + self.different_count;
        let (hashes, mut text) = match self.first_different {
            Some(step) => (
                Hashes::Diverged,
                format!("{} of {count} hashes differ, first at step {step}", self.different_count),
            ),
            None if self.equal_count == 0 => (Hashes::Absent, "no hashes".to_owned()),
            None => (Hashes::Verified, format!("{count} hashes verified")),
        };
        if self.unknown_count > 0 {
            text += &format!(", {} could not be checked", self.unknown_count);
        }
        if self.damaged_count > 0 {
            text += &format!("; damaged chunks skipped: {}", self.damaged_count);
        }
        if *end != LogEnd::Complete {
            text += &format!("; the file is {end}");
        }
        Report { marks: self.marks.list(), hashes, hash_text: text }
    }
}
