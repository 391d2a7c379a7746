//! Properties of this machine that explain a measurement.

use std::fs;

use serde::Serialize;

use crate::node::Cpus;

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
