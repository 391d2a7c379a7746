//! The clock of the system and the frequency of its processors.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::finding::Finding;

/// Clocks that a program reads without a system call.
const FAST_CLOCKS: [&str; 3] = ["tsc", "kvm-clock", "hyperv_clocksource_tsc_page"];

/// Slack of a timer that a process has by default, in nanoseconds.
const SLACK_NS_DEFAULT: u64 = 50_000;

/// Judges the clock that the file names: `current_clocksource` in `/sys`.
pub(super) fn clock_source(path: &Path) -> Finding {
    let check = "clock source";
    let Ok(text) = fs::read_to_string(path) else {
        return Finding::note(check, "the system does not tell its clock source");
    };
    let clock = text.trim();
    if FAST_CLOCKS.contains(&clock) {
        return Finding::ok(check, format!("{clock}, which is read without a system call"));
    }
    let text = format!(
        "{clock}, which takes a system call and often microseconds to read, so that step times look longer \
         than they are; some kernels drop tsc at start (`dmesg | grep -i tsc` tells why)"
    );
    Finding::note(check, text).with_cure(format!("echo tsc | sudo tee {}", path.display()))
}

/// Judges the frequency governors under `/sys/devices/system/cpu`.
pub(super) fn governors(cpus: &Path) -> Finding {
    let check = "frequency governor";
    let governor = |entry: fs::DirEntry| {
        let name = entry.file_name();
        let number = name.to_str()?.strip_prefix("cpu")?;
        number.parse::<u32>().ok()?;
        let text = fs::read_to_string(entry.path().join("cpufreq/scaling_governor")).ok()?;
        Some(text.trim().to_owned())
    };
    let entries = fs::read_dir(cpus).into_iter().flatten().flatten();
    let governors: BTreeSet<String> = entries.filter_map(governor).collect();
    if governors.is_empty() {
        return Finding::ok(
            check,
            "there is none, as in most virtual machines: the host decides on the frequency",
        );
    }
    let slow: Vec<_> = governors.iter().filter(|name| *name != "performance").cloned().collect();
    if slow.is_empty() {
        return Finding::ok(check, "performance");
    }
    let text = format!(
        "{}: a processor that idles between two steps may run the next one at a low frequency",
        slow.join(", ")
    );
    Finding::note(check, text).with_cure("sudo cpupower frequency-set -g performance")
}

/// Judges the slack of the timers of a process: `timerslack_ns` in its folder of `/proc`.
pub(super) fn timer_slack(path: &Path) -> Finding {
    let check = "timer slack";
    let slack = fs::read_to_string(path).ok().and_then(|text| text.trim().parse::<u64>().ok());
    match slack {
        None => Finding::note(check, "the system does not tell the slack of its timers"),
        Some(slack) if slack <= SLACK_NS_DEFAULT => Finding::ok(
            check,
            format!("the kernel may delay a timer by {} µs", slack as f64 / 1000.0),
        ),
        Some(slack) => Finding::note(
            check,
            format!(
                "the kernel may delay each step by {} µs, because the program that started this one asked \
                 for it",
                slack as f64 / 1000.0
            ),
        ),
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::finding::Level;
    use super::*;

    /// A folder in the temporary directory, removed with everything in it.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path =
                std::env::temp_dir().join(format!("catenary-clocks-{}-{name}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn write(&self, file: &str, text: &str) -> PathBuf {
            let path = self.0.join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, text).unwrap();
            path
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn slow_clocks_are_noted_with_the_command_that_selects_a_fast_one() {
        let scratch = Scratch::new("source");
        let path = scratch.write("current_clocksource", "tsc\n");
        assert_eq!(clock_source(&path).level, Level::Ok);
        scratch.write("current_clocksource", "hpet\n");
        let finding = clock_source(&path);
        assert_eq!(finding.level, Level::Note);
        assert!(finding.text.starts_with("hpet, "), "{}", finding.text);
        assert_eq!(finding.cure.unwrap(), format!("echo tsc | sudo tee {}", path.display()));
        assert_eq!(clock_source(Path::new("/nowhere")).level, Level::Note);
    }

    #[test]
    fn one_processor_with_another_governor_than_performance_is_noted() {
        let scratch = Scratch::new("governor");
        let none = governors(&scratch.0);
        assert!(none.level == Level::Ok && none.text.contains("virtual machines"), "{none:?}");
        scratch.write("cpu0/cpufreq/scaling_governor", "performance\n");
        scratch.write("cpufreq/policy0/scaling_governor", "powersave\n");
        assert_eq!(governors(&scratch.0), Finding::ok("frequency governor", "performance"));
        scratch.write("cpu11/cpufreq/scaling_governor", "powersave\n");
        let slow = governors(&scratch.0);
        assert!(slow.level == Level::Note && slow.text.starts_with("powersave: "), "{slow:?}");
    }

    #[test]
    fn more_than_the_default_slack_is_noted() {
        let scratch = Scratch::new("slack");
        let level = |text| timer_slack(&scratch.write("timerslack_ns", text)).level;
        assert_eq!(level("50000\n"), Level::Ok);
        assert_eq!(level("40000000\n"), Level::Note);
        assert_eq!(level("?"), Level::Note);
    }
}
