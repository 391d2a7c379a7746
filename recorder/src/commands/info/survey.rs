//! Reads a whole recording for its report, in bounded memory.

use std::io::Read;

use recording::{
    Closing, GapCounter, LogEnd, LogReader, LoggedMessage, Message, RunDescription, StepRow, Topic,
};

use super::report::Info;
use super::timing::TimingCollector;

/// The report on a recording so far.
struct Survey {
    info: Info,
    gaps: GapCounter,
    timing: TimingCollector,
    /// The newest header of a snapshot. Its particles can be missing at the end of a truncated file.
    newest: Option<StepRow>,
    /// The topic that counts as the snapshots.
    counted: Topic,
    /// Times of the first and of the last message.
    log_times_ns: Option<[u64; 2]>,
}

/// Reads the whole recording.
pub(super) fn inspect<R: Read>(
    log: &mut LogReader<R>,
    file: String,
    size_bytes: u64,
) -> anyhow::Result<(Info, LogEnd)> {
    let mut survey = Survey::new(log, Info::new(log.run(), file, size_bytes))?;
    while let Some(logged) = log.next_message()? {
        survey.add(&logged);
    }
    survey.info.messages.insert(Topic::Tf.name(), log.transform_count());
    let end = log.end().cloned().unwrap_or(LogEnd::Complete);
    Ok((survey.finish(log.run(), log.closing(), &end), end))
}

impl Survey {
    fn new<R: Read>(log: &LogReader<R>, mut info: Info) -> anyhow::Result<Self> {
        info.messages = Topic::ALL.map(|topic| (topic.name(), 0)).into();
        let selection = log.selection();
        Ok(Self {
            info,
            gaps: GapCounter::for_selection(selection),
            timing: TimingCollector::new(log.run().rate_hz)?,
            newest: None,
            counted: if selection.is_only_commands { Topic::Steps } else { Topic::Particles },
            log_times_ns: None,
        })
    }

    fn add(&mut self, logged: &LoggedMessage) {
        let (message, log_time_ns) = (&logged.message, logged.log_time_ns);
        self.gaps.add(message);
        *self.info.messages.entry(message.topic().name()).or_default() += 1;
        self.log_times_ns.get_or_insert([log_time_ns; 2])[1] = log_time_ns;
        if let Message::Step(row) = message {
            self.timing.add(row);
            self.newest = Some(*row);
        }
        if message.topic() == self.counted {
            self.add_snapshot(message.step());
        }
    }

    fn add_snapshot(&mut self, step: u64) {
        self.info.first_step.get_or_insert(step);
        self.info.last_step = Some(step);
        self.info.snapshot_count += 1;
        let row = self.newest.filter(|row| row.step == step);
        let torn_count = row.map(|row| row.torn_count);
        self.info.torn_count_first = self.info.torn_count_first.or(torn_count);
        self.info.torn_count_last = torn_count;
        self.info.last_state_hash = row.map(|row| format!("{:016x}", row.state_hash));
    }

    fn finish(self, run: &RunDescription, closing: Option<&Closing>, end: &LogEnd) -> Info {
        let mut info = self.info;
        info.stop_reason = closing.map(|closing| closing.stop_reason.clone());
        info.lost = self.gaps.lost(closing);
        info.file_end = end.to_string();
        info.timing = self.timing.timing();
        if let (Some(first), Some(last)) = (info.first_step, info.last_step) {
            let passed = last.saturating_sub(first) as f64;
            info.duration_s = passed / f64::from(run.rate_hz);
            if passed > 0.0 {
                // Both ends belong to the recorded steps.
                info.set_rates((passed + 1.0) / f64::from(run.rate_hz));
            }
        }
        if !info.simulated {
            let duration_s = |[first, last]: [u64; 2]| last.saturating_sub(first) as f64 / 1e9;
            info.wall_clock_s = self.log_times_ns.map(duration_s);
        }
        info
    }
}
