//! Memory, and limits on this process.

use super::finding::Finding;

/// Open files of a node with all the readers and clients that its services admit.
const OPEN_FILES_FULL: u64 = 512;
/// Open files of a node with a viewer and a recorder.
const OPEN_FILES_FEW: u64 = 128;

/// Highest priority that the limit has to allow, far below the priorities of the kernel's own threads.
const PRIORITY: u64 = 1;

/// A limit of the system; `None` is no limit.
pub(super) type Limit = Option<u64>;

/// A capability of Linux, by its bit.
#[derive(Debug, Clone, Copy)]
pub(super) enum Capability {
    /// `CAP_IPC_LOCK`: locks memory beyond the limit.
    LockMemory = 14,
    /// `CAP_SYS_NICE`: takes real-time priorities beyond the limit.
    Prioritize = 23,
}

/// Returns `true` if a process has a capability. `status` is its status in `/proc`.
pub(super) fn has_capability(status: &str, capability: Capability) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> capability as u32 & 1 == 1)
}

/// Compares the memory of a scene with the free memory in `/dev/shm`.
pub(super) fn shared_memory(scene: &str, needed: u64, free: Option<u64>) -> Finding {
    let check = "shared memory";
    let Some(free) = free else {
        return Finding::problem(check, "/dev/shm cannot be read, so no node can start")
            .with_cure("sudo mount -t tmpfs -o mode=1777 tmpfs /dev/shm");
    };
    let (needed_mib, free_mib) = (needed.div_ceil(1 << 20), free >> 20);
    if needed > free {
        let text = format!(
            "a node of scene '{scene}' needs {needed_mib} MiB in /dev/shm, which has only {free_mib} MiB \
             left (in a container, start it with a larger --shm-size)"
        );
        let size = (needed_mib - free_mib).next_multiple_of(64);
        let cure = format!(
            "sudo mount -o remount,size=$(($(df -m --output=size /dev/shm | tail -1) + {size}))M /dev/shm"
        );
        return Finding::problem(check, text).with_cure(cure);
    }
    let text = format!(
        "a node of scene '{scene}' needs {needed_mib} MiB in /dev/shm, which has {free_mib} MiB left"
    );
    Finding::ok(check, text)
}

/// Judges `RLIMIT_NOFILE`.
pub(super) fn open_files(limit: Limit) -> Finding {
    let check = "open files";
    let cure = format!("ulimit -n {OPEN_FILES_FULL}");
    match limit {
        Some(limit) if limit < OPEN_FILES_FEW => Finding::problem(
            check,
            format!("a process may open {limit} files, too few for a node with a viewer and a recorder"),
        )
        .with_cure(cure),
        Some(limit) if limit < OPEN_FILES_FULL => Finding::note(
            check,
            format!(
                "a process may open {limit} files, but a node with all the readers and clients that it \
                 admits needs up to {OPEN_FILES_FULL}"
            ),
        )
        .with_cure(cure),
        limit => Finding::ok(check, format!("a process may open {} files", text(limit))),
    }
}

/// Judges `RLIMIT_RTPRIO`.
pub(super) fn real_time(limit: Limit, has_capability: bool, user: &str) -> Finding {
    let check = "real-time priority";
    match limit {
        _ if has_capability => {
            Finding::ok(check, "this process may take any real-time priority (CAP_SYS_NICE)")
        }
        Some(limit) if limit < PRIORITY => Finding::note(
            check,
            "this user may take no real-time priority (RLIMIT_RTPRIO is 0), so any busy program can delay \
             a step; the cure takes effect at the next login",
        )
        .with_cure(limits_file(user, "rtprio", "90")),
        limit => {
            let limit = text(limit);
            Finding::ok(check, format!("this user may take real-time priorities up to {limit}"))
        }
    }
}

/// Judges `RLIMIT_MEMLOCK` for a node with this much memory.
pub(super) fn locked_memory(
    limit: Limit,
    has_capability: bool,
    needed: u64,
    user: &str,
) -> Finding {
    let check = "locked memory";
    match limit {
        _ if has_capability => {
            Finding::ok(check, "this process may lock all of its memory (CAP_IPC_LOCK)")
        }
        Some(limit) if limit < needed => Finding::note(
            check,
            format!(
                "this user may lock {} MiB of memory (RLIMIT_MEMLOCK), less than the {} MiB of shared \
                 memory of the scene, so a program that locks its memory would fail; the cure takes effect \
                 at the next login",
                limit >> 20,
                needed.div_ceil(1 << 20)
            ),
        )
        .with_cure(limits_file(user, "memlock", "unlimited")),
        limit => {
            let limit = limit.map_or("all of its".to_owned(), |limit| format!("{} MiB of", limit >> 20));
            Finding::ok(check, format!("a process of this user may lock {limit} memory"))
        }
    }
}

/// Returns the command that raises a limit of a user.
fn limits_file(user: &str, item: &str, value: &str) -> String {
    format!("echo '{user} - {item} {value}' | sudo tee -a /etc/security/limits.d/catenary.conf")
}

fn text(limit: Limit) -> String {
    limit.map_or("any number of".to_owned(), |limit| limit.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::finding::Level;
    use super::*;

    #[test]
    fn capabilities_are_bits_of_the_effective_set() {
        let status = |mask| format!("Name:\tx\nCapPrm:\tffffffffffffffff\nCapEff:\t{mask}\n");
        let of = |mask| {
            let status = status(mask);
            [Capability::LockMemory, Capability::Prioritize]
                .map(|capability| has_capability(&status, capability))
        };
        assert_eq!(of("0000000000004000"), [true, false]);
        assert_eq!(of("0000000000800000"), [false, true]);
        assert_eq!(of("000001ffffffffff"), [true, true]);
        assert!(!has_capability("", Capability::Prioritize));
    }

    #[test]
    fn memory_that_is_missing_is_a_problem_with_both_numbers() {
        let docker_default = Some(64 << 20);
        let finding = shared_memory("big", 397 << 20, docker_default);
        assert_eq!(finding.level, Level::Problem);
        assert!(finding.text.contains("needs 397 MiB in /dev/shm, which has only 64 MiB left"));
        assert!(finding.cure.unwrap().contains("+ 384))M"));
        assert_eq!(shared_memory("small", 64 << 20, docker_default).level, Level::Ok);
        assert_eq!(shared_memory("small", 1, None).level, Level::Problem);
    }

    #[test]
    fn limits_below_the_need_are_found_unless_a_capability_lifts_them() {
        let levels = [Some(64), Some(256), Some(1024), None].map(|limit| open_files(limit).level);
        assert_eq!(levels, [Level::Problem, Level::Note, Level::Ok, Level::Ok]);
        for (limit, has_capability, level) in [
            (Some(0), false, Level::Note),
            (Some(0), true, Level::Ok),
            (Some(50), false, Level::Ok),
            (None, false, Level::Ok),
        ] {
            assert_eq!(real_time(limit, has_capability, "ada").level, level);
        }
        for (limit, has_capability, level) in [
            (Some(8 << 20), false, Level::Note),
            (Some(8 << 20), true, Level::Ok),
            (Some(9 << 20), false, Level::Ok),
            (None, false, Level::Ok),
        ] {
            assert_eq!(locked_memory(limit, has_capability, 9 << 20, "ada").level, level);
        }
        assert_eq!(
            real_time(Some(0), false, "ada").cure.unwrap(),
            "echo 'ada - rtprio 90' | sudo tee -a /etc/security/limits.d/catenary.conf"
        );
    }
}
