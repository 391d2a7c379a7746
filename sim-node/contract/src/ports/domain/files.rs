//! The files of a domain in shared memory, and the one that every process opens when it joins: the counter of nodes.

use std::fmt::Display;
use std::fs::{self, DirEntry, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use iceoryx2::prelude::{Config, FileName};

use crate::ports::domain::root::RootError;

/// The directory of shared memory.
pub(crate) const SHARED_MEMORY: &str = "/dev/shm";
/// Number of characters that name the type of a segment.
const TYPE_HASH_LENGTH: usize = 40;

/// Returns the files of a kind in shared memory: `<prefix><hash of the type>_<id><suffix>`.
pub(crate) fn segments<S: Display>(
    config: &Config,
    suffix: &S,
) -> impl Iterator<Item = PathBuf> + use<S> {
    let prefix = config.global.prefix.to_string();
    let suffix = suffix.to_string();
    let is_segment = move |entry: &DirEntry| {
        let name = entry.file_name();
        let hash = name.to_str().and_then(|name| {
            name.strip_prefix(&prefix)?.strip_suffix(&suffix)?.split_once('_').map(|(hash, _)| hash)
        });
        // Another domain may have a prefix that begins with this one.
        hash.is_some_and(|hash| hash.len() == TYPE_HASH_LENGTH)
    };
    entries(Path::new(SHARED_MEMORY)).filter(is_segment).map(|entry| entry.path())
}

/// Returns the file of a kind in shared memory that belongs to a port or a service.
pub(crate) fn segment(config: &Config, suffix: &FileName, id: u128) -> Option<PathBuf> {
    let ending = format!("_{id}{suffix}");
    segments(config, suffix)
        .find(|path| path.as_os_str().as_encoded_bytes().ends_with(ending.as_bytes()))
}

/// Returns the entries of a directory; none if it cannot be read.
pub(crate) fn entries(directory: &Path) -> impl Iterator<Item = DirEntry> {
    fs::read_dir(directory).into_iter().flatten().flatten()
}

/// Checks that the counter of a named domain is this user's own, or does not exist yet.
///
/// The counter of iceoryx2's own domain stays open to all users: their other programs may share it under
/// a root of their own.
pub(crate) fn check_counter(config: &Config) -> Result<(), RootError> {
    let user = rustix::process::geteuid().as_raw();
    for path in segments(config, &config.global.node.global_mgmt_suffix) {
        match fs::metadata(&path).map(|metadata| metadata.uid()) {
            Ok(owner) if owner != user => return Err(RootError::OtherOwner { path, owner, user }),
            _ => {}
        }
    }
    Ok(())
}

/// Takes the permission to write the counter from other users. iceoryx2 gives it to everybody, and
/// another user who truncates the segment ends every process that opens it.
pub(crate) fn narrow_counter(config: &Config) {
    for path in segments(config, &config.global.node.global_mgmt_suffix) {
        // Without the permission to change it, it is not this user's segment.
        let _ = fs::set_permissions(&path, Permissions::from_mode(0o600));
    }
}
