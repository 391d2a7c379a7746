//! Opens a recording, or explains why it cannot be shown.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use recording::{LogEnd, ReadError, RecordedState, Tape, TapeError};
use sim_host::Stop;

use crate::scene::load::Load;
use crate::scene::summary::SceneSummary;

/// Remedy for a file that is not a recording.
const GIVE_A_RECORDING: &str = "give a file written by `recorder record` or `recorder simulate`";
/// Remedy for a file without a readable state.
const RECORD_AGAIN: &str = "it has nothing to show; record again with `recorder record`";

/// An open recording.
#[derive(Debug)]
pub(super) struct Recording {
    pub(super) tape: Tape,
    pub(super) load: Load,
    /// The state at the first step.
    pub(super) first: RecordedState,
    /// Name of the file without its folder, which clients need not know.
    pub(super) file: String,
}

impl Recording {
    /// Simulated time of a step in s.
    pub(super) fn time_s(&self, step: u64) -> f64 {
        step as f64 / f64::from(self.tape.run().rate_hz)
    }
}

/// Opens a recording. The errors do not name the file.
pub(super) fn open(
    path: &Path,
    stop: &Stop,
    note: &mut dyn FnMut(&str),
) -> anyhow::Result<Recording> {
    let metadata = fs::metadata(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => anyhow!("no such file; {GIVE_A_RECORDING}"),
        _ => anyhow!("cannot read it: {error}"),
    })?;
    if !metadata.is_file() {
        bail!("is not a file; {GIVE_A_RECORDING}");
    }
    if metadata.len() == 0 {
        bail!("is empty: its recorder ended before it wrote anything; {RECORD_AGAIN}");
    }
    let mut on_walk = |byte: u64, size_bytes: u64| {
        let percent = 100 * byte / size_bytes.max(1);
        note(&format!(
            "{} has no index (its recorder was killed, or is still writing); scanning, {percent} %",
            path.display()
        ));
    };
    let mut tape =
        Tape::open(path, Some(stop), &mut on_walk).map_err(|error| with_remedy(path, error))?;
    let shown_path = path.display().to_string();
    let incomplete = incomplete(&tape, &shown_path);
    if !incomplete.is_empty() {
        note(&format!("warning: {shown_path} is {incomplete}"));
    }
    let load = load_of(&tape)?;
    let first = tape.state_at(tape.first_step()).map_err(|error| with_remedy(path, error))?;
    Ok(Recording { tape, load, first, file: file_of(path) })
}

/// Returns the file of a path without its folder, which clients need not know.
pub(super) fn file_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Says where a file ends that lacks its end, and how to keep the rest of it. Empty if it is complete.
pub(super) fn incomplete(tape: &Tape, file: &str) -> String {
    match tape.log().end() {
        LogEnd::Complete => String::new(),
        end => format!(
            "{end}; shown up to step {}. `recorder repair {file} OUT.mcap` copies what is intact",
            tape.last_step()
        ),
    }
}

/// Adds the remedy to an error.
fn with_remedy(path: &Path, error: TapeError) -> anyhow::Error {
    let remedy = match &error {
        TapeError::NoLoad { is_damaged: true, .. }
        | TapeError::NoSnapshot(LogEnd::Truncated { .. } | LogEnd::Damaged { .. }) => {
            let path = path.display();
            return anyhow!("{error}; `recorder repair {path} OUT.mcap` copies what is intact");
        }
        TapeError::Read(ReadError::NotMcap | ReadError::Foreign { .. }) => GIVE_A_RECORDING,
        TapeError::Read(ReadError::Version { .. }) => "use a viewer-bridge of that version",
        TapeError::Read(ReadError::Io(_)) => "check that the file can be read",
        TapeError::Read(_) | TapeError::NoSnapshot(_) | TapeError::NoLoad { .. } => RECORD_AGAIN,
    };
    anyhow!("{:#}; {remedy}", anyhow::Error::new(error))
}

fn load_of(tape: &Tape) -> anyhow::Result<Load> {
    let (run, topology, surface) = (tape.run(), tape.topology(), tape.surface());
    let header = run.load_header(topology);
    let mut summary =
        SceneSummary::from_toml(&String::from_utf8_lossy(tape.log().scene())).unwrap_or_default();
    if summary.name.is_empty() {
        summary.name.clone_from(&run.scene_name);
    }
    let constraints = topology.constraints();
    let constraints =
        constraints.with_context(|| malformed("the columns of /topology differ in length"))?;
    let bends = topology
        .bends()
        .with_context(|| malformed("the columns of the bends in /topology differ in length"))?;
    let triangles = surface.triangles();
    let triangles = triangles.with_context(|| malformed("/surface ends within a triangle"))?;
    let load = Load { header, summary, constraints, bends, triangles };
    load.checked(run.particle_count).map_err(|error| anyhow!(malformed(&error.to_string())))
}

fn malformed(fault: &str) -> String {
    format!("{fault}; {RECORD_AGAIN}")
}
