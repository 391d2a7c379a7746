//! The names in a domain that have a lock, held or left by a killed owner.

use std::collections::BTreeSet;
use std::fs::{self, DirEntry};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use iceoryx2::prelude::Config;

use crate::endpoint::Endpoint;
use crate::ports::domain::files::{SHARED_MEMORY, entries};
use crate::ports::domain::owner_lock::LOCK_SUFFIX;
use crate::ports::domain::root;

/// Returns the names that have a lock file of this user, in order. [`super::owner_lock::OwnerLock::holder`]
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
    use std::fs::File;
    use std::os::unix::fs::symlink;

    use super::*;
    use crate::ports::domain;
    use crate::ports::domain::owner_lock::OwnerLock;
    use crate::testing::TestDomain;

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
