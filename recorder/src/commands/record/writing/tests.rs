//! A ring of files whose older ones another program moves or blocks.

use clap::Parser;
use recorder::{AllCounts, RunDescription, Up};

use super::*;

/// A folder of one test, which its end removes.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let name = format!("recorder-ring-{name}-{}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::create_dir(&path).unwrap();
        Self(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        fs::remove_dir_all(&self.0).unwrap();
    }
}

#[derive(Debug, Parser)]
struct Options {
    #[command(flatten)]
    file: FileArgs,
}

pub(super) fn header() -> RunHeader {
    let run = RunDescription {
        run_id: 7,
        epoch_ns: 0,
        scene_name: "points".to_owned(),
        origin: [0.0; 3],
        up: Up::Y,
        rate_hz: 240,
        method: 0,
        particle_count: 1,
        constraint_count: 0,
        bend_count: 0,
        solver_version: 1,
        contract_version: 1,
        recorder_version: "0".to_owned(),
    };
    RunHeader { run, scene: b"version = 1".to_vec(), colliders: Arc::default(), rows: Vec::new() }
}

/// A recording that keeps two files and has written two, `run_0000.mcap` and `run_0001.mcap`.
fn full_ring(folder: &Folder) -> Files {
    let options = WriteOptions {
        file: Options::parse_from(["record"]).file,
        names: FileNames::numbered(folder.0.join("run.mcap")),
        extras: Extras::default(),
        selection: ContentSelection::default(),
        ring: Ring { files_max: Some(2), free_min_bytes: None },
        is_synced: false,
        flush_interval: Duration::from_secs(1),
        black_box: None,
    };
    let mut files = Files {
        options,
        position: Arc::new(WritePosition::default()),
        created: None,
        open: None,
        next_number: 0,
        oldest_number: 0,
        written: Written::default(),
    };
    for _ in 0..2 {
        files.begin(&header(), 0).unwrap();
        files.finish(closing()).unwrap();
    }
    files
}

fn closing() -> Closing {
    Closing { stop_reason: "split".to_owned(), counts: AllCounts::default(), unreadable: 0 }
}

/// Returns the names of the files in a folder.
fn names_in(folder: &Folder) -> Vec<String> {
    let entries = fs::read_dir(&folder.0).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_ring_goes_on_when_another_program_has_moved_its_oldest_file() {
    let folder = Folder::new("moved");
    let mut files = full_ring(&folder);
    fs::remove_file(folder.0.join("run_0000.mcap")).unwrap();
    files.begin(&header(), 0).unwrap();
    files.finish(closing()).unwrap();
    assert_eq!(files.written.removed_count, 0);
    files.begin(&header(), 0).unwrap();
    files.finish(closing()).unwrap();
    assert_eq!(files.written.removed_count, 1);
    assert_eq!(names_in(&folder), ["run_0002.mcap", "run_0003.mcap"]);
}

#[test]
fn a_disk_without_its_reserve_loses_a_file_at_each_flush_but_the_one_in_progress() {
    let folder = Folder::new("reserve");
    let mut files = full_ring(&folder);
    files.options.ring = Ring { files_max: None, free_min_bytes: Some(0) };
    files.begin(&header(), 0).unwrap();
    assert_eq!(names_in(&folder).len(), 3);
    files.options.ring.free_min_bytes = Some(u64::MAX);
    files.flush().unwrap();
    assert_eq!(names_in(&folder), ["run_0001.mcap", "run_0002.mcap.part"]);
    files.flush().unwrap();
    files.flush().unwrap();
    assert_eq!(names_in(&folder), ["run_0002.mcap.part"]);
    assert_eq!(files.written.removed_count, 2);
    files.finish(closing()).unwrap();
    files.begin(&header(), 0).unwrap();
    assert_eq!(names_in(&folder), ["run_0003.mcap.part"]);
}

#[test]
fn a_ring_keeps_its_oldest_file_when_the_next_one_cannot_be_created() {
    let folder = Folder::new("blocked");
    let mut files = full_ring(&folder);
    fs::write(folder.0.join("run_0002.mcap"), "of another program").unwrap();
    let error = format!("{:#}", files.begin(&header(), 0).unwrap_err());
    assert!(error.contains("run_0002.mcap exists"), "{error}");
    let names = names_in(&folder);
    assert!(names.contains(&"run_0000.mcap".to_owned()), "{names:?}");
}
