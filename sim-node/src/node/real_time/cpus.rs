//! The CPUs that this process may use.

use std::num::NonZero;
use std::thread::available_parallelism;

use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use super::refused::Refused;

/// The CPUs of this process, and the one of the loop.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cpus {
    /// `None` if the system does not tell.
    allowed: Option<CpuSet>,
    /// Number of cores available to this process, which may be less than its CPUs.
    pub(crate) core_count: usize,
    of_loop: Option<usize>,
}

impl Cpus {
    /// Reads the CPUs of the calling thread, which is not pinned yet.
    pub(crate) fn observe() -> Self {
        Self {
            allowed: sched_getaffinity(None).ok(),
            // One core, if the system does not tell their number.
            core_count: available_parallelism().map_or(1, NonZero::get),
            of_loop: None,
        }
    }

    /// Returns `true` if this process may use a CPU.
    pub(crate) fn is_allowed(&self, cpu: usize) -> bool {
        cpu < CpuSet::MAX_CPU && self.allowed.is_some_and(|allowed| allowed.is_set(cpu))
    }

    /// Returns the last CPU: the first ones handle most interrupts.
    pub(crate) fn last(&self) -> Option<usize> {
        (0..CpuSet::MAX_CPU).rev().find(|cpu| self.is_allowed(*cpu))
    }

    /// Returns the allowed CPUs as text, such as "0-3, 6".
    pub(crate) fn text(&self) -> String {
        let allowed: Vec<_> = (0..CpuSet::MAX_CPU).filter(|cpu| self.is_allowed(*cpu)).collect();
        let ranges = allowed.chunk_by(|before, cpu| before + 1 == *cpu);
        let range = |cpus: &[usize]| match cpus {
            [first, .., last] => format!("{first}-{last}"),
            _ => cpus[0].to_string(),
        };
        ranges.map(range).collect::<Vec<_>>().join(", ")
    }

    /// Makes the calling thread, which is that of the loop, run on one CPU.
    pub(super) fn pin(&mut self, cpu: usize) -> Result<(), Refused> {
        let mut set = CpuSet::new();
        set.set(cpu);
        sched_setaffinity(None, &set).map_err(|error| Refused {
            property: "CPU for the loop",
            reason: format!("CPU {cpu}: {error}"),
            cure: format!("choose one with `--cpu` (allowed: {})", self.text()),
        })?;
        self.of_loop = Some(cpu);
        Ok(())
    }

    /// Calls a function on the thread of the loop that starts threads. They inherit the CPUs of this
    /// thread, so meanwhile it may use those that the loop leaves, or its own one if there is no other.
    pub(crate) fn lend<T>(&self, start: impl FnOnce() -> T) -> T {
        let (Some(mut others), Some(cpu)) = (self.allowed, self.of_loop) else { return start() };
        others.unset(cpu);
        let has_lent = others.count() > 0 && sched_setaffinity(None, &others).is_ok();
        let started = start();
        if has_lent {
            let mut own = CpuSet::new();
            own.set(cpu);
            // The CPU was allowed before. If it has gone since, the loop continues on the others.
            let _kept = sched_setaffinity(None, &own);
        }
        started
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cpus(allowed: &[usize]) -> Cpus {
        let mut set = CpuSet::new();
        for cpu in allowed {
            set.set(*cpu);
        }
        Cpus { allowed: Some(set), core_count: allowed.len(), of_loop: None }
    }

    #[test]
    fn allowed_cpus_are_listed_as_ranges() {
        for (allowed, text) in [
            (&[0][..], "0"),
            (&[0, 1], "0-1"),
            (&[0, 1, 2, 5, 7, 8, 1023], "0-2, 5, 7-8, 1023"),
            (&[], ""),
        ] {
            assert_eq!(cpus(allowed).text(), text);
        }
    }

    #[test]
    fn the_last_allowed_cpu_is_found_and_none_beyond_the_set_is_allowed() {
        let some = cpus(&[0, 3, 6]);
        assert_eq!(some.last(), Some(6));
        assert!(some.is_allowed(3) && !some.is_allowed(4));
        assert!(!some.is_allowed(CpuSet::MAX_CPU) && !some.is_allowed(usize::MAX));
        assert_eq!(cpus(&[]).last(), None);
    }
}
