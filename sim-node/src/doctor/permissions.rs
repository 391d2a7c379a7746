//! Owners and permissions of the folders of a domain.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use rustix::fs::{Access, access, statfs};
use sim_contract::{Domain, RootError};

use super::finding::Finding;

/// Permissions of a folder in which every user creates files and removes only their own.
const SHARED_MODE: u32 = 0o1777;
/// Type of a file system in memory, as `statfs` returns it.
const TMPFS: u64 = 0x0102_1994;

/// Judges the result of the check that each program makes when it joins the domain.
pub(super) fn root(path: &Path, checked: Result<bool, RootError>) -> Finding {
    let check = "root";
    let path = path.display();
    match checked {
        Ok(true) => Finding::ok(check, format!("{path} belongs to you alone")),
        Ok(false) => {
            Finding::ok(check, format!("{path} does not exist yet; the first program creates it"))
        }
        Err(error) => {
            let finding = Finding::problem(check, error.to_string());
            match error {
                RootError::NotADirectory { path } => {
                    finding.with_cure(format!("rm {}", path.display()))
                }
                RootError::Writable { path, .. } => {
                    finding.with_cure(format!("rm -r {}", path.display()))
                }
                _ => finding.with_cure("export CATENARY_DOMAIN=NAME"),
            }
        }
    }
}

/// Judges the length of the paths of sockets: `excess` bytes are too many.
pub(super) fn path_length(excess: usize) -> Finding {
    let check = "path length";
    match excess {
        0 => Finding::ok(check, "the paths of this domain are short enough for sockets"),
        excess => Finding::problem(
            check,
            format!(
                "root and prefix of this domain together have {excess} bytes more than the {} that leave \
                 room for the name of a socket, so programs cannot wait for a node: shorten them in the \
                 configuration file of iceoryx2, or choose a --domain",
                Domain::PATH_LENGTH_MAX
            ),
        )
        .with_cure("export CATENARY_DOMAIN=NAME"),
    }
}

/// Judges the folder of shared memory.
pub(super) fn shared_memory(path: &Path) -> Finding {
    let check = "permissions";
    let name = path.display();
    let metadata = match fs::metadata(path) {
        Ok(metadata) if metadata.is_dir() => metadata,
        Ok(_) => return Finding::problem(check, format!("{name} is not a folder")),
        Err(error) => return Finding::problem(check, format!("{name}: {error}")),
    };
    let (mode, owner) = (metadata.mode() & 0o7777, metadata.uid());
    let cure = format!("sudo chmod 1777 {name}");
    if access(path, Access::READ_OK | Access::WRITE_OK | Access::EXEC_OK).is_err() {
        let text = format!(
            "you may not create files in {name} (owner {owner}, mode {mode:04o}), so no node can start"
        );
        return Finding::problem(check, text).with_cure(cure);
    }
    if mode & 0o022 != 0 && mode & SHARED_MODE != SHARED_MODE {
        let text = format!(
            "{name} (owner {owner}, mode {mode:04o}) lets other users remove your files, because it lacks \
             the sticky bit"
        );
        return Finding::problem(check, text).with_cure(cure);
    }
    #[allow(clippy::cast_sign_loss, reason = "the type is a positive number of 32 bits")]
    let is_in_memory = statfs(path).is_ok_and(|system| system.f_type as u64 == TMPFS);
    if !is_in_memory {
        let text = format!("{name} is not a tmpfs, so shared memory may be written to a disk");
        return Finding::note(check, text)
            .with_cure(format!("sudo mount -t tmpfs -o mode=1777 tmpfs {name}"));
    }
    Finding::ok(check, format!("{name} (owner {owner}, mode {mode:04o}) is a tmpfs for all users"))
}

#[cfg(test)]
mod tests {
    use std::fs::Permissions;
    use std::os::unix::fs::PermissionsExt;

    use super::super::finding::Level;
    use super::*;

    #[test]
    fn a_refused_root_is_a_problem_with_the_command_that_helps() {
        let path = Path::new("/tmp/catenary-7-lab");
        assert_eq!(root(path, Ok(true)).level, Level::Ok);
        assert!(root(path, Ok(false)).text.contains("does not exist yet"));
        let path = path.to_owned();
        for (error, cure) in [
            (RootError::NotADirectory { path: path.clone() }, "rm /tmp/catenary-7-lab"),
            (RootError::Writable { path: path.clone(), mode: 0o777 }, "rm -r /tmp/catenary-7-lab"),
            (
                RootError::OtherOwner { path: path.clone(), owner: 8, user: 7 },
                "export CATENARY_DOMAIN=NAME",
            ),
        ] {
            let finding = root(&path, Err(error.clone()));
            assert_eq!(finding.level, Level::Problem);
            assert_eq!((finding.text, finding.cure.unwrap()), (error.to_string(), cure.to_owned()));
        }
        assert_eq!(
            [path_length(0), path_length(3)].map(|it| it.level),
            [Level::Ok, Level::Problem]
        );
    }

    #[test]
    fn a_shared_folder_needs_the_sticky_bit() {
        let path =
            std::env::temp_dir().join(format!("catenary-permissions-{}", std::process::id()));
        fs::create_dir(&path).unwrap();
        let judge = |mode| {
            fs::set_permissions(&path, Permissions::from_mode(mode)).unwrap();
            shared_memory(&path)
        };
        let open = judge(0o777);
        assert_eq!(open.level, Level::Problem);
        assert!(
            open.text.contains("mode 0777) lets other users remove your files"),
            "{}",
            open.text
        );
        assert_eq!(open.cure.unwrap(), format!("sudo chmod 1777 {}", path.display()));
        assert_ne!(judge(0o1777).level, Level::Problem);
        assert_ne!(judge(0o700).level, Level::Problem);
        fs::remove_dir(&path).unwrap();
        let missing = shared_memory(&path);
        assert!(missing.level == Level::Problem && missing.text.contains("No such file"));
        assert!(shared_memory(Path::new("/dev/null")).text.ends_with("is not a folder"));
    }
}
