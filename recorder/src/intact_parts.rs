//! A damaged recording as its repair would be: behind damage, readers see what a repair saves.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, PipeReader, Read};
use std::path::Path;
use std::sync::Arc;
use std::thread;

use sim_contract::{LoadHeader, Stop, Triangle};
use sim_solver::{Scene, Solver};

use crate::log::{
    LoadRows, LogReader, ReadError, RepairError, RepairReport, SCENE_ATTACHMENT, SharedFile,
    SurfaceRow, Topic, TopologyRow, bend_state, constraint_state, open_recording, repair_file,
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
        let source = SharedFile::new(Arc::clone(&file));
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

    /// Returns the bytes of the repaired recording. It declares what is missing.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn bytes(&self) -> io::Result<PipeReader> {
        let (reader, writer) = io::pipe()?;
        let source = SharedFile::new(Arc::clone(&self.file));
        let (load, stop) = (self.load.clone(), self.stop.clone());
        let repair = move || {
            let out = BufWriter::with_capacity(BUFFER_SIZE_BYTES, writer);
            // The reader sees that the bytes end, and may also need no more of them.
            let _repaired = repair_file(source, out, load, Some(&stop), &mut |_, _| {});
        };
        thread::Builder::new().name("repair".to_owned()).spawn(repair)?;
        Ok(reader)
    }

    /// Reads the repaired recording from its start.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn reader(&self) -> Result<LogReader<impl Read + Send + use<>>, ReadError> {
        LogReader::new(BufReader::with_capacity(BUFFER_SIZE_BYTES, self.bytes()?))
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
    let constraints: Vec<_> = solver.constraints().map(constraint_state).collect();
    let triangles: Vec<_> =
        solver.triangles().iter().map(|corners| Triangle { corners: *corners }).collect();
    let bends = solver.bends().filter(|_| lost.has_bends);
    let bends: Vec<_> = bends.map(bend_state).collect();
    let topology = TopologyRow::new(&header, &constraints, &bends);
    Some(LoadRows {
        topology: TopologyRow { torn: lost.torn.clone(), ..topology },
        surface: SurfaceRow::new(&header, &triangles),
    })
}
