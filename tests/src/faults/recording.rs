//! Checks of a recording: what it claims is true, and what it lacks is declared.

use std::path::Path;

use recording::{LogReader, Message, StepRow, Topic};
use serde_json::Value;

use crate::finished::Finished;

/// The statement of a recorder about its file, made by its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Claim {
    /// Everything that was published is in the file.
    Complete,
    /// The file has an end, which declares losses.
    Lossy,
    /// The recorder was killed, so the file has no end.
    Killed,
    /// There may be no file, and it may have no end.
    None,
}

/// A file that a recorder has left.
#[derive(Debug)]
pub(super) struct Recording {
    pub(super) path: String,
    has_final_name: bool,
    claim: Claim,
    /// The rows of `/steps`.
    pub(super) rows: Vec<StepRow>,
    /// Snapshots that found no place in the recorder's queue. The last of them may be newer than all in the
    /// file.
    dropped: u64,
}

impl Recording {
    /// Reads the file with a name, or the `.part` file.
    pub(super) fn find(file: &str, claim: Claim) -> Option<Self> {
        let part = format!("{file}.part");
        let (has_name, has_part) = (Path::new(file).exists(), Path::new(&part).exists());
        match claim {
            Claim::Complete | Claim::Lossy => assert!(has_name && !has_part, "{file}: {claim:?}"),
            Claim::Killed => assert!(!has_name, "{file}: complete after a kill"),
            Claim::None => assert!(!(has_name && has_part), "{file}: two files"),
        }
        let path = if has_name { file.to_owned() } else { part };
        if !has_name && !has_part {
            return None;
        }
        let mut recording =
            Self { path, has_final_name: has_name, claim, rows: Vec::new(), dropped: 0 };
        recording.read();
        Some(recording)
    }

    fn read(&mut self) {
        // A file in which nothing was recorded may be empty.
        let Ok(mut log) = LogReader::open(Path::new(&self.path)) else { return };
        while let Some(logged) = log.next_message().expect("a readable file") {
            if let Message::Step(row) = logged.message {
                self.rows.push(row);
            }
        }
        self.dropped = log.closing().map_or(0, |closing| closing.counts[Topic::Steps].lost);
        for pair in self.rows.windows(2) {
            assert!(pair[0].step < pair[1].step, "{}: {pair:?}", self.path);
        }
    }

    /// Returns true if the file has its final name, which it gets when it is complete.
    pub(super) fn is_finished(&self) -> bool {
        self.has_final_name
    }

    /// Returns true if snapshots are missing between those in the file.
    pub(super) fn has_losses(&self) -> bool {
        self.missing().is_some_and(|missing| missing > 0)
    }

    /// Number of snapshots that were published from the first to the last recorded one, without those in
    /// the file.
    fn missing(&self) -> Option<u64> {
        let (first, last) = (self.rows.first()?.snapshot_index, self.rows.last()?.snapshot_index);
        let published = u64::from(last.wrapping_sub(first)) + 1;
        Some(published - self.rows.len() as u64)
    }

    /// Compares the report of `info` with the file.
    pub(super) fn check_info(&self, finished: &Finished) {
        let path = &self.path;
        let Some(info) = parse(finished) else {
            let size_bytes = std::fs::metadata(path).map_or(0, |file| file.len());
            let is_explained = finished.stderr.contains("killed before it has recorded a second");
            assert!(size_bytes == 0 && is_explained, "{path}: unreadable: {}", finished.stderr);
            return;
        };
        let lost = info["lost"].as_object().expect("an object");
        let is_complete = info["file_end"] == "complete";
        assert!(is_complete || !self.is_finished(), "{path}: {info}");
        assert!(!is_complete || self.claim != Claim::Killed, "{path}: {info}");
        assert_eq!(finished.code == Some(0), is_complete && lost.is_empty(), "{path}: {info}");
        match self.claim {
            Claim::Complete => assert!(lost.is_empty(), "{path}: {info}"),
            Claim::Lossy => assert!(!lost.is_empty(), "{path}: {info}"),
            Claim::Killed | Claim::None => {}
        }
        assert_eq!(info["messages"]["/steps"], self.rows.len(), "{path}: {info}");
        if let Some(missing) = self.missing() {
            let declared = lost.get("/steps").and_then(Value::as_u64).unwrap_or(0);
            let is_exact = declared >= missing && declared <= missing + self.dropped;
            assert!(is_exact, "{path}: {missing} snapshots are missing: {info}");
        }
    }

    /// Checks that the file re-simulates as far as it goes. Only missing outcomes end that.
    pub(super) fn check_verified(&self, info: &Finished, finished: &Finished) {
        let path = &self.path;
        let Some(verified) = parse(finished) else {
            assert!(self.rows.is_empty(), "{path}: {}", finished.stderr);
            return;
        };
        let info = parse(info).unwrap_or_default();
        match verified["verdict"].as_str() {
            Some("identical") => {
                let is_complete = info["file_end"] == "complete";
                assert_eq!(finished.code == Some(0), is_complete, "{path}: {verified}");
            }
            Some("outcome_log_incomplete") => {
                assert!(info["lost"]["/outcomes"].is_u64(), "{path}: {info} {verified}");
            }
            _ => panic!("{path}: {verified}"),
        }
    }
}

/// Returns the object that a program has printed; `None` if it has failed.
fn parse(finished: &Finished) -> Option<Value> {
    if finished.code == Some(1) {
        return None;
    }
    let parsed = serde_json::from_str(&finished.stdout);
    Some(parsed.unwrap_or_else(|error| panic!("{error} in {}", finished.stdout)))
}
