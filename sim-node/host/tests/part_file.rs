//! A file gets its name only when it is finished, and nothing is replaced without permission.
#![allow(clippy::unwrap_used, reason = "an error fails the test, also in helpers")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use sim_host::{Existing, PartFile, PartFileError};

/// The directory of a test, which is removed at its end.
struct Directory(PathBuf);

impl Directory {
    fn new(test: &str) -> Self {
        let path = std::env::temp_dir().join(format!("part-file-{}-{test}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn write(path: &Path, existing: Existing, text: &str) -> Result<PartFile, PartFileError> {
    let mut file = PartFile::create(path, existing)?;
    file.write_all(text.as_bytes()).unwrap();
    Ok(file)
}

#[test]
fn a_file_gets_its_name_when_it_is_finished() {
    let directory = Directory::new("name");
    let path = directory.file("a.mcap");
    let file = write(&path, Existing::Refuse, "one").unwrap();
    assert!(!path.exists());
    assert_eq!(file.part_path(), directory.file("a.mcap.part"));
    assert_eq!(file.finish().unwrap(), path);
    assert_eq!(fs::read_to_string(&path).unwrap(), "one");
    assert!(!directory.file("a.mcap.part").exists());
}

#[test]
fn an_existing_file_is_refused_and_unchanged() {
    let directory = Directory::new("refuse");
    let path = directory.file("a.mcap");
    fs::write(&path, "old").unwrap();
    let error = write(&path, Existing::Refuse, "new").unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("{} exists (use --overwrite to replace it)", path.display())
    );
    assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    assert!(!directory.file("a.mcap.part").exists());
}

#[test]
fn the_part_file_of_a_killed_recorder_is_refused_and_unchanged() {
    let directory = Directory::new("killed");
    let path = directory.file("a.mcap");
    drop(write(&path, Existing::Refuse, "half").unwrap());
    let error = write(&path, Existing::Refuse, "new").unwrap_err();
    assert!(matches!(error, PartFileError::PartExists(_)), "{error}");
    assert!(error.to_string().contains("was killed (use --overwrite to replace it)"), "{error}");
    assert_eq!(fs::read_to_string(directory.file("a.mcap.part")).unwrap(), "half");
}

#[test]
fn both_files_are_replaced_with_overwrite() {
    let directory = Directory::new("overwrite");
    let path = directory.file("a.mcap");
    fs::write(&path, "old").unwrap();
    fs::write(directory.file("a.mcap.part"), "half of something long").unwrap();
    write(&path, Existing::Overwrite, "new").unwrap().finish().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
}

#[test]
fn a_directory_and_a_named_pipe_are_never_replaced() {
    let directory = Directory::new("kinds");
    fs::create_dir(directory.file("folder")).unwrap();
    make_pipe(&directory.file("pipe"));
    make_pipe(&directory.file("a.mcap.part"));
    std::os::unix::fs::symlink(directory.file("pipe"), directory.file("link")).unwrap();
    for (target, named, kind) in [
        ("folder", "folder", "directory"),
        ("pipe", "pipe", "named pipe (FIFO)"),
        ("link", "link", "named pipe (FIFO)"),
        ("a.mcap", "a.mcap.part", "named pipe (FIFO)"),
    ] {
        for existing in [Existing::Refuse, Existing::Overwrite] {
            let error = PartFile::create(&directory.file(target), existing).unwrap_err();
            let path = directory.file(named);
            let expected = format!("{} is a {kind}; name a file", path.display());
            assert_eq!(error.to_string(), expected);
        }
    }
    assert_eq!(fs::read_dir(&directory.0).unwrap().count(), 4, "nothing was added");
}

fn make_pipe(path: &Path) {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
}

#[test]
fn a_link_to_a_file_is_overwritten_like_a_file() {
    let directory = Directory::new("link");
    fs::write(directory.file("old"), "old").unwrap();
    let link = directory.file("link.mcap");
    std::os::unix::fs::symlink(directory.file("old"), &link).unwrap();
    assert!(matches!(write(&link, Existing::Refuse, "x"), Err(PartFileError::Exists(_))));
    write(&link, Existing::Overwrite, "new").unwrap().finish().unwrap();
    assert_eq!(fs::read_to_string(&link).unwrap(), "new");
}

#[test]
fn a_file_that_appears_in_the_meantime_is_not_replaced() {
    let directory = Directory::new("meanwhile");
    let path = directory.file("a.mcap");
    let file = write(&path, Existing::Refuse, "new").unwrap();
    fs::write(&path, "other").unwrap();
    let error = file.finish().unwrap_err();
    assert!(error.leaves_complete_file());
    assert_eq!(
        error.to_string(),
        format!(
            "{path} exists (use --overwrite to replace it); the complete file is {path}.part",
            path = path.display()
        )
    );
    assert_eq!(fs::read_to_string(&path).unwrap(), "other");
    assert_eq!(fs::read_to_string(directory.file("a.mcap.part")).unwrap(), "new");
}

#[test]
fn a_discarded_file_leaves_nothing() {
    let directory = Directory::new("discard");
    let path = directory.file("a.mcap");
    write(&path, Existing::Refuse, "new").unwrap().discard().unwrap();
    assert_eq!(fs::read_dir(&directory.0).unwrap().count(), 0);
}

#[test]
fn the_error_names_a_missing_directory() {
    let directory = Directory::new("missing");
    let error = write(&directory.file("no/a.mcap"), Existing::Refuse, "x").unwrap_err();
    assert!(error.to_string().contains("no/a.mcap.part: No such file"), "{error}");
}

#[test]
fn a_file_that_another_program_writes_is_refused_even_with_overwrite() {
    let directory = Directory::new("locked");
    let path = directory.file("a.mcap");
    let mut first = write(&path, Existing::Overwrite, "one, ").unwrap();
    first.flush().unwrap();
    for existing in [Existing::Refuse, Existing::Overwrite] {
        let error = write(&path, existing, "other").unwrap_err();
        let part = directory.file("a.mcap.part");
        assert_eq!(
            error.to_string(),
            format!(
                "{} is being written by process {}: wait for its end, or name another file",
                part.display(),
                std::process::id()
            )
        );
        assert_eq!(fs::read_to_string(part).unwrap(), "one, ");
    }
    first.write_all(b"two").unwrap();
    first.finish().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "one, two");
    write(&path, Existing::Overwrite, "three").unwrap().finish().unwrap();
}

#[test]
fn the_unfinished_file_of_another_program_is_no_target() {
    let directory = Directory::new("target");
    let (path, part) = (directory.file("a.mcap"), directory.file("a.mcap.part"));
    let mut first = write(&path, Existing::Refuse, "one").unwrap();
    first.flush().unwrap();
    for existing in [Existing::Refuse, Existing::Overwrite] {
        let error = write(&part, existing, "other").unwrap_err().to_string();
        // The list of locks, in which it finds the process, may lack any lock while others change.
        let expected = format!("{} is being written by ", part.display());
        assert!(error.starts_with(&expected), "{error}");
    }
    assert_eq!(fs::read_to_string(&part).unwrap(), "one");
    first.finish().unwrap();
    // The other way round: it becomes one while a file of its name is written.
    let second = write(&part, Existing::Overwrite, "two").unwrap();
    let third = write(&path, Existing::Overwrite, "three").unwrap();
    let error = second.finish().unwrap_err().to_string();
    assert!(error.contains("is being written by "), "{error}");
    third.finish().unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "three");
}

#[test]
fn a_file_that_was_replaced_while_it_was_written_is_not_finished() {
    let directory = Directory::new("replaced");
    let (path, part) = (directory.file("a.mcap"), directory.file("a.mcap.part"));
    for other in [Some("other"), None] {
        let file = write(&path, Existing::Overwrite, "mine").unwrap();
        fs::remove_file(&part).unwrap();
        if let Some(text) = other {
            fs::write(&part, text).unwrap();
        }
        let error = file.finish().unwrap_err();
        assert!(!error.leaves_complete_file());
        let error = error.to_string();
        assert!(error.ends_with("another program has moved, replaced or removed it"), "{error}");
        assert!(!path.exists());
    }
}

#[test]
fn the_old_file_is_replaced_as_a_whole() {
    let directory = Directory::new("whole");
    let (path, old) = (directory.file("a.toml"), directory.file("old.toml"));
    fs::write(&path, "old").unwrap();
    // A second name of the old file: writing into the file would change its contents too.
    fs::hard_link(&path, &old).unwrap();
    PartFile::write_whole(&path, Existing::Overwrite, b"new").unwrap();
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(fs::read_to_string(&old).unwrap(), "old");
    assert_eq!(fs::read_dir(&directory.0).unwrap().count(), 2);
}
