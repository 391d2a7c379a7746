//! A ring of files whose older ones another program moves or blocks.

use clap::Parser;
use recording::{AllCounts, RunDescription};

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
        scene_name: "points".to_owned(),
        rate_hz: 240,
        particle_count: 1,
        ..RunDescription::default()
    };
    RunHeader { run, scene: b"version = 1".to_vec(), colliders: Arc::default(), rows: Vec::new() }
}

/// A recording that keeps two files and has written two, `run_0000.mcap` and `run_0001.mcap`.
fn full_ring(folder: &Folder) -> Writer {
    let mut files = ring(FileNames::numbered(folder.0.join("run.mcap")), Vec::new());
    write_files(&mut files, 2);
    files
}

fn write_files(files: &mut Writer, count: usize) {
    for _ in 0..count {
        files.begin(&header(), 0).unwrap();
        files.finish(closing()).unwrap();
    }
}

/// A recording that keeps two files.
fn ring(names: FileNames, earlier: Vec<PathBuf>) -> Writer {
    let options = WriteOptions {
        file: Options::parse_from(["record"]).file,
        names,
        extras: Extras::default(),
        selection: ContentSelection::default(),
        ring: Ring { files_max: Some(2), free_min_bytes: None },
        earlier,
        is_synced: false,
        flush_interval: Duration::from_secs(1),
        black_box: None,
    };
    Writer::new(options, Arc::default(), None)
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
fn a_ring_goes_on_over_restarts_and_removes_the_files_of_earlier_recordings_first() {
    let folder = Folder::new("restarted");
    drop(full_ring(&folder));
    fs::rename(folder.0.join("run_0001.mcap"), folder.0.join("run_9999.mcap")).unwrap();
    let of_killed_recorder = folder.0.join("run_10000.mcap.part");
    fs::copy(folder.0.join("run_0000.mcap"), of_killed_recorder).unwrap();
    fs::write(folder.0.join("other_0000.mcap"), "of another recording").unwrap();
    let names = FileNames::numbered(folder.0.join("run.mcap"));
    let (names, earlier) = names.after_ring().unwrap();
    let mut files = ring(names, earlier);
    write_files(&mut files, 1);
    assert_eq!(names_in(&folder), ["other_0000.mcap", "run_10000.mcap.part", "run_10001.mcap"]);
    assert_eq!(files.written.removed_count, 2);
    write_files(&mut files, 1);
    assert_eq!(names_in(&folder), ["other_0000.mcap", "run_10001.mcap", "run_10002.mcap"]);
}

#[test]
fn a_ring_keeps_files_of_other_programs_that_have_its_names() {
    let folder = Folder::new("others");
    drop(full_ring(&folder));
    fs::write(folder.0.join("run_0002.mcap"), "not a recording").unwrap();
    fs::rename(folder.0.join("run_0000.mcap"), folder.0.join("run_00003.mcap")).unwrap();
    let names = FileNames::numbered(folder.0.join("run.mcap"));
    let (names, earlier) = names.after_ring().unwrap();
    assert_eq!(earlier, [folder.0.join("run_0001.mcap")]);
    write_files(&mut ring(names, earlier), 2);
    let expected = ["run_00003.mcap", "run_0002.mcap", "run_0003.mcap", "run_0004.mcap"];
    assert_eq!(names_in(&folder), expected);
}

#[test]
fn a_series_whose_numbers_are_far_apart_is_refused() {
    let folder = Folder::new("apart");
    drop(full_ring(&folder));
    let after = |number: u64| {
        let path = folder.0.join(format!("run_{number}.mcap"));
        fs::copy(folder.0.join("run_0001.mcap"), &path).unwrap();
        let result = FileNames::numbered(folder.0.join("run.mcap")).after_ring();
        fs::remove_file(path).unwrap();
        result.map(|(names, _)| names.path(0))
    };
    let error = after(20_240_101).unwrap_err().to_string();
    assert!(error.contains("run_20240101.mcap: its number is too far from 1"), "{error}");
    // A number this large belongs to a file of another program.
    assert_eq!(after(4_000_000_000).unwrap(), folder.0.join("run_0002.mcap"));
}

#[test]
fn a_ring_that_another_recorder_writes_is_refused() {
    let folder = Folder::new("twice");
    let mut files = full_ring(&folder);
    files.begin(&header(), 0).unwrap();
    let again = FileNames::numbered(folder.0.join("run.mcap")).after_ring();
    let error = again.unwrap_err().to_string();
    assert!(error.contains("run_0002.mcap.part is being written by another recorder"), "{error}");
}

/// A folder cannot be removed as a file, even by root.
#[test]
fn a_ring_goes_on_beside_files_that_cannot_be_removed() {
    let folder = Folder::new("stuck");
    let mut files = full_ring(&folder);
    let replace_by_folder = |name: &str| {
        fs::remove_file(folder.0.join(name)).unwrap();
        fs::create_dir(folder.0.join(name)).unwrap();
    };
    replace_by_folder("run_0000.mcap");
    write_files(&mut files, 2);
    assert_eq!(names_in(&folder), ["run_0000.mcap", "run_0002.mcap", "run_0003.mcap"]);
    assert_eq!(files.written.removed_count, 1);
    // The next one is removed instead, at the same flush.
    files.options.ring = Ring { files_max: None, free_min_bytes: Some(u64::MAX) };
    replace_by_folder("run_0002.mcap");
    files.begin(&header(), 0).unwrap();
    assert_eq!(names_in(&folder), ["run_0000.mcap", "run_0002.mcap", "run_0004.mcap.part"]);
}

#[test]
fn a_single_file_ends_for_the_reserve_of_its_disk() {
    let folder = Folder::new("single");
    let mut files = ring(FileNames::Single(folder.0.join("run.mcap")), Vec::new());
    files.options.ring = Ring { files_max: None, free_min_bytes: Some(0) };
    files.begin(&header(), 0).unwrap();
    files.flush().unwrap();
    assert!(!files.position.ends_for_reserve());
    files.options.ring.free_min_bytes = Some(u64::MAX);
    files.flush().unwrap();
    assert!(files.position.ends_for_reserve());
    files.finish(closing()).unwrap();
    assert_eq!(names_in(&folder), ["run.mcap"]);
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
