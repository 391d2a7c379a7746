//! Reads a damaged recording as its repair would be, so that readers see what a repair saves behind the damage.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, PipeReader, Read};
use std::path::Path;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use sim_host::Stop;
use sim_messages::LoadHeader;
use sim_solver::{Scene, Solver};

use crate::log::{
    Cure, FileSource, Finding, LoadRows, LogReader, ReadError, RepairError, RepairReport,
    SCENE_ATTACHMENT, SurfaceRow, Topic, TopologyRow, open_recording, repair_file,
};

/// Bytes that a repair writes at a time.
const BUFFER_SIZE_BYTES: usize = 1 << 18;

/// The intact parts of a damaged or unfinished recording.
#[derive(Debug)]
pub struct IntactParts {
    file: Arc<File>,
    load: Option<LoadRows>,
    report: RepairReport,
    stop: Stop,
}

impl IntactParts {
    /// Reads the whole file for what is intact in it.
    ///
    /// # Errors
    /// If a repair is not possible, the operating system reports an error, or a signal has arrived.
    pub fn find(path: &Path, stop: &Stop) -> Result<Self, RepairError> {
        let file = Arc::new(open_recording(path)?);
        let source = FileSource::from(Arc::clone(&file));
        let report = repair_file(source, io::sink(), None, Some(stop), &mut |_, _| {})?;
        Ok(Self { file, load: load_rows(&report), report, stop: stop.clone() })
    }

    /// Returns the number of intact snapshots.
    pub fn snapshot_count(&self) -> u64 {
        self.report.counts[Topic::Steps].written
    }

    /// Returns the step of the last intact snapshot.
    pub fn last_step(&self) -> Option<u64> {
        self.report.steps.map(|[_, last]| last)
    }

    /// Returns what the recording has lost, and where, as lines for people.
    pub fn losses(&self) -> Vec<String> {
        let is_loss = |finding: &&Finding| finding.cure != Cure::Rewrite;
        let damage = self.report.findings.list().iter().filter(is_loss).map(ToString::to_string);
        let missing = self.report.losses.lines();
        damage.chain(missing.into_iter().map(|what| format!("missing: {what}"))).collect()
    }

    /// Returns the bytes of the repaired recording. It declares what is missing.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn bytes(&self) -> io::Result<RepairedBytes> {
        let (pipe, writer) = io::pipe()?;
        let source = FileSource::from(Arc::clone(&self.file));
        let (load, stop) = (self.load.clone(), self.stop.clone());
        let repair = move || {
            let out = BufWriter::with_capacity(BUFFER_SIZE_BYTES, writer);
            repair_file(source, out, load, Some(&stop), &mut |_, _| {}).map(drop)
        };
        let repair = thread::Builder::new().name("repair".to_owned()).spawn(repair)?;
        Ok(RepairedBytes { pipe, repair: Some(repair) })
    }

    /// Reads the repaired recording from its start.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn reader(&self) -> Result<LogReader<impl Read + Send + use<>>, ReadError> {
        LogReader::new(BufReader::with_capacity(BUFFER_SIZE_BYTES, self.bytes()?))
    }
}

/// The bytes of a repaired recording, which a thread repairs as they are read.
#[derive(Debug)]
pub struct RepairedBytes {
    pipe: PipeReader,
    repair: Option<JoinHandle<Result<(), RepairError>>>,
}

impl Read for RepairedBytes {
    /// At the end of the bytes, returns the error of the repair, if there is one.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.pipe.read(buffer)?;
        if count == 0
            && !buffer.is_empty()
            && let Some(repair) = self.repair.take()
        {
            let repaired = repair.join().map_err(|_| io::Error::other("the repair panicked"))?;
            repaired.map_err(|error| match error {
                RepairError::Read(error) => error.into(),
                error @ RepairError::Write(_) => io::Error::other(error),
            })?;
        }
        Ok(count)
    }
}

/// Returns the load that a repair could not copy, from the scene. `None` if the file has it, or if the
/// scene is not intact.
pub fn load_rows(report: &RepairReport) -> Option<LoadRows> {
    let lost = report.lost_load.as_ref()?;
    let text = std::str::from_utf8(report.scene.as_ref()?).ok()?;
    let scene = Scene::from_toml(text, SCENE_ATTACHMENT).ok()?;
    let solver = Solver::new(&scene);
    let header = LoadHeader {
        // The first load begins at step 0. Only its own row tells the step of a later one.
        step: if lost.revision == 0 { 0 } else { lost.step },
        topology_revision: lost.revision,
        method: scene.solver.method as u32,
        ..LoadHeader::default()
    };
    let mut topology = TopologyRow::of_solver(&header, &solver);
    topology.torn.clone_from(&lost.torn);
    Some(LoadRows { topology, surface: SurfaceRow::of_solver(&header, &solver) })
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::sync::atomic::{AtomicBool, Ordering};

    use sim_solver::builtin;

    use super::*;
    use crate::log::{Closing, LogOptions, LogWriter};
    use crate::simulation::{Job, States, simulate};

    /// Writes a recording into a file without a name.
    fn recording(name: &str) -> IntactParts {
        let scene = Scene::from_toml(builtin::text("drape").unwrap(), "drape").unwrap();
        let (job, solver) = (Job::new(scene.clone(), Vec::new(), 3), Solver::new(&scene));
        let (run, text) = (job.description(&solver), scene.to_toml());
        let options = LogOptions::default();
        let mut log = LogWriter::create(Vec::new(), options, &run, text.as_bytes(), 0).unwrap();
        let is_stopped = AtomicBool::new(false);
        simulate(&job, States::first(solver), Some(&mut log), &is_stopped, |_| {}).unwrap();
        let path = std::env::temp_dir().join(format!("intact-parts-{name}-{}", std::process::id()));
        fs::write(&path, log.finish(&Closing::default()).unwrap()).unwrap();
        let parts = IntactParts::find(&path, &Stop::install().unwrap());
        fs::remove_file(path).unwrap();
        parts.unwrap()
    }

    #[test]
    fn a_signal_ends_the_repaired_bytes_as_it_ends_every_read() {
        let parts = recording("signal");
        assert_eq!(parts.last_step(), Some(3));
        assert!(parts.bytes().unwrap().read_to_end(&mut Vec::new()).unwrap() > 0);
        parts.stop.flag().store(true, Ordering::Relaxed);
        let error = parts.bytes().unwrap().read_to_end(&mut Vec::new()).unwrap_err();
        assert!(matches!(ReadError::from(error), ReadError::Interrupted));
        assert!(matches!(parts.reader().map(drop), Err(ReadError::Interrupted)));
    }

    /// The operating system reads no bytes of a folder.
    #[test]
    fn an_error_of_the_disk_ends_the_repaired_bytes() {
        let folder = File::open(std::env::temp_dir()).unwrap();
        let parts = IntactParts { file: Arc::new(folder), ..recording("disk") };
        let error = parts.bytes().unwrap().read_to_end(&mut Vec::new()).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::IsADirectory);
    }
}
