//! Options of real time.

use clap::Args as ClapArgs;

use crate::node::{Cpus, RealTimeOptions};

/// Priority of `--realtime` without a number: above ordinary threads, and below the threads of the system
/// for interrupts, which have 50.
const PRIORITY_DEFAULT: &str = "20";

#[derive(Debug, Clone, Default, ClapArgs)]
pub(crate) struct RealTimeArgs {
    /// Run with SCHED_FIFO at this priority, 1 to 99, on one CPU, with locked memory. Each of them that
    /// the system refuses is a warning, or with `require` an error: `--realtime=require`,
    /// `--realtime=50,require` [default priority: 20]
    #[arg(long, value_name = "PRIORITY", require_equals = true, num_args = 0..=1,
        default_missing_value = PRIORITY_DEFAULT, value_parser = request)]
    realtime: Option<RealTimeRequest>,
    /// CPU that the loop runs on [default: with --realtime, the last one that this process may use]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = cpu)]
    cpu: Option<usize>,
}

/// Value of `--realtime`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct RealTimeRequest {
    priority: u8,
    is_required: bool,
}

impl RealTimeArgs {
    /// Explains why a run that never waits cannot have these options.
    pub(super) fn conflict(&self) -> Option<&'static str> {
        self.realtime.map(|_| {
            "--realtime cannot be used with --as-fast-as-possible: a loop that never waits would keep \
             every ordinary program off its CPU"
        })
    }

    pub(crate) fn options(&self) -> RealTimeOptions {
        RealTimeOptions {
            priority: self.realtime.map(|request| request.priority),
            is_required: self.realtime.is_some_and(|request| request.is_required),
            cpu: self.cpu,
        }
    }
}

/// Parses `PRIORITY`, `require` or `PRIORITY,require`.
fn request(text: &str) -> Result<RealTimeRequest, String> {
    let (priority, is_required) = match text.strip_suffix("require") {
        Some("") => (Some(PRIORITY_DEFAULT), true),
        Some(before) => (before.strip_suffix(','), true),
        None => (Some(text), false),
    };
    let priority = priority.and_then(|text| text.parse().ok());
    let priority = priority.filter(|priority| (1..=99).contains(priority));
    let problem = || "it must be a priority from 1 to 99, 'require', or both as in '50,require'";
    Ok(RealTimeRequest { priority: priority.ok_or_else(problem)?, is_required })
}

/// Parses the number of a CPU that this process may use.
fn cpu(text: &str) -> Result<usize, String> {
    let cpus = Cpus::observe();
    let cpu = text.parse().ok().filter(|cpu| cpus.is_allowed(*cpu));
    cpu.ok_or_else(|| format!("this process may not use it (allowed: {})", cpus.text()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_priority_and_require_are_combined_with_a_comma() {
        let parsed = |priority, is_required| Ok(RealTimeRequest { priority, is_required });
        assert_eq!(request("1"), parsed(1, false));
        assert_eq!(request("99,require"), parsed(99, true));
        assert_eq!(request("require"), parsed(20, true));
        assert_eq!(request(PRIORITY_DEFAULT), parsed(20, false));
        for text in ["", "0", "100", "-3", "require,50", "50require", ",require", "fifo", "50,"] {
            assert!(request(text).unwrap_err().contains("1 to 99, 'require'"), "{text}");
        }
    }
}
