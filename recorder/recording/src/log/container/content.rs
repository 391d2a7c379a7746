//! The checks of messages: steps, clocks, finite values and hashes.

use std::collections::BTreeMap;

use mcap::records::{Channel, MessageHeader};
use sim_solver::Keyframe;

use super::lost_load::{LoadRows, LoadWatch, LostLoad};
use crate::log::encoding::particle_bytes;
use crate::log::message::{Message, StepOrder};
use crate::log::read::decode::MessageDecoder;
use crate::log::read::gaps::GapCounter;
use crate::log::read::reader::read_run;
use crate::log::read_error::ReadError;
use crate::log::rows::{ForcesRow, StepRow, TearsRow};
use crate::log::run::RunDescription;
use crate::log::run::selection::ContentSelection;
use crate::log::scanner::limits::SizeLimits;
use crate::log::tears::{HashSeeds, hash_bytes};
use crate::log::topic::{AllCounts, Topic};

/// Size of a particle in a message.
const PARTICLE_SIZE_BYTES: usize = 32;
/// Numbers of a particle that must be finite: all but the flags.
const NUMBER_COUNT: usize = 7;
/// The exponent of f32 numbers that are not finite.
const EXPONENT: u32 = 0x7f80_0000;

/// A message that passed its checks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Validity {
    /// A message of another program, or `/tf`.
    Other,
    /// The header of a snapshot, whose payload must follow.
    Row,
    /// The payload of the snapshot whose header was the last.
    Payload,
    /// A message on any other topic.
    Update(Topic),
}

/// The checks of all messages of a file, in their order.
#[derive(Debug)]
pub(super) struct ContentCheck {
    run: RunDescription,
    selection: ContentSelection,
    limits: SizeLimits,
    channels: BTreeMap<u16, Option<Topic>>,
    log_time_ns: u64,
    /// The last header, while its payload has not followed.
    row: Option<StepRow>,
    last_row: Option<StepRow>,
    seeds: HashSeeds,
    pub(super) load: LoadWatch,
    order: StepOrder,
    pub(super) gaps: GapCounter,
    /// Only `written` is set.
    pub(super) counts: AllCounts,
    /// Snapshots whose torn constraints are unknown, so that their hash was not compared.
    pub(super) unhashed_count: u64,
}

impl ContentCheck {
    /// Returns what is known of a load that the file lacks.
    pub(super) fn lost_load(&self) -> Option<LostLoad> {
        self.load.lost()
    }

    /// Starts with the metadata `run` of a file.
    pub(super) fn new(
        run: &BTreeMap<String, String>,
        selection: ContentSelection,
        scene_size_bytes: usize,
    ) -> Result<Self, ReadError> {
        let run = read_run(run)?;
        Ok(Self {
            selection,
            limits: SizeLimits::new(&run, scene_size_bytes),
            order: StepOrder::default(),
            run,
            channels: BTreeMap::new(),
            log_time_ns: 0,
            row: None,
            last_row: None,
            seeds: HashSeeds::default(),
            load: LoadWatch::default(),
            gaps: GapCounter::for_selection(selection),
            counts: AllCounts::default(),
            unhashed_count: 0,
        })
    }

    pub(super) fn limits(&self) -> &SizeLimits {
        &self.limits
    }

    pub(super) fn run(&self) -> &RunDescription {
        &self.run
    }

    /// Returns the newest sound snapshot.
    pub(super) fn last_row(&self) -> Option<&StepRow> {
        self.last_row.as_ref()
    }

    /// Adds a channel. Returns a description of one that the file declares differently before.
    pub(super) fn add_channel(&mut self, channel: &Channel) -> Result<(), String> {
        let id = channel.id;
        let known = Topic::from_name(&channel.topic);
        match self.channels.insert(id, known) {
            Some(other) if other != known => Err(format!("channel {id} has two definitions")),
            _ => Ok(()),
        }
    }

    /// Returns the step of a header whose payload has not followed yet.
    pub(super) fn row_step(&self) -> Option<u64> {
        self.row.map(|row| row.step)
    }

    /// Removes the count of a header that is not kept.
    pub(super) fn uncount_row(&mut self) {
        self.row = None;
        self.counts[Topic::Steps].written -= 1;
    }

    /// Returns `true` if the file has declared any channel.
    pub(super) fn has_channels(&self) -> bool {
        !self.channels.is_empty()
    }

    /// Returns `true` if the file has declared a channel.
    pub(super) fn is_declared(&self, channel_id: u16) -> bool {
        self.channels.contains_key(&channel_id)
    }

    /// Returns the topic of a channel, and `None` for an undeclared one or one of another program.
    pub(super) fn topic(&self, channel_id: u16) -> Option<Topic> {
        self.channels.get(&channel_id).copied().flatten()
    }

    /// Marks a part of the file as unreadable.
    pub(super) fn mark_gap(&mut self) {
        self.seeds.mark_gap();
        self.load.mark_gap();
        self.row = None;
    }

    /// Adds a load that the output of a repair has and the input has lost.
    pub(super) fn add_load(&mut self, load: &LoadRows) {
        for message in load.messages() {
            self.counts[message.topic()].written += 1;
            self.seeds.process(&message);
        }
    }

    /// Returns the step of a header whose payload is missing, once.
    pub(super) fn take_row(&mut self) -> Option<u64> {
        self.row.take().filter(|_| self.needs_payload()).map(|row| row.step)
    }

    /// Returns `true` if a payload must follow each header.
    fn needs_payload(&self) -> bool {
        !self.selection.is_only_commands
    }

    /// Checks a message. `Err` describes its fault; then it has no effect on later checks.
    pub(super) fn check(
        &mut self,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<Validity, String> {
        let channel_id = header.channel_id;
        if !self.is_declared(channel_id) {
            return Err(format!("its channel {channel_id} is not declared before it"));
        }
        let Some(topic) = self.topic(channel_id) else { return Ok(Validity::Other) };
        if header.log_time < self.log_time_ns {
            return Err("its log_time is earlier than that of the message before it".to_owned());
        }
        let message = match topic {
            Topic::Particles => self.check_particles(header, data)?,
            _ => self.check_decoded(topic, header, data)?,
        };
        self.log_time_ns = header.log_time;
        self.counts[topic].written += 1;
        Ok(message)
    }

    fn check_decoded(
        &mut self,
        topic: Topic,
        header: &MessageHeader,
        data: &[u8],
    ) -> Result<Validity, String> {
        let mut decoder =
            MessageDecoder { run: &self.run, limits: &self.limits, spare: &mut Vec::new() };
        let logged = decoder.decode(topic, header, data)?;
        let Some(logged) = logged else { return Ok(Validity::Other) };
        let message = logged.message;
        self.check_time(header, message.step())?;
        match &message {
            Message::Step(row) => self.check_row(row)?,
            Message::Keyframe { bytes, .. } => {
                Keyframe::decode(bytes).map_err(|error| error.to_string())?;
            }
            Message::Tears(row) => self.check_tears(row)?,
            Message::Forces(row) => self.check_forces(row)?,
            _ => {}
        }
        self.check_order(topic, message.step())?;
        self.gaps.add(&message);
        self.seeds.process(&message);
        self.load.process(&message);
        match message {
            Message::Step(row) if self.needs_payload() => {
                self.row = Some(row);
                Ok(Validity::Row)
            }
            Message::Step(row) => {
                // A recording of commands has the payloads of some.
                self.row = self.selection.is_only_commands.then_some(row);
                self.last_row = Some(row);
                Ok(Validity::Update(Topic::Steps))
            }
            _ => Ok(Validity::Update(topic)),
        }
    }

    fn check_order(&mut self, topic: Topic, step: u64) -> Result<(), String> {
        self.order.add(topic, step).map_err(|newest_step| {
            format!("step {step}: it is out of order, after step {newest_step}")
        })
    }

    /// Compares the times of a message with its step.
    fn check_time(&self, header: &MessageHeader, step: u64) -> Result<(), String> {
        if header.publish_time != self.run.time_of_step_ns(step) {
            return Err(format!("step {step}: its publish_time is that of another step"));
        }
        if u64::from(header.sequence) != step & u64::from(u32::MAX) {
            return Err(format!("step {step}: its sequence is that of another step"));
        }
        Ok(())
    }

    pub(super) fn selection(&self) -> ContentSelection {
        self.selection
    }

    /// Compares the impulses with the particles of the scene.
    fn check_forces(&self, row: &ForcesRow) -> Result<(), String> {
        let (step, count) = (row.step, self.run.particle_count);
        if let Some(problem) = row.problem() {
            return Err(format!("step {step}: {problem}"));
        }
        match row.particles.iter().find(|index| **index >= count) {
            Some(index) => Err(format!(
                "step {step}: the scene has no particle {index}, but {count} particles"
            )),
            None => Ok(()),
        }
    }

    /// Compares the list of torn constraints with the constraints of the scene.
    fn check_tears(&self, row: &TearsRow) -> Result<(), String> {
        let (step, count) = (row.step, self.run.constraint_count);
        if row.constraints.len() as u64 > u64::from(count) {
            let found = row.constraints.len();
            return Err(format!(
                "step {step}: {found} constraints tear, but the scene has {count}"
            ));
        }
        match row.constraints.iter().find(|index| **index >= count) {
            Some(index) => {
                Err(format!("step {step}: constraint {index} tears, but the scene has {count}"))
            }
            None => Ok(()),
        }
    }

    fn check_row(&self, row: &StepRow) -> Result<(), String> {
        let step = row.step;
        if let Some(before) = self.row.filter(|_| self.needs_payload()) {
            return Err(format!("step {step}: the snapshot of step {} is missing", before.step));
        }
        let Some(last) = self.last_row else { return Ok(()) };
        if step <= last.step {
            return Err(format!("step {step} follows step {}", last.step));
        }
        if row.outcome_count < last.outcome_count {
            return Err(format!("step {step}: it counts fewer outcomes than step {}", last.step));
        }
        // Numbers count modulo 2^32. A step has at most one snapshot.
        let (index, last_index) = (row.snapshot_index, last.snapshot_index);
        if !(1..=step - last.step).contains(&u64::from(index.wrapping_sub(last_index))) {
            return Err(format!(
                "step {step}: its snapshot_index is {index}, but that of step {} is {last_index}",
                last.step
            ));
        }
        Ok(())
    }

    fn check_particles(&mut self, header: &MessageHeader, data: &[u8]) -> Result<Validity, String> {
        let row = self.row.take();
        let limit = self.limits.message_size_bytes_max(Topic::Particles);
        if data.len() as u64 > limit {
            return Err(format!("it has {} bytes (allowed: up to {limit})", data.len()));
        }
        let step = self.run.step_at(header.publish_time);
        let step = step.ok_or("its time is not the time of a step")?;
        self.check_time(header, step)?;
        let row = row.filter(|row| row.step == step);
        let row = row.ok_or_else(|| format!("step {step}: its row in /steps is missing"))?;
        self.check_order(Topic::Particles, step)?;
        let particles = particle_bytes(data).map_err(|error| format!("step {step}: {error}"))?;
        let count = particles.len() / PARTICLE_SIZE_BYTES;
        if count as u64 != u64::from(self.run.particle_count) {
            let expected = self.run.particle_count;
            return Err(format!("step {step}: it has {count} particles instead of {expected}"));
        }
        if let Some(index) = not_finite(particles) {
            return Err(format!("step {step}: particle {index} has a value that is not finite"));
        }
        match self.seeds.seed(&row) {
            Some(seed) => {
                let found = hash_bytes(particles, seed);
                if found != row.state_hash {
                    return Err(format!(
                        "step {step}: its particles have the hash {found:016x}, but its row in /steps \
                         has {:016x}",
                        row.state_hash
                    ));
                }
            }
            None => self.unhashed_count += 1,
        }
        self.last_row = Some(row);
        Ok(Validity::Payload)
    }
}

/// Returns the first particle with a value that is not finite.
fn not_finite(particles: &[u8]) -> Option<usize> {
    // Without an early exit, the compiler uses vectors.
    let (states, _) = particles.as_chunks::<PARTICLE_SIZE_BYTES>();
    if !states.iter().fold(false, |found, state| found | is_not_finite(state)) {
        return None;
    }
    states.iter().position(is_not_finite)
}

fn is_not_finite(state: &[u8; PARTICLE_SIZE_BYTES]) -> bool {
    let (words, _) = state.as_chunks::<4>();
    let is_bad = |word: &[u8; 4]| u32::from_le_bytes(*word) & EXPONENT == EXPONENT;
    words[..NUMBER_COUNT].iter().fold(false, |found, word| found | is_bad(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_a_particle_must_be_finite_and_its_flags_need_not() {
        for word in 0..8 {
            for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut bytes = vec![0; 3 * PARTICLE_SIZE_BYTES];
                let place = PARTICLE_SIZE_BYTES + 4 * word;
                bytes[place..place + 4].copy_from_slice(&value.to_le_bytes());
                assert_eq!(not_finite(&bytes), (word < NUMBER_COUNT).then_some(1), "word {word}");
            }
        }
        let largest: Vec<u8> = [f32::MAX; 8].iter().flat_map(|one| one.to_le_bytes()).collect();
        assert_eq!(not_finite(&largest), None);
    }
}
