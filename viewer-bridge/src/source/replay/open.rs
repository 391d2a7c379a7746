//! Opens a recording, or says why it cannot be shown and what to do.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use anyhow::{Context, anyhow, bail};
use recorder::{LogEnd, ReadError, Tape, TapeError};

use super::Replay;
use crate::scene::load::Load;
use crate::scene::summary::SceneSummary;

/// What to do with a file that is none of ours.
const GIVE_A_RECORDING: &str =
    "give a file that `recorder record` or `recorder simulate` has written";
/// What to do with a file of which nothing is left.
const RECORD_AGAIN: &str = "nothing of it can be shown; record again with `recorder record`";

/// Opens it. Errors do not name the file.
pub(super) fn open(path: &Path, tell: &mut dyn FnMut(&str)) -> anyhow::Result<Replay> {
    let metadata = fs::metadata(path).map_err(|error| match error.kind() {
        ErrorKind::NotFound => anyhow!("there is no such file; {GIVE_A_RECORDING}"),
        _ => anyhow!("cannot read it: {error}"),
    })?;
    if !metadata.is_file() {
        bail!("is not a file; {GIVE_A_RECORDING}");
    }
    if metadata.len() == 0 {
        bail!("is empty: its recorder ended before it had written anything; {RECORD_AGAIN}");
    }
    let mut on_walk = |byte: u64, size_bytes: u64| {
        let percent = 100 * byte / size_bytes.max(1);
        tell(&format!(
            "{} has no index (its recorder was killed, or still writes): finding its parts, \
             {percent} %",
            path.display()
        ));
    };
    let mut tape = Tape::open(path, &mut on_walk).map_err(with_cure)?;
    if *tape.log().end() != LogEnd::Complete {
        let (end, last) = (tape.log().end(), tape.last_step());
        tell(&format!("warning: {} is {end}; shown up to step {last}", path.display()));
    }
    let load = load_of(&tape)?;
    let first = tape.state_at(tape.first_step()).map_err(with_cure)?;
    let name = path.file_name().unwrap_or(path.as_os_str());
    Ok(Replay { tape, load, first, file: name.to_string_lossy().into_owned() })
}

/// The error with what to do about it.
fn with_cure(error: TapeError) -> anyhow::Error {
    let cure = match &error {
        TapeError::Read(ReadError::NotMcap | ReadError::Foreign { .. }) => GIVE_A_RECORDING,
        TapeError::Read(ReadError::Version { .. }) => "use the viewer-bridge of that version",
        TapeError::Read(ReadError::Io(_)) => "see that it can be read",
        TapeError::Read(_) | TapeError::NoSnapshot(_) | TapeError::NoLoad(_) => RECORD_AGAIN,
    };
    anyhow!("{:#}; {cure}", anyhow::Error::new(error))
}

fn load_of(tape: &Tape) -> anyhow::Result<Load> {
    let (run, topology, surface) = (tape.run(), tape.topology(), tape.surface());
    let header = run.load_header(topology);
    let mut summary = SceneSummary::read(&String::from_utf8_lossy(tape.log().scene()));
    if summary.name.is_empty() {
        summary.name.clone_from(&run.scene_name);
    }
    let constraints = topology.constraints();
    let constraints = constraints.with_context(|| wrong("/topology has unequal columns"))?;
    let triangles = surface.triangles();
    let triangles = triangles.with_context(|| wrong("/surface has half a triangle"))?;
    let load = Load { header, summary, constraints, triangles };
    load.checked(run.particle_count).map_err(|text| anyhow!(wrong(text)))
}

fn wrong(what: &str) -> String {
    format!("{what}; {RECORD_AGAIN}")
}
