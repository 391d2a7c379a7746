//! The content of a recording, read in bounded memory, as printed.

use std::collections::BTreeMap;
use std::fmt;
use std::io::Read;

use recording::{
    Closing, GapCounter, LogEnd, LogReader, LoggedMessage, Message, RunDescription, StepRow, Topic,
    counted,
};
use serde::Serialize;
use sim_contract::printable_line;

use super::timing::{Timing, TimingCollector};

/// The content of a recording, as printed.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Info {
    pub(super) file: String,
    pub(super) size_bytes: u64,
    /// "complete", "truncated ..." or "damaged ...".
    pub(super) file_end: String,
    pub(super) scene: String,
    pub(super) particle_count: u32,
    pub(super) constraint_count: u32,
    pub(super) bend_count: u32,
    pub(super) rate_hz: u32,
    pub(super) method: &'static str,
    /// 16 hex digits.
    pub(super) run_id: String,
    pub(super) solver_version: u32,
    pub(super) contract_version: u32,
    pub(super) recorder_version: String,
    /// `true` for a recording by `simulate`, which has no wall clock.
    pub(super) simulated: bool,
    pub(super) first_step: Option<u64>,
    pub(super) last_step: Option<u64>,
    #[serde(skip)]
    pub(super) snapshot_count: u64,
    /// From the first to the last snapshot, in simulated seconds.
    pub(super) duration_s: f64,
    /// From the reception of the first message to that of the last one. Absent if simulated.
    pub(super) wall_clock_s: Option<f64>,
    /// Number of messages in the file, by topic.
    pub(super) messages: BTreeMap<&'static str, u64>,
    /// Messages per simulated second, for topics with messages. A step lasts for its period, so one
    /// message in each step has the rate of the scene. Empty if there are fewer than two steps.
    pub(super) messages_per_s: BTreeMap<&'static str, f64>,
    /// Messages that the recorder lost or that never reached it, for topics with such messages, and
    /// "unreadable" ones. In a file without an end, only those that are missing between recorded ones.
    pub(super) lost: BTreeMap<&'static str, u64>,
    /// Torn constraints in the first and in the last snapshot.
    pub(super) torn_count_first: Option<u32>,
    pub(super) torn_count_last: Option<u32>,
    /// Hash of the last snapshot: 16 hex digits.
    pub(super) last_state_hash: Option<String>,
    /// Absent if no time was measured, as in a simulated recording.
    pub(super) timing: Option<Timing>,
    /// Reason why the recorder stopped. Absent if it was killed.
    pub(super) stop_reason: Option<String>,
}

impl Info {
    /// Returns a report without content.
    pub(super) fn new(run: &RunDescription, file: String, size_bytes: u64) -> Self {
        Self {
            file,
            size_bytes,
            scene: run.scene_name.clone(),
            particle_count: run.particle_count,
            constraint_count: run.constraint_count,
            bend_count: run.bend_count,
            rate_hz: run.rate_hz,
            method: run.method_name(),
            run_id: format!("{:016x}", run.run_id),
            solver_version: run.solver_version,
            contract_version: run.contract_version,
            recorder_version: run.recorder_version.clone(),
            simulated: run.epoch_ns == 0,
            ..Self::default()
        }
    }

    /// Returns the name of the file without its folder.
    pub(super) fn file_name(&self) -> &str {
        self.file.rsplit('/').next().unwrap_or(&self.file)
    }

    /// Returns the reason why a recording has no measured times.
    pub(super) fn untimed_reason(&self) -> &'static str {
        if self.simulated {
            "simulated, so no time was measured"
        } else {
            "no step was computed while it was recorded"
        }
    }

    /// Sets the rates of the topics in a file whose steps last for `duration_s` seconds.
    pub(super) fn set_rates(&mut self, duration_s: f64) {
        let filled = self.messages.iter().filter(|(_, count)| **count > 0);
        self.messages_per_s =
            filled.map(|(topic, count)| (*topic, *count as f64 / duration_s)).collect();
    }

    fn write_run(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (file, file_end) = (printable_line(&self.file), printable_line(&self.file_end));
        writeln!(f, "file        {file}, {} bytes, {file_end}", self.size_bytes)?;
        let bends = match self.bend_count {
            0 => String::new(),
            count => format!("{}, ", counted(count, "bend")),
        };
        writeln!(
            f,
            "scene       {}: {}, {}, {bends}{} Hz, {}",
            printable_line(&self.scene),
            counted(self.particle_count, "particle"),
            counted(self.constraint_count, "constraint"),
            self.rate_hz,
            self.method
        )?;
        writeln!(
            f,
            "run         {} (solver version {}, contract version {}, recorder {})",
            self.run_id,
            self.solver_version,
            self.contract_version,
            printable_line(&self.recorder_version)
        )
    }

    fn write_steps(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.first_step, self.last_step) {
            (Some(first), Some(last)) => {
                let (count, duration_s) = (self.snapshot_count, self.duration_s);
                writeln!(f, "steps       {first}..={last}, {count} recorded, {duration_s:.3} s")?;
            }
            _ => writeln!(f, "steps       none")?,
        }
        match self.wall_clock_s {
            Some(wall_clock_s) => {
                writeln!(f, "wall clock  {wall_clock_s:.3} s from the first to the last message")?;
            }
            None if self.simulated => writeln!(f, "wall clock  none (simulated)")?,
            None => writeln!(f, "wall clock  none")?,
        }
        if let (Some(first), Some(last)) = (self.torn_count_first, self.torn_count_last) {
            writeln!(f, "torn        {first} in the first snapshot, {last} in the last one")?;
        }
        let hash = self.last_state_hash.as_deref();
        hash.map_or(Ok(()), |hash| writeln!(f, "last hash   {hash}"))
    }

    fn write_end(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scope = if self.stop_reason.is_none() { ", as far as the file goes" } else { "" };
        let lost = self.lost.iter().map(|(topic, count)| format!("{topic} {count}"));
        let lost = lost.collect::<Vec<_>>().join(", ");
        let lost = if lost.is_empty() { "none" } else { &lost };
        writeln!(f, "lost        {lost}{scope}")?;
        let reason = self.stop_reason.as_deref().unwrap_or("unknown");
        writeln!(f, "stopped     {}", printable_line(reason))
    }

    fn write_topics(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\n{:<12}{:>10} {:>16}", "topic", "messages", "per simulated s")?;
        for (topic, count) in self.messages.iter().filter(|(_, count)| **count > 0) {
            let rate = self.messages_per_s.get(topic);
            let rate = rate.map_or("-".to_owned(), |rate| format!("{rate:.2}"));
            writeln!(f, "{topic:<12}{count:>10} {rate:>16}")?;
        }
        Ok(())
    }
}

impl fmt::Display for Info {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_run(f)?;
        self.write_steps(f)?;
        self.write_end(f)?;
        self.write_topics(f)?;
        match &self.timing {
            Some(timing) => write!(f, "\n{timing}"),
            None => write!(f, "\ntiming      none ({})", self.untimed_reason()),
        }
    }
}

/// The report on a recording so far.
struct InfoSurvey {
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
    let mut survey = InfoSurvey::new(log, Info::new(log.run(), file, size_bytes))?;
    while let Some(logged) = log.next_message()? {
        survey.add(&logged);
    }
    survey.info.messages.insert(Topic::Tf.name(), log.transform_count());
    let end = log.end().cloned().unwrap_or(LogEnd::Complete);
    Ok((survey.finish(log.run(), log.closing(), &end), end))
}

impl InfoSurvey {
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
