//! Files that a process has mapped, whichever name and process id its container gives to both.

use std::collections::HashSet;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{major, minor};

/// A file of this host.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct FileId {
    device: (u32, u32),
    inode: u64,
}

/// Removes the files from a list that a process of this user has mapped, as far as this process sees others.
pub(crate) fn remove_mapped(paths: &mut Vec<PathBuf>) {
    if !paths.is_empty() {
        let mapped = mapped_files();
        paths.retain(|path| file_id(path).is_some_and(|file| !mapped.contains(&file)));
    }
}

fn file_id(path: &Path) -> Option<FileId> {
    let file = fs::metadata(path).ok()?;
    Some(FileId { device: (major(file.dev()), minor(file.dev())), inode: file.ino() })
}

fn mapped_files() -> HashSet<FileId> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    // The maps of other users' processes cannot be read, and these cannot map files of this user.
    let maps = processes.filter_map(|process| fs::read_to_string(process.path().join("maps")).ok());
    maps.flat_map(|maps| maps.lines().filter_map(parse).collect::<Vec<_>>()).collect()
}

/// Parses a line of `/proc/<process>/maps`: addresses, permissions, offset, device, inode and path.
fn parse(line: &str) -> Option<FileId> {
    let mut fields = line.split_ascii_whitespace().skip(3);
    let (major, minor) = fields.next()?.split_once(':')?;
    let number = |text| u32::from_str_radix(text, 16).ok();
    let inode = fields.next()?.parse().ok()?;
    Some(FileId { device: (number(major)?, number(minor)?), inode })
}

/// Returns `true` if this process sees all processes of the host, because it is in no container. `link` is
/// its namespace of processes: the target of `/proc/self/ns/pid`.
pub(crate) fn sees_all_processes(link: &Path) -> bool {
    // The number of the first namespace is fixed in the kernel (PROC_PID_INIT_INO).
    link == Path::new("pid:[4026531836]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_maps_names_its_file_by_device_and_inode() {
        let line = "7f1c4a000000-7f1c4a021000 rw-s 00000000 00:1a 513  /dev/shm/lab_x y.data";
        assert_eq!(parse(line), Some(FileId { device: (0, 0x1a), inode: 513 }));
        assert_eq!(
            parse("7ffd1000-7ffd2000 r-xp 00000000 00:00 0  [vdso]").map(|it| it.inode),
            Some(0)
        );
        assert_eq!(parse(""), None);
    }

    #[test]
    fn only_files_that_are_mapped_are_removed() {
        let program = fs::read_link("/proc/self/exe").unwrap();
        let mut paths = vec![program, PathBuf::from("/dev/null"), PathBuf::from("/nowhere")];
        remove_mapped(&mut paths);
        assert_eq!(paths, [Path::new("/dev/null")]);
    }

    #[test]
    fn a_process_in_a_container_does_not_see_all() {
        assert!(sees_all_processes(Path::new("pid:[4026531836]")));
        assert!(!sees_all_processes(Path::new("pid:[4026532451]")));
    }
}
