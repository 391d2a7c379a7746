//! The files of a domain: those in its root, and those in shared memory.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::sandbox::Sandbox;
use crate::wait::Deadline;

/// The directory of shared memory.
const SHARED_MEMORY: &str = "/dev/shm";

/// Lists the files of a domain.
#[derive(Debug, Clone)]
pub(super) struct DomainFiles {
    root: PathBuf,
    /// Prefix of the files in shared memory.
    prefix: String,
}

impl DomainFiles {
    pub(super) fn new(sandbox: &Sandbox) -> Self {
        Self { root: sandbox.root(), prefix: format!("{}_", sandbox.domain()) }
    }

    /// Returns all files, and the folders in the root that belong to a node.
    pub(super) fn list(&self) -> BTreeSet<PathBuf> {
        let mut files = BTreeSet::new();
        add_files(&self.root, &mut files);
        let shared = fs::read_dir(SHARED_MEMORY).into_iter().flatten().flatten();
        files.extend(
            shared
                .filter(|entry| entry.file_name().to_string_lossy().starts_with(&self.prefix))
                .map(|entry| entry.path()),
        );
        files
    }

    /// Returns the files that a domain without programs should not have. iceoryx2 never removes its
    /// counter of nodes.
    pub(super) fn list_remains(&self) -> Vec<PathBuf> {
        let is_counter = |path: &PathBuf| {
            let name = path.to_string_lossy();
            name.contains("_node.") && name.ends_with(".global_mgmt")
        };
        self.list().into_iter().filter(|path| !is_counter(path)).collect()
    }

    /// Polls until `count` files have appeared or disappeared, or until `is_over`. Without a pause, because
    /// a program creates most of its files within a few milliseconds.
    pub(super) fn wait_for_changes(&self, count: u32, mut is_over: impl FnMut() -> bool) {
        let deadline = Deadline::start();
        let mut before = self.list();
        let mut changes = 0;
        while changes < count as usize && !is_over() {
            deadline.check("changes of the files of the domain");
            let now = self.list();
            changes += now.symmetric_difference(&before).count();
            before = now;
        }
    }

    /// Removes everything in the root, as a cleaner of `/tmp` does. Programs may remove some of it at the
    /// same time.
    pub(super) fn clean_root(&self) {
        for entry in fs::read_dir(&self.root).into_iter().flatten().flatten() {
            let _ = fs::remove_dir_all(entry.path()).or_else(|_| fs::remove_file(entry.path()));
        }
    }
}

/// Adds the files below a folder, and its empty folders except those of the domain itself.
fn add_files(folder: &Path, files: &mut BTreeSet<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if !path.is_dir() {
            files.insert(path);
            continue;
        }
        if !["nodes", "services"].map(Some).contains(&entry.file_name().to_str()) {
            files.insert(path.clone());
        }
        add_files(&path, files);
    }
}
