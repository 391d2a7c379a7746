//! The journal of a run, printed if it fails.

use std::collections::VecDeque;

use crate::finished::Finished;

/// Number of actions that a failure shows.
const ACTIONS_SHOWN: usize = 30;
/// Number of ended programs whose output a failure shows. Running ones show theirs when they are killed.
const PROGRAMS_SHOWN: usize = 8;

/// The last actions, and the last programs that ended. Printed on a panic.
#[derive(Debug)]
pub(super) struct Journal {
    seed: u64,
    action_count: usize,
    actions: VecDeque<String>,
    programs: VecDeque<String>,
}

impl Journal {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, action_count: 0, actions: VecDeque::new(), programs: VecDeque::new() }
    }

    /// Adds an action before it begins.
    pub(super) fn begin_action(&mut self, description: &str) {
        self.action_count += 1;
        let line = format!("{}: {description}", self.action_count);
        add(&mut self.actions, ACTIONS_SHOWN, line);
    }

    /// Adds a program that has ended.
    pub(super) fn add_program(&mut self, title: &str, finished: &Finished) {
        let Finished { code, signal, stdout, stderr } = finished;
        let text = format!(
            "--- during action {}: {title}\n--- code {code:?}, signal {signal:?}\n{stdout}{stderr}",
            self.action_count
        );
        add(&mut self.programs, PROGRAMS_SHOWN, text);
    }
}

fn add(lines: &mut VecDeque<String>, count_max: usize, line: String) {
    if lines.len() == count_max {
        lines.pop_front();
    }
    lines.push_back(line);
}

impl Drop for Journal {
    #[allow(clippy::print_stderr, reason = "the report of a failure")]
    fn drop(&mut self) {
        if !std::thread::panicking() {
            return;
        }
        let Self { seed, action_count, actions, programs } = self;
        eprintln!("the last programs that ended:");
        for program in programs {
            eprintln!("{program}");
        }
        eprintln!("the last actions:");
        for action in actions {
            eprintln!("{action}");
        }
        eprintln!(
            "failed at action {action_count} or after it; `cargo faults --seed {seed} --actions {action_count}` \
             repeats it"
        );
    }
}
