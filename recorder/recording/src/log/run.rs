//! The metadata of a recording: the recorded run, and the end of the recording.

pub(in crate::log) mod selection;

use std::collections::BTreeMap;
use std::fmt::Display;
use std::str::FromStr;

use sim_messages::{ELEMENTS_MAX, LoadHeader, SnapshotHeader};
use sim_solver::scene::Up;

use super::rows::{StepRow, TopologyRow};
use super::topic::{AllCounts, Topic, TopicCounts};

/// Version of the topics, rows and metadata in a file.
///
/// `docs/formats-history.md` lists the changes of each version. Version 7 is the oldest one that is read.
pub const FORMAT_VERSION: u32 = 7;
/// The entry of the metadata `run` that distinguishes recordings from other MCAP files.
pub(super) const FORMAT_VERSION_KEY: &str = "format_version";

/// Name of the metadata record of [`RunDescription`].
pub(super) const RUN_METADATA: &str = "run";
/// Name of the metadata record of [`Closing`].
pub const CLOSING_METADATA: &str = "recorder";
/// Name of the metadata record with the losses of a repair.
pub(super) const REPAIR_METADATA: &str = "repair";
/// Name of the attachment with the scene.
pub const SCENE_ATTACHMENT: &str = "scene.toml";
/// Media type of the attachment with the scene.
pub(super) const SCENE_MEDIA_TYPE: &str = "application/toml";

const NS_PER_S: u128 = 1_000_000_000;

/// Returns the start of the library in the header of a file. The name of the mcap crate follows.
pub(super) fn header_library(recorder_version: &str) -> String {
    format!("recorder/{recorder_version} ")
}

/// The recorded run: metadata `run`, at the start of the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RunDescription {
    /// Random id of the run, chosen by the node.
    pub run_id: u64,
    /// Wall clock of step 0, in nanoseconds since 1970. 0 in a simulated recording.
    pub epoch_ns: u64,
    /// Name of the scene.
    pub scene_name: String,
    /// Origin that positions are relative to, in m.
    pub origin: [f64; 3],
    /// Axis of the scene that points up.
    pub up: Up,
    /// Steps per second, 1..=100000.
    pub rate_hz: u32,
    /// 0: xpbd, 1: pbd.
    pub method: u32,
    /// Number of particles in the scene.
    pub particle_count: u32,
    /// Number of constraints in the scene.
    pub constraint_count: u32,
    /// Number of bends in the scene.
    pub bend_count: u32,
    /// Version of the solver's arithmetic.
    pub solver_version: u32,
    /// Version of the node's messages (the contract).
    pub contract_version: u32,
    /// Version of the program that wrote the file.
    pub recorder_version: String,
}

impl RunDescription {
    /// Returns the wall clock of a step, in nanoseconds: epoch + step / rate, rounded down.
    pub fn time_of_step_ns(&self, step: u64) -> u64 {
        self.epoch_ns.saturating_add(Self::duration_ns(step, self.rate_hz))
    }

    /// Returns the simulated time of a number of steps, in nanoseconds, rounded down. A rate of 0,
    /// which no valid run has, counts as 1.
    pub fn duration_ns(step_count: u64, rate_hz: u32) -> u64 {
        let duration_ns = u128::from(step_count) * NS_PER_S / u128::from(rate_hz.max(1));
        u64::try_from(duration_ns).unwrap_or(u64::MAX)
    }

    /// Returns the step at a time. The inverse of [`RunDescription::time_of_step_ns`]; `None` for
    /// times between steps.
    pub fn step_at(&self, time_ns: u64) -> Option<u64> {
        let since_epoch = u128::from(time_ns.checked_sub(self.epoch_ns)?);
        let step = (since_epoch * u128::from(self.rate_hz)).div_ceil(NS_PER_S);
        let step = u64::try_from(step).ok()?;
        (self.time_of_step_ns(step) == time_ns).then_some(step)
    }

    /// Returns the header with which the load of this run is published.
    pub fn load_header(&self, topology: &TopologyRow) -> LoadHeader {
        LoadHeader {
            run_id: self.run_id,
            step: topology.step,
            origin: self.origin,
            topology_revision: topology.revision,
            particle_count: self.particle_count,
            rate_hz: self.rate_hz,
            method: self.method,
            ..LoadHeader::default()
        }
    }

    /// Returns the header of a snapshot of this run, as far as its row tells.
    pub fn snapshot_header(&self, row: &StepRow) -> SnapshotHeader {
        SnapshotHeader {
            contract_version: self.contract_version,
            solver_version: self.solver_version,
            run_id: self.run_id,
            step: row.step,
            scene_step: row.scene_step,
            sim_time_ns: Self::duration_ns(row.step, self.rate_hz),
            state_hash: row.state_hash,
            outcome_count: row.outcome_count,
            wake_late_ns: row.wake_late_ns,
            solve_ns: row.solve_ns,
            topology_revision: row.topology_revision,
            torn_count: row.torn_count,
            particle_count: self.particle_count,
            snapshot_index: row.snapshot_index,
            ..SnapshotHeader::default()
        }
    }

    pub(super) fn to_map(&self) -> BTreeMap<String, String> {
        let [x, y, z] = self.origin;
        BTreeMap::from(
            [
                (FORMAT_VERSION_KEY, FORMAT_VERSION.to_string()),
                ("run_id", format!("{:016x}", self.run_id)),
                ("epoch_ns", self.epoch_ns.to_string()),
                ("scene", self.scene_name.clone()),
                ("origin", format!("{x} {y} {z}")),
                ("up", self.up.name().to_owned()),
                ("rate_hz", self.rate_hz.to_string()),
                ("method", self.method_name().to_owned()),
                ("particle_count", self.particle_count.to_string()),
                ("constraint_count", self.constraint_count.to_string()),
                ("bend_count", self.bend_count.to_string()),
                ("solver_version", self.solver_version.to_string()),
                ("contract_version", self.contract_version.to_string()),
                ("recorder_version", self.recorder_version.clone()),
            ]
            .map(|(key, value)| (key.to_owned(), value)),
        )
    }

    /// Returns "xpbd" or "pbd".
    pub fn method_name(&self) -> &'static str {
        if self.method == 0 { "xpbd" } else { "pbd" }
    }

    /// Parses the output of [`RunDescription::to_map`]. `Err` names the invalid key.
    pub(super) fn from_map(map: &BTreeMap<String, String>) -> Result<Self, String> {
        let rate_hz = parsed(map, "rate_hz")?;
        if !(1..=100_000).contains(&rate_hz) {
            return Err("rate_hz".to_owned());
        }
        let run_id = u64::from_str_radix(text(map, "run_id")?, 16);
        Ok(Self {
            run_id: run_id.map_err(|_| "run_id".to_owned())?,
            epoch_ns: parsed(map, "epoch_ns")?,
            scene_name: text(map, "scene")?.to_owned(),
            origin: origin(text(map, "origin")?).ok_or_else(|| "origin".to_owned())?,
            up: Up::from_name(text(map, "up")?).ok_or_else(|| "up".to_owned())?,
            rate_hz,
            method: u32::from(text(map, "method")? != "xpbd"),
            particle_count: element_count(map, "particle_count")?,
            constraint_count: element_count(map, "constraint_count")?,
            bend_count: element_count(map, "bend_count")?,
            solver_version: parsed(map, "solver_version")?,
            contract_version: parsed(map, "contract_version")?,
            recorder_version: text(map, "recorder_version")?.to_owned(),
        })
    }
}

/// The end of a recording: metadata `recorder`, at the end of the file.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Closing {
    /// Reason why the recorder stopped, in a few words.
    pub stop_reason: String,
    /// Message counts of each topic.
    pub counts: AllCounts,
    /// Messages on any topic that reached the recorder but could not be read. A snapshot or an outcome
    /// among them also counts as a gap of its topic.
    pub unreadable: u64,
}

/// Key of [`Closing::unreadable`].
const UNREADABLE: &str = "unreadable";

impl Closing {
    /// Returns the entries of the metadata [`CLOSING_METADATA`].
    pub fn to_map(&self) -> BTreeMap<String, String> {
        let mut map = BTreeMap::from([
            ("stop_reason".to_owned(), self.stop_reason.clone()),
            (UNREADABLE.to_owned(), self.unreadable.to_string()),
        ]);
        for (topic, counts) in self.counts.iter() {
            if topic == Topic::Forces && *counts == TopicCounts::default() {
                // Most recordings have none.
                continue;
            }
            let mut put = |field, count: u64| map.insert(key(topic, field), count.to_string());
            put("received", counts.received);
            put("written", counts.written);
            put("lost", counts.lost);
            put("gaps", counts.gaps);
            if counts.left_out > 0 {
                put("left_out", counts.left_out);
            }
        }
        map
    }

    /// Returns the number of messages that should be in the file and are not, by topic, for topics
    /// with such messages. The key "unreadable" stands for messages on any topic.
    pub fn missing(&self) -> BTreeMap<&'static str, u64> {
        let topics = self.counts.iter();
        let topics = topics.map(|(topic, c)| (topic.name(), c.lost.saturating_add(c.gaps)));
        let all = topics.chain([(UNREADABLE, self.unreadable)]);
        all.filter(|(_, count)| *count > 0).collect()
    }

    /// Parses the output of [`Closing::to_map`]. Missing counts are 0.
    pub(super) fn from_map(map: &BTreeMap<String, String>) -> Self {
        let mut closing = Self {
            stop_reason: map.get("stop_reason").cloned().unwrap_or_default(),
            counts: AllCounts::default(),
            unreadable: parsed(map, UNREADABLE).unwrap_or(0),
        };
        for topic in Topic::ALL {
            let count = |field| parsed(map, &key(topic, field)).unwrap_or(0);
            let counts = &mut closing.counts[topic];
            counts.received = count("received");
            counts.written = count("written");
            counts.lost = count("lost");
            counts.gaps = count("gaps");
            counts.left_out = count("left_out");
        }
        closing
    }
}

/// Returns a key such as "particles.lost".
fn key(topic: Topic, field: &str) -> String {
    format!("{}.{field}", topic.name().trim_start_matches('/'))
}

fn text<'a>(map: &'a BTreeMap<String, String>, key: &str) -> Result<&'a str, String> {
    map.get(key).map(String::as_str).ok_or_else(|| key.to_owned())
}

fn parsed<T: FromStr<Err: Display>>(
    map: &BTreeMap<String, String>,
    key: &str,
) -> Result<T, String> {
    text(map, key)?.parse().map_err(|_| key.to_owned())
}

/// Returns a number of particles or constraints. It decides how much memory a reader may use.
fn element_count(map: &BTreeMap<String, String>, key: &str) -> Result<u32, String> {
    let count = parsed(map, key)?;
    if count > ELEMENTS_MAX { Err(key.to_owned()) } else { Ok(count) }
}

fn origin(text: &str) -> Option<[f64; 3]> {
    let numbers: Vec<f64> = text.split(' ').map(str::parse).collect::<Result<_, _>>().ok()?;
    let origin: [f64; 3] = numbers.try_into().ok()?;
    origin.iter().all(|number| number.is_finite()).then_some(origin)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn description() -> RunDescription {
        RunDescription {
            run_id: 0x89ab_cdef_0123_4567,
            epoch_ns: 1_700_000_000_123_456_789,
            scene_name: "curtain".to_owned(),
            origin: [0.1, -2.5e9, 1.0e-300],
            up: Up::MinusY,
            rate_hz: 240,
            method: 1,
            particle_count: 3,
            constraint_count: 2,
            bend_count: 6,
            solver_version: 7,
            contract_version: 8,
            recorder_version: "0.1.0".to_owned(),
        }
    }

    #[test]
    fn a_description_survives_a_round_trip_through_its_map() {
        assert_eq!(RunDescription::from_map(&description().to_map()), Ok(description()));
    }

    #[test]
    fn the_error_names_a_missing_or_invalid_key() {
        let mut map = description().to_map();
        map.insert("rate_hz".to_owned(), "0".to_owned());
        assert_eq!(RunDescription::from_map(&map), Err("rate_hz".to_owned()));
        map.remove("origin");
        map.insert("rate_hz".to_owned(), "240".to_owned());
        assert_eq!(RunDescription::from_map(&map), Err("origin".to_owned()));
    }

    #[test]
    fn the_time_of_a_step_maps_back_to_the_step() {
        for rate_hz in [1, 3, 60, 240, 997, 99_999, 100_000] {
            let run = RunDescription { rate_hz, ..description() };
            for step in (0..2000).chain([1 << 31, (1 << 32) + 7]) {
                assert_eq!(run.step_at(run.time_of_step_ns(step)), Some(step), "{rate_hz} Hz");
            }
            assert_eq!(run.step_at(run.epoch_ns - 1), None);
            assert_eq!(run.step_at(run.time_of_step_ns(1) + 1), None);
        }
    }

    #[test]
    fn a_closing_survives_a_round_trip_through_its_map() {
        let stop_reason = "owner gone".to_owned();
        let mut closing = Closing { stop_reason, unreadable: 6, ..Closing::default() };
        closing.counts[Topic::Particles].lost = 4;
        closing.counts[Topic::Outcomes].gaps = 5;
        assert_eq!(Closing::from_map(&closing.to_map()), closing);
        let missing = [("/particles", 4), ("/outcomes", 5), ("unreadable", 6)];
        assert_eq!(closing.missing(), missing.into());
    }
}
