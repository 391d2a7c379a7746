//! The root directory of a domain. It holds the files of all services, so it must belong to this user
//! alone.

use std::fs::{self, DirBuilder, File, Metadata, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use iceoryx2::prelude::{Config, SemanticString};
use thiserror::Error;

/// Permissions of a root directory: everything for its owner, nothing for others.
const MODE: u32 = 0o700;
/// Permission of the group and of others to write.
const WRITABLE_BY_OTHERS: u32 = 0o022;

/// Reason why a root directory is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RootError {
    /// A link or a file has its name.
    #[error("{path} is not a directory: remove it, or choose another --domain")]
    NotADirectory {
        /// The root directory.
        path: PathBuf,
    },
    /// The root directory, or the counter of nodes of the domain, belongs to another user.
    #[error("{path} belongs to user {owner}, not to you (user {user}): choose another --domain")]
    OtherOwner {
        /// The root directory or the counter.
        path: PathBuf,
        /// Id of the user who owns it.
        owner: u32,
        /// Id of this user.
        user: u32,
    },
    /// Other users may have changed its files.
    #[error(
        "other users can write to {path} (mode {mode:03o}): stop all programs of this domain, and \
         remove the directory, or choose another --domain"
    )]
    Writable {
        /// The root directory.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// The system refused to create or open it.
    #[error("{path}: {cause}")]
    System {
        /// The root directory.
        path: PathBuf,
        /// Error of the system.
        cause: String,
    },
}

/// Returns the root directory of a configuration.
pub(crate) fn path(config: &Config) -> PathBuf {
    to_std(config.global.root_path())
}

/// Returns a path of iceoryx2 as one of the standard library.
pub(crate) fn to_std(path: &iceoryx2::prelude::Path) -> PathBuf {
    PathBuf::from(String::from_utf8_lossy(path.as_bytes()).into_owned())
}

/// Creates the root directory, or checks that the existing one belongs to this user alone. Returns it
/// open and locked: cleaners such as systemd-tmpfiles leave a locked directory alone.
pub(crate) fn prepare(path: &Path) -> Result<File, RootError> {
    let system =
        |error: io::Error| RootError::System { path: path.to_owned(), cause: error.to_string() };
    match DirBuilder::new().mode(MODE).create(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            DirBuilder::new().mode(MODE).recursive(true).create(path).map_err(system)?;
        }
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(system(error)),
        _ => {}
    }
    let metadata = fs::symlink_metadata(path).map_err(system)?;
    check(path, &metadata, rustix::process::geteuid().as_raw())?;
    if metadata.mode() & 0o777 != MODE {
        fs::set_permissions(path, Permissions::from_mode(MODE)).map_err(system)?;
    }
    let directory = File::open(path).map_err(system)?;
    // Without the lock, everything works until a cleaner comes.
    let _ = directory.try_lock_shared();
    Ok(directory)
}

/// Checks an existing root directory like [`prepare`], and changes nothing. Returns `false` if there is none.
pub(crate) fn exists(path: &Path) -> Result<bool, RootError> {
    match fs::symlink_metadata(path) {
        Ok(metadata) => {
            check(path, &metadata, rustix::process::geteuid().as_raw())?;
            Ok(true)
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(RootError::System { path: path.to_owned(), cause: error.to_string() }),
    }
}

fn check(path: &Path, metadata: &Metadata, user: u32) -> Result<(), RootError> {
    let path = path.to_owned();
    let (owner, mode) = (metadata.uid(), metadata.mode() & 0o7777);
    if !metadata.is_dir() {
        Err(RootError::NotADirectory { path })
    } else if owner != user {
        Err(RootError::OtherOwner { path, owner, user })
    } else if mode & WRITABLE_BY_OTHERS != 0 {
        Err(RootError::Writable { path, mode })
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    /// A path in the temporary directory, removed with everything under it.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path =
                std::env::temp_dir().join(format!("catenary-root-{}-{name}", std::process::id()));
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0).or_else(|_| fs::remove_file(&self.0));
        }
    }

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().mode() & 0o777
    }

    #[test]
    fn a_new_root_is_private_and_a_readable_one_becomes_private() {
        let scratch = Scratch::new("new");
        assert_eq!(exists(&scratch.0), Ok(false));
        let _first = prepare(&scratch.0).unwrap();
        assert_eq!(mode(&scratch.0), MODE);
        fs::set_permissions(&scratch.0, Permissions::from_mode(0o755)).unwrap();
        let _second = prepare(&scratch.0).unwrap();
        assert_eq!(mode(&scratch.0), MODE);
    }

    #[test]
    fn a_root_that_others_can_write_to_or_own_is_refused_with_the_cure() {
        let scratch = Scratch::new("writable");
        fs::create_dir(&scratch.0).unwrap();
        fs::set_permissions(&scratch.0, Permissions::from_mode(0o777)).unwrap();
        assert_eq!(exists(&scratch.0).unwrap_err(), prepare(&scratch.0).unwrap_err());
        let error = prepare(&scratch.0).unwrap_err().to_string();
        assert!(error.contains("(mode 777): stop all programs of this domain"), "{error}");

        fs::set_permissions(&scratch.0, Permissions::from_mode(MODE)).unwrap();
        let metadata = fs::metadata(&scratch.0).unwrap();
        let user = metadata.uid() + 1;
        let error = check(&scratch.0, &metadata, user).unwrap_err().to_string();
        let path = scratch.0.display();
        let owner = metadata.uid();
        assert_eq!(
            error,
            format!(
                "{path} belongs to user {owner}, not to you (user {user}): choose another --domain"
            )
        );
    }

    #[test]
    fn a_link_is_not_a_root_although_its_target_would_be() {
        let (target, link) = (Scratch::new("target"), Scratch::new("link"));
        let _target = prepare(&target.0).unwrap();
        symlink(&target.0, &link.0).unwrap();
        let error = prepare(&link.0).unwrap_err();
        assert_eq!(error, RootError::NotADirectory { path: link.0.clone() });
    }
}
