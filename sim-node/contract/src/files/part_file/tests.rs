//! Calls of the operating system, in order, and their errors.

use std::cell::RefCell;
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
    fn sync_data(&self) -> io::Result<()> {
        self.note("sync data")
    }

    fn sync_all(&self) -> io::Result<()> {
        self.note("sync all")
    }

    fn sync_folder_of(&self, _path: &Path) -> io::Result<()> {
        self.note(if self.path.exists() { "sync new name" } else { "sync part name" })
    }
}

/// Writes, flushes, writes and finishes a file. Returns the calls and the result.
fn calls(
    syncs_on_flush: bool,
    failing: Option<&'static str>,
) -> (Vec<&'static str>, Result<PathBuf, PartFileError>) {
    let folder = std::env::temp_dir().join(format!("synced-{}", getrandom::u64().unwrap()));
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join("a.mcap");
    File::create_new(part_path(&path)).unwrap();
    let calls = Rc::default();
    let file = NotedFile { calls: Rc::clone(&calls), failing, path: path.clone() };
    let mut file = PartFile::begin(file, &path, Existing::Refuse);
    if syncs_on_flush {
        file = file.with_sync_on_flush();
    }
    let mut write_and_flush = |text: &[u8]| file.write_all(text).and_then(|()| file.flush());
    let written = write_and_flush(b"one").and_then(|()| write_and_flush(b"two"));
    let result = written.map_err(|cause| io_error(&path, cause)).and_then(|()| {
        file.write_all(b"three").map_err(|cause| io_error(&path, cause))?;
        file.finish()
    });
    fs::remove_dir_all(&folder).unwrap();
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
