//! Calls of the operating system, in order, and their errors.

use std::cell::RefCell;
use std::os::unix::fs::MetadataExt;
use std::rc::Rc;

use super::*;

/// A file that notes the calls, and fails in a call if asked to.
#[derive(Debug)]
struct NotedFile {
    calls: Rc<RefCell<Vec<&'static str>>>,
    failing: Option<&'static str>,
    /// The finished file.
    path: PathBuf,
}

impl NotedFile {
    fn note(&self, call: &'static str) -> io::Result<()> {
        self.calls.borrow_mut().push(call);
        if self.failing == Some(call) { Err(Errno::IO.into()) } else { Ok(()) }
    }
}

impl Write for NotedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.note("write").map(|()| bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl DiskFile for NotedFile {
    fn allocate(&self, _position: u64, _size_bytes: u64) -> io::Result<()> {
        self.note("allocate")
    }

    fn free_unused(&self) -> io::Result<()> {
        self.note("free unused")
    }

    fn sync_data(&self) -> io::Result<()> {
        self.note("sync data")
    }

    fn sync_all(&self) -> io::Result<()> {
        self.note("sync all")
    }

    fn is_in_place(&self, path: &Path) -> bool {
        path.exists()
    }

    fn sync_folder_of(&self, _path: &Path) -> io::Result<()> {
        self.note(if self.path.exists() { "sync new name" } else { "sync part name" })
    }
}

/// A folder for a file of a test.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        let path = std::env::temp_dir().join(format!("synced-{}", getrandom::u64().unwrap()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Creates `a.mcap.part`, which notes its calls.
    fn create(&self, failing: Option<&'static str>) -> PartFile<NotedFile> {
        let path = self.0.join("a.mcap");
        File::create_new(part_path(&path)).unwrap();
        let file = NotedFile { calls: Rc::default(), failing, path: path.clone() };
        PartFile::begin(file, &path, Existing::Refuse)
    }

    fn names(&self) -> Vec<OsString> {
        fs::read_dir(&self.0).unwrap().map(|entry| entry.unwrap().file_name()).collect()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Writes, flushes, writes and finishes a file. Returns the calls and the result.
fn calls(
    syncs_on_flush: bool,
    failing: Option<&'static str>,
) -> (Vec<&'static str>, Result<PathBuf, PartFileError>) {
    let folder = Folder::new();
    let path = folder.0.join("a.mcap");
    let mut file = folder.create(failing);
    let calls = Rc::clone(&file.out.get_ref().calls);
    if syncs_on_flush {
        file = file.with_sync_on_flush();
    }
    let mut write_and_flush = |text: &[u8]| file.write_all(text).and_then(|()| file.flush());
    let written = write_and_flush(b"one").and_then(|()| write_and_flush(b"two"));
    let result = written.map_err(|cause| io_error(&path, cause)).and_then(|()| {
        file.write_all(b"three").map_err(|cause| io_error(&path, cause))?;
        file.finish()
    });
    (calls.take(), result)
}

#[test]
fn each_flush_and_the_end_and_both_names_are_synced() {
    let (calls_with_sync, result) = calls(true, None);
    result.unwrap();
    assert_eq!(
        calls_with_sync,
        [
            "write",
            "sync data",
            "sync part name",
            "write",
            "sync data",
            "write",
            "sync all",
            "sync new name"
        ]
    );
    let (calls_without, _) = calls(false, None);
    assert_eq!(calls_without, ["write", "write", "write", "sync all", "sync new name"]);
}

/// Writes 20 parts of 1 MiB and finishes the file. Returns the calls beside the writes.
fn calls_of_large_file(failing: Option<&'static str>) -> Vec<&'static str> {
    let folder = Folder::new();
    let mut file = folder.create(failing);
    let calls = Rc::clone(&file.out.get_ref().calls);
    for _ in 0..20 {
        file.write_all(&vec![1; 1 << 20]).unwrap();
    }
    let result = file.finish();
    assert_eq!(result.is_ok(), failing != Some("free unused"));
    let calls = calls.take();
    assert_eq!(calls.iter().filter(|call| **call == "write").count(), 20);
    calls.into_iter().filter(|call| *call != "write").collect()
}

#[test]
fn a_large_file_is_allocated_in_parts_and_what_is_left_is_freed_before_it_is_synced() {
    let whole = ["allocate", "allocate", "free unused", "sync all", "sync new name"];
    assert_eq!(calls_of_large_file(None), whole);
    // Not every file system can allocate, and a disk may be nearly full. A part may be allocated then.
    let without = ["allocate", "free unused", "sync all", "sync new name"];
    assert_eq!(calls_of_large_file(Some("allocate")), without);
    assert_eq!(calls_of_large_file(Some("free unused")), whole[..3]);
}

#[test]
fn a_file_has_no_space_beyond_its_end() {
    for is_finished in [true, false] {
        let folder = Folder::new();
        let path = folder.0.join("a.mcap");
        let mut file = PartFile::create(&path, Existing::Refuse).unwrap();
        for _ in 0..9 {
            file.write_all(&vec![1; 1 << 20]).unwrap();
        }
        let path = if is_finished {
            file.finish().unwrap()
        } else {
            drop(file);
            part_path(&path)
        };
        let metadata = fs::metadata(path).unwrap();
        let (size_bytes, used_bytes) = (metadata.len(), metadata.blocks() * 512);
        assert_eq!(size_bytes, 9 << 20);
        assert!(used_bytes < size_bytes + (1 << 20), "{used_bytes} bytes are allocated");
    }
}

#[test]
fn an_error_of_any_call_is_returned() {
    for call in ["sync part name", "write", "sync data", "sync all", "sync new name"] {
        let (calls, result) = calls(true, Some(call));
        assert!(result.unwrap_err().to_string().contains("Input/output error"), "{call}");
        // Dropping the file may write its buffer, but nothing is synced or renamed.
        let after = calls.iter().position(|noted| *noted == call).unwrap() + 1;
        assert!(calls[after..].iter().all(|later| *later == "write"), "{calls:?}");
    }
}

#[test]
fn the_error_states_whether_the_file_is_complete_and_its_name() {
    for (call, is_complete, name, text) in [
        ("sync all", false, "a.mcap.part", "a.mcap.part: Input/output error"),
        ("sync new name", true, "a.mcap", "a.mcap is complete, but its name may not survive"),
    ] {
        let folder = Folder::new();
        let error = folder.create(Some(call)).finish().unwrap_err();
        assert_eq!(
            (error.leaves_complete_file(), folder.names()),
            (is_complete, vec![name.into()])
        );
        assert!(error.to_string().contains(text), "{error}");
    }
}

#[test]
fn an_error_of_writing_a_whole_file_leaves_nothing_or_the_complete_file() {
    for call in ["write", "sync all"] {
        let folder = Folder::new();
        folder.create(Some(call)).finish_with(b"new").unwrap_err();
        assert_eq!(folder.names(), [""; 0], "{call}");
    }
    let folder = Folder::new();
    let file = folder.create(None);
    fs::write(folder.0.join("a.mcap"), "other").unwrap();
    assert!(matches!(file.finish_with(b"new"), Err(PartFileError::Exists(_))));
    assert_eq!(folder.names(), ["a.mcap"]);
    let folder = Folder::new();
    let error = folder.create(Some("sync new name")).finish_with(b"new").unwrap_err();
    assert!(error.leaves_complete_file());
    assert_eq!(folder.names(), ["a.mcap"]);
}

#[test]
fn a_link_to_nothing_is_refused_before_anything_is_written() {
    let folder = Folder::new();
    let path = folder.0.join("a.mcap");
    std::os::unix::fs::symlink("nothing", &path).unwrap();
    for error in [
        PartFile::create(&path, Existing::Refuse).unwrap_err(),
        PartFile::check(&path, Existing::Refuse).unwrap_err(),
    ] {
        assert!(matches!(error, PartFileError::Exists(_)), "{error}");
    }
    assert_eq!(folder.names(), ["a.mcap"]);
    PartFile::write_whole(&path, Existing::Overwrite, b"new").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
}
