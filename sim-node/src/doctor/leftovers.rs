//! Files of killed processes.

use std::collections::BTreeSet;

use sim_contract::{Leftover, LeftoverKind};

use super::finding::Finding;

const CHECK: &str = "leftovers";

/// Describes the leftovers of a domain. `removed_count` have been removed before. `fix` is the command that
/// removes them.
pub(super) fn check(leftovers: &[Leftover], removed_count: usize, fix: &str) -> Vec<Finding> {
    let (uncertain, certain): (Vec<_>, Vec<_>) =
        leftovers.iter().partition(|one| one.kind == LeftoverKind::UncertainSegment);
    let mut findings = Vec::new();
    if !certain.is_empty() {
        findings.push(Finding::problem(CHECK, describe(&certain)).with_cure(fix));
    }
    if !uncertain.is_empty() {
        findings.push(Finding::note(CHECK, describe_uncertain(&uncertain)));
    }
    if findings.is_empty() {
        let text = match removed_count {
            0 => "killed processes have left no files in this domain".to_owned(),
            1 => "one file of killed processes was removed".to_owned(),
            count => format!("{count} files and folders of killed processes were removed"),
        };
        findings.push(Finding::ok(CHECK, text));
    }
    findings
}

fn describe(leftovers: &[&Leftover]) -> String {
    let count = |is_kind: fn(LeftoverKind) -> bool| {
        leftovers.iter().filter(|one| is_kind(one.kind)).count()
    };
    let processes: BTreeSet<u32> = leftovers.iter().filter_map(|one| process_id(one)).collect();
    let mut parts = Vec::new();
    if !processes.is_empty() {
        let ids: Vec<_> = processes.iter().map(ToString::to_string).collect();
        parts.push(format!("the files of {} ({})", plural(ids.len(), "process"), ids.join(", ")));
    }
    for (name, number) in [
        ("lock", count(|kind| kind == LeftoverKind::Lock)),
        ("unfinished file", count(|kind| kind == LeftoverKind::Unfinished)),
        ("service", count(|kind| kind == LeftoverKind::Service)),
        ("segment", count(|kind| kind == LeftoverKind::Segment)),
    ] {
        if number > 0 {
            parts.push(plural(number, name));
        }
    }
    let first = leftovers[0].path.display();
    format!("killed processes have left {}{}, such as {first}", parts.join(", "), size(leftovers))
}

fn describe_uncertain(leftovers: &[&Leftover]) -> String {
    format!(
        "{}{} may belong to programs that live, but are not in the root of the domain, because they run in a \
         container or a cleaner has removed their files, so nothing removes them now",
        plural(leftovers.len(), "segment"),
        size(leftovers)
    )
}

fn process_id(leftover: &Leftover) -> Option<u32> {
    match leftover.kind {
        LeftoverKind::Process { process_id } => Some(process_id),
        _ => None,
    }
}

/// Size of the segments of unknown processes; the segments of known processes are not listed.
fn size(leftovers: &[&Leftover]) -> String {
    match leftovers.iter().map(|one| one.size_bytes).sum::<u64>() {
        bytes if bytes < 1 << 20 => String::new(),
        bytes => format!(" ({} MiB)", bytes >> 20),
    }
}

fn plural(count: usize, noun: &str) -> String {
    let ending = match (count, noun.ends_with('s')) {
        (1, _) => "",
        (_, true) => "es",
        (_, false) => "s",
    };
    format!("{count} {noun}{ending}")
}

#[cfg(test)]
mod tests {
    use super::super::finding::Level;
    use super::*;

    fn leftover(kind: LeftoverKind, size_bytes: u64) -> Leftover {
        Leftover { path: "/dev/shm/lab_x".into(), kind, size_bytes }
    }

    #[test]
    fn leftovers_are_counted_by_kind_and_uncertain_ones_are_only_noted() {
        let process = |process_id| leftover(LeftoverKind::Process { process_id }, 0);
        let found = [
            leftover(LeftoverKind::Lock, 5),
            process(7),
            process(9),
            leftover(LeftoverKind::Segment, 3 << 20),
            leftover(LeftoverKind::UncertainSegment, 100),
        ];
        let [problem, note] = check(&found, 0, "fix").try_into().unwrap();
        assert_eq!(
            problem.text,
            "killed processes have left the files of 2 processes (7, 9), 1 lock, 1 segment (3 MiB), such \
             as /dev/shm/lab_x"
        );
        assert_eq!((problem.level, problem.cure.as_deref()), (Level::Problem, Some("fix")));
        assert_eq!(note.level, Level::Note);
        assert!(
            note.text.starts_with("1 segment may belong to programs that live"),
            "{}",
            note.text
        );
        assert_eq!(
            check(&[], 3, "fix")[0].text,
            "3 files and folders of killed processes were removed"
        );
        assert_eq!(check(&[], 0, "fix")[0].level, Level::Ok);
    }
}
