//! The lock that decides who owns a name, and the names that have one. Its holder alone creates the services of the
//! name.

use std::collections::BTreeSet;
use std::fs::{self, DirEntry, File, OpenOptions, TryLockError};
use std::io::{self, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

use iceoryx2::prelude::Config;
use sim_host::{
    clock::{SECOND_NS, monotonic_ns, sleep_until},
    is_in_place, is_locked,
};

use crate::endpoint::Endpoint;
use crate::ports::domain::files::{SHARED_MEMORY, entries};
use crate::ports::domain::root;

/// The owner's lock, until it is dropped or its process ends in any way.
///
/// It consists of two locked files. The one in the root of the domain decides. The one in shared
/// memory keeps the name taken if a cleaner of `/tmp` removes the first.
#[derive(Debug)]
pub(crate) struct OwnerLock {
    root: LockFile,
    /// `None` if another user of the host has occupied its path.
    shared_memory: Option<LockFile>,
}

/// Reason why a lock could not be taken.
#[derive(Debug)]
pub(crate) enum LockError {
    /// A living process holds it: the process with this id, if the file tells.
    Held(Option<u32>),
    /// The system refused to open or lock a file.
    System { path: PathBuf, error: io::Error },
}

/// Where the lock of a name is.
#[derive(Debug, Clone)]
pub(crate) struct LockPlace {
    config: Config,
    name: String,
}

impl LockPlace {
    pub(crate) fn new(config: &Config, name: &str) -> Self {
        Self { config: config.clone(), name: name.to_owned() }
    }

    /// Same as [`OwnerLock::holder`].
    #[allow(clippy::option_option, reason = "as there")]
    pub(crate) fn holder(&self) -> Option<Option<u32>> {
        OwnerLock::holder(&self.config, &self.name)
    }
}

/// Ending of the names of both files.
const LOCK_SUFFIX: &str = ".owner";

/// Most attempts to lock a file that is removed between opening and locking, or that a client locks for
/// a moment to see whether an owner holds it.
const ATTEMPTS_MAX: usize = 1000;
/// Pause before the next attempt, for that client.
const PAUSE_NS: u64 = SECOND_NS / 1000;

impl OwnerLock {
    /// Takes the lock of a name. Does not wait for another holder, only for clients that look for one.
    /// The root must exist.
    pub(crate) fn take(config: &Config, name: &str) -> Result<Self, LockError> {
        let [root, shared_memory] = paths(config, name);
        let root = LockFile::take(&root)?;
        let shared_memory = match LockFile::take(&shared_memory) {
            Ok(file) => Some(file),
            Err(error @ LockError::Held(_)) => return Err(error),
            Err(LockError::System { .. }) => None,
        };
        Ok(Self { root, shared_memory })
    }

    /// Returns the living process that holds the lock of a name: its id, if the file tells. Creates no
    /// file.
    #[allow(clippy::option_option, reason = "the id of a holder may be unknown")]
    pub(crate) fn holder(config: &Config, name: &str) -> Option<Option<u32>> {
        paths(config, name).iter().find_map(|path| {
            let mut file = File::open(path).ok()?;
            is_locked(&file).then(|| read_id(&mut file))
        })
    }

    /// Returns the paths of the files of a lock.
    #[cfg(test)]
    pub(crate) fn paths(config: &Config, name: &str) -> [PathBuf; 2] {
        paths(config, name)
    }

    /// Returns the killed process that has left the lock of a name, which no other has taken: its id, if the
    /// file tells.
    #[allow(clippy::option_option, reason = "the id of a holder may be unknown")]
    pub(crate) fn killed_holder(config: &Config, name: &str) -> Option<Option<u32>> {
        paths(config, name).iter().find_map(|path| {
            let mut file = File::open(path).ok()?;
            (!is_locked(&file)).then(|| read_id(&mut file))
        })
    }

    /// Returns the files of the lock of a name that a killed owner has left, and no other has taken.
    pub(crate) fn left_files(config: &Config, name: &str) -> Vec<PathBuf> {
        let is_left = |path: &PathBuf| File::open(path).is_ok_and(|file| !is_locked(&file));
        paths(config, name).into_iter().filter(is_left).collect()
    }

    /// Returns `true` if a living process holds the file in shared memory, but none that in the root.
    pub(crate) fn is_hidden(config: &Config, name: &str) -> bool {
        let [root, memory] = paths(config, name);
        let is_held = |path| File::open(path).is_ok_and(|file| is_locked(&file));
        is_held(memory) && !is_held(root)
    }

    /// Returns the path of a file that is no longer the locked one.
    pub(crate) fn removed(&self) -> Option<&Path> {
        let files = [Some(&self.root), self.shared_memory.as_ref()];
        let removed = files.into_iter().flatten().find(|file| !file.is_in_place());
        removed.map(|file| file.path.as_path())
    }
}

/// Returns the paths of the files in the root and in shared memory.
fn paths(config: &Config, name: &str) -> [PathBuf; 2] {
    let prefix = &config.global.prefix;
    let user = rustix::process::geteuid().as_raw();
    [
        root::path(config).join(format!("{prefix}{name}{LOCK_SUFFIX}")),
        Path::new(SHARED_MEMORY).join(format!("{prefix}{user}_{name}{LOCK_SUFFIX}")),
    ]
}

/// A locked file with the id of its process.
#[derive(Debug)]
struct LockFile {
    path: PathBuf,
    file: File,
}

impl LockFile {
    fn take(path: &Path) -> Result<Self, LockError> {
        let system = |error| LockError::System { path: path.to_owned(), error };
        for _ in 0..ATTEMPTS_MAX {
            let mut file = open(path).map_err(system)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if is_locked(&file) => {
                    return Err(LockError::Held(read_id(&mut file)));
                }
                Err(TryLockError::WouldBlock) => {
                    drop(file);
                    sleep_until(monotonic_ns() + PAUSE_NS);
                    continue;
                }
                Err(TryLockError::Error(error)) => return Err(system(error)),
            }
            let mut taken = Self { path: path.to_owned(), file };
            // The holder before may have removed the file between opening and locking.
            if taken.is_in_place() {
                taken.write_id().map_err(system)?;
                return Ok(taken);
            }
        }
        Err(system(io::Error::other("other processes replace or lock the file all the time")))
    }

    fn write_id(&mut self) -> io::Result<()> {
        self.file.set_len(0)?;
        writeln!(self.file, "{}", std::process::id())
    }

    fn is_in_place(&self) -> bool {
        is_in_place(&self.file, &self.path)
    }
}

impl Drop for LockFile {
    /// Removes the file while it is still locked.
    fn drop(&mut self) {
        if self.is_in_place() {
            // A file that stays is taken over by the next owner.
            let _ = fs::remove_file(&self.path);
        }
    }
}

fn open(path: &Path) -> io::Result<File> {
    let no_links = rustix::fs::OFlags::NOFOLLOW.bits().cast_signed();
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    options.mode(0o600).custom_flags(no_links).open(path)
}

fn read_id(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.take(16).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}

/// Returns the names that have a lock file of this user, in order. [`OwnerLock::holder`]
/// tells whether a living process holds it.
pub(crate) fn names(config: &Config) -> BTreeSet<String> {
    let prefix = config.global.prefix.to_string();
    let mut names = names_in(&root::path(config), &prefix);
    // The lock of the name `x` in a domain whose own name ends in `_<user>` looks like one of the name
    // `<user>_x` in this domain. Such a name counts only with its file in the root.
    let marker = format!("{}_", user());
    names.extend(names_in_shared_memory(config).into_iter().filter(|name| !name.contains(&marker)));
    names
}

/// Returns the names whose lock has a file in shared memory, perhaps with some of another domain.
pub(crate) fn names_in_shared_memory(config: &Config) -> BTreeSet<String> {
    names_in(Path::new(SHARED_MEMORY), &format!("{}{}_", config.global.prefix, user()))
}

fn user() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Returns the names of the lock files `<prefix><name>.owner` in a folder that are files of this user.
/// Opening another user's pipe, or following a link, could block or mislead.
fn names_in(folder: &Path, prefix: &str) -> BTreeSet<String> {
    let name = |entry: DirEntry| {
        let file_name = entry.file_name();
        let name = file_name.to_str()?.strip_prefix(prefix)?.strip_suffix(LOCK_SUFFIX)?;
        let is_own = is_own_file(&entry.path()) && Endpoint::new(None, name).is_ok();
        is_own.then(|| name.to_owned())
    };
    entries(folder).filter_map(name).collect()
}

fn is_own_file(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|file| file.is_file() && file.uid() == user())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;

    use super::*;
    use crate::ports::domain;
    use crate::testing::TestDomain;

    fn config(domain: &TestDomain) -> Config {
        let config = domain::configuration(Some(domain.name())).unwrap();
        root::prepare(&root::path(&config)).unwrap();
        config
    }

    fn holder(result: Result<OwnerLock, LockError>) -> Option<u32> {
        match result {
            Err(LockError::Held(id)) => id,
            other => panic!("the lock is held, but take returned {other:?}"),
        }
    }

    #[test]
    fn a_name_has_one_holder_and_is_free_after_it() {
        let domain = TestDomain::new();
        let config = config(&domain);
        assert_eq!(OwnerLock::holder(&config, "sim"), None);
        let lock = OwnerLock::take(&config, "sim").unwrap();
        assert!(OwnerLock::holder(&config, "sim").is_some());
        assert_eq!(holder(OwnerLock::take(&config, "sim")), Some(std::process::id()));
        let _other_name = OwnerLock::take(&config, "other").unwrap();
        drop(lock);
        assert_eq!(OwnerLock::holder(&config, "sim"), None);
        OwnerLock::take(&config, "sim").unwrap();
    }

    #[test]
    fn a_name_stays_taken_although_a_cleaner_removed_the_file_in_the_root() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let lock = OwnerLock::take(&config, "sim").unwrap();
        assert_eq!(lock.removed(), None);
        assert!(!OwnerLock::is_hidden(&config, "sim"));
        fs::remove_file(&lock.root.path).unwrap();
        assert!(OwnerLock::is_hidden(&config, "sim"));
        assert_eq!(lock.removed(), Some(lock.root.path.as_path()));
        assert_eq!(holder(OwnerLock::take(&config, "sim")), Some(std::process::id()));
    }

    #[test]
    fn clients_that_look_for_an_owner_do_not_keep_one_from_its_name() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let is_over = AtomicBool::new(false);
        thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    OwnerLock::holder(&config, "sim");
                }
            });
            let taken = (0..2000).map(|_| OwnerLock::take(&config, "sim").is_ok());
            let taken_count = taken.filter(|is_taken| *is_taken).count();
            is_over.store(true, Ordering::Relaxed);
            assert_eq!(taken_count, 2000);
        });
    }

    #[test]
    fn a_file_left_by_a_killed_holder_is_taken_over() {
        let domain = TestDomain::new();
        let config = config(&domain);
        let path = root::path(&config).join(format!("{}sim.owner", config.global.prefix));
        assert!(OwnerLock::left_files(&config, "sim").is_empty());
        fs::write(&path, "4194304\n").unwrap();
        assert_eq!(OwnerLock::left_files(&config, "sim"), std::slice::from_ref(&path));
        let lock = OwnerLock::take(&config, "sim").unwrap();
        let id = std::process::id();
        assert_eq!(fs::read_to_string(&path).unwrap(), format!("{id}\n"));
        assert!(OwnerLock::left_files(&config, "sim").is_empty());
        drop(lock);
        assert!(!path.exists());
    }

    #[test]
    fn names_are_found_by_either_lock_file_and_foreign_files_are_ignored() {
        let domain = TestDomain::new();
        let config = domain::configuration(Some(domain.name())).unwrap();
        assert!(names(&config).is_empty());
        root::prepare(&root::path(&config)).unwrap();
        let locks = ["both", "memory", "root"].map(|name| OwnerLock::take(&config, name).unwrap());
        let user = user();
        let prefix = config.global.prefix.to_string();
        let root = root::path(&config);
        fs::remove_file(root.join(format!("{prefix}memory.owner"))).unwrap();
        fs::remove_file(format!("{SHARED_MEMORY}/{prefix}{user}_root.owner")).unwrap();
        symlink(root.join(format!("{prefix}both.owner")), root.join(format!("{prefix}link.owner")))
            .unwrap();
        File::create_new(root.join(format!("{prefix}a b.owner"))).unwrap();
        // The name `sim` in the domain `<domain>_<user>`.
        let other = format!("{SHARED_MEMORY}/{prefix}{user}_{user}_sim.owner");
        File::create_new(other).unwrap();
        assert_eq!(Vec::from_iter(names(&config)), ["both", "memory", "root"]);
        drop(locks);
        assert!(names(&config).is_empty());
    }
}
