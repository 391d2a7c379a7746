//! The report, as `--json` prints it.

use std::fs;

use serde::Serialize;

use super::measurement::Mode;
use super::times::Percentiles;
use crate::node::{Cpus, RealTime};

#[derive(Debug, Serialize)]
pub(super) struct Report {
    pub(super) scene: String,
    pub(super) particle_count: usize,
    pub(super) rate_hz: u32,
    /// Threads of the solver.
    pub(super) thread_count: usize,
    pub(super) duration_s: f64,
    pub(super) build: Build,
    pub(super) machine: Machine,
    pub(super) real_time: RealTime,
    /// Wake-up lateness of a loop that only sleeps.
    pub(super) bare_loop: Percentiles,
    pub(super) loops: Vec<LoopRow>,
    pub(super) latencies: Vec<LatencyRow>,
    pub(super) commands: Vec<CommandRow>,
    pub(super) lockstep: LockstepRow,
}

/// Profile of this program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Build {
    Debug,
    Release,
}

/// Loop of a node with readers that wait for its event.
#[derive(Debug, Serialize)]
pub(super) struct LoopRow {
    pub(super) reader_count: usize,
    pub(super) wake_late: Percentiles,
    /// Percentiles of the lateness, divided by the percentiles of the bare loop.
    pub(super) wake_late_ratio_p50: Option<f64>,
    pub(super) wake_late_ratio_p99: Option<f64>,
    pub(super) late_step_count: u64,
    pub(super) phases: PhaseRow,
}

/// Percentiles of the phases of a step.
#[derive(Debug, Clone, Copy, Serialize)]
pub(super) struct PhaseRow {
    pub(super) drain: Percentiles,
    pub(super) solve: Percentiles,
    pub(super) publish: Percentiles,
    pub(super) wake: Percentiles,
    pub(super) keep: Percentiles,
    pub(super) observe: Percentiles,
    pub(super) outside_solver: Percentiles,
}

/// Time from the publication of a snapshot to its reception.
#[derive(Debug, Serialize)]
pub(super) struct LatencyRow {
    pub(super) reader_count: usize,
    pub(super) wait: Wait,
    pub(super) latency: Percentiles,
    pub(super) missed_count: u64,
}

/// Way of a reader to wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Wait {
    Event,
    Poll,
}

/// Time from a command to its outcome.
#[derive(Debug, Serialize)]
pub(super) struct CommandRow {
    pub(super) node: Mode,
    pub(super) round_trip: Percentiles,
}

/// Steps of a node with one member, as fast as possible.
#[derive(Debug, Serialize)]
pub(super) struct LockstepRow {
    pub(super) steps_per_s: f64,
    pub(super) round_trip: Percentiles,
}

/// Properties of the machine; `None` where the system does not tell.
#[derive(Debug, Serialize)]
pub(super) struct Machine {
    pub(super) cpu_model: Option<String>,
    /// Cores available to this process.
    pub(super) core_count: usize,
    pub(super) kernel: Option<String>,
    pub(super) clock_source: Option<String>,
    /// Frequency governor of the first CPU.
    pub(super) governor: Option<String>,
    /// Average number of running processes over 1, 5 and 15 minutes, before the measurement.
    pub(super) load_average: Option<[f64; 3]>,
}

impl Machine {
    pub(super) fn observe() -> Self {
        let cpuinfo = read("/proc/cpuinfo").unwrap_or_default();
        let clocks = "/sys/devices/system/clocksource/clocksource0";
        Self {
            cpu_model: model(&cpuinfo),
            core_count: Cpus::observe().core_count,
            kernel: read("/proc/sys/kernel/osrelease"),
            clock_source: read(&format!("{clocks}/current_clocksource")),
            governor: read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor"),
            load_average: read("/proc/loadavg").and_then(|text| load_average(&text)),
        }
    }
}

fn read(path: &str) -> Option<String> {
    fs::read_to_string(path).ok().map(|text| text.trim_end().to_owned())
}

fn model(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo.lines().find(|line| line.starts_with("model name"))?;
    line.split_once(": ").map(|(_, model)| model.to_owned())
}

fn load_average(text: &str) -> Option<[f64; 3]> {
    let averages: Vec<_> = text.split(' ').take(3).map_while(|one| one.parse().ok()).collect();
    averages.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_the_system_are_parsed() {
        let cpuinfo = "processor\t: 0\nmodel name\t: Some CPU: 9\nflags\t: fpu\n";
        assert_eq!(model(cpuinfo), Some("Some CPU: 9".to_owned()));
        assert_eq!(model("processor\t: 0\n"), None);
        assert_eq!(load_average("0.20 1.18 12.34 3/400 123"), Some([0.2, 1.18, 12.34]));
        assert_eq!(load_average("?"), None);
    }
}
