//! A program of the world, with the signals that it was sent.

use rustix::process::Signal;

use crate::faults::action::Ending;
use crate::faults::domain_files::DomainFiles;
use crate::faults::journal::Journal;
use crate::finished::Finished;
use crate::process::Process;
use crate::programs::Program;
use crate::sandbox::Sandbox;
use crate::wait::wait_for;

/// Exit code after a second SIGINT or SIGTERM.
const ABRUPT: i32 = 130;

/// The ends of a program that are no fault.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ends {
    /// Exit codes without an error.
    pub(super) codes: &'static [i32],
    /// Parts of the error, of which exit code 1 needs one.
    pub(super) errors: &'static [&'static str],
    /// True if the program may end without a signal.
    pub(super) needs_no_signal: bool,
}

/// A running program.
#[derive(Debug)]
pub(super) struct Actor {
    process: Process,
    ends: Ends,
    sent: Vec<Signal>,
    /// True if a signal came before the program was ready for it.
    is_signalled_early: bool,
    is_stopped: bool,
}

impl Actor {
    pub(super) fn start(program: Program, sandbox: &Sandbox, args: &[&str], ends: Ends) -> Self {
        let process = Process::start(program, sandbox, args);
        Self { process, ends, sent: Vec::new(), is_signalled_early: false, is_stopped: false }
    }

    /// Waits until the program is ready or has ended. Returns true if it is ready.
    pub(super) fn wait_until_ready(&mut self) -> bool {
        let title = self.process.title().to_owned();
        wait_for(&format!("the start of {title}"), || {
            (self.is_ready() || !self.process.is_running()).then_some(())
        });
        self.process.is_running()
    }

    pub(super) fn is_ready(&self) -> bool {
        self.process.has_written("ready")
    }

    pub(super) fn is_running(&mut self) -> bool {
        self.process.is_running()
    }

    pub(super) fn is_stopped(&self) -> bool {
        self.is_stopped
    }

    pub(super) fn has_written(&self, start: &str) -> bool {
        self.process.has_written(start)
    }

    pub(super) fn process_id(&self) -> u32 {
        self.process.id()
    }

    /// Waits for a line on stderr.
    pub(super) fn wait_for_line(&mut self, start: &str) -> String {
        self.process.wait_for_line(start)
    }

    /// Stops or continues the program.
    pub(super) fn set_stopped(&mut self, is_stopped: bool) {
        if self.is_running() {
            self.process.signal(if is_stopped { Signal::STOP } else { Signal::CONT });
            self.is_stopped = is_stopped;
        }
    }

    /// Limits the size of its files, like a disk that is nearly full.
    pub(super) fn limit_file_size(&mut self, size_bytes: u64) {
        if self.is_running() {
            self.process.limit_file_size(size_bytes);
        }
    }

    /// Sends the signals of an ending, and waits for the end.
    pub(super) fn end(
        mut self,
        ending: Ending,
        files: &DomainFiles,
        journal: &mut Journal,
    ) -> Finished {
        match ending {
            Ending::Kill => self.send(Signal::KILL),
            Ending::Interrupt => self.send(Signal::INT),
            Ending::Terminate => self.send(Signal::TERM),
            Ending::HangUp => self.send(Signal::HUP),
            Ending::InterruptTwice => {
                self.send(Signal::INT);
                self.send(Signal::INT);
            }
            Ending::InterruptThenKill(changes) => {
                self.send(Signal::INT);
                files.wait_for_changes(changes, || !self.process.is_running());
                self.send(Signal::KILL);
            }
        }
        self.wait(journal)
    }

    /// Kills the program after some changes of the files of its domain, unless it is ready or ends before.
    pub(super) fn kill_after(
        mut self,
        changes: u32,
        files: &DomainFiles,
        journal: &mut Journal,
    ) -> Finished {
        files.wait_for_changes(changes, || self.is_ready() || !self.process.is_running());
        self.end(Ending::Kill, files, journal)
    }

    /// Waits for the end, which must be one of those that are no fault.
    pub(super) fn wait(mut self, journal: &mut Journal) -> Finished {
        self.set_stopped(false);
        let title = self.process.title().to_owned();
        let Self { process, ends, sent, is_signalled_early, .. } = self;
        let finished = process.wait();
        journal.add_program(&title, &finished);
        let Finished { code, signal, stderr, .. } = &finished;
        let is_expected = match (code, signal) {
            (Some(code), _) => ends.allow_code(*code, stderr, &sent),
            (None, Some(signal)) => sent.iter().any(|sent| {
                let is_fatal = *sent == Signal::KILL || is_signalled_early;
                sent.as_raw() == *signal && is_fatal
            }),
            (None, None) => false,
        };
        assert!(
            is_expected && !stderr.contains("panicked at"),
            "{title} ended with code {code:?}, signal {signal:?} after the signals {sent:?}: {stderr}"
        );
        finished
    }

    fn send(&mut self, signal: Signal) {
        if self.process.is_running() {
            self.is_signalled_early |= !self.is_ready();
            self.process.signal(signal);
            self.sent.push(signal);
            self.set_stopped(false);
        }
    }
}

impl Ends {
    fn allow_code(self, code: i32, stderr: &str, sent: &[Signal]) -> bool {
        let is_error = code == 1 && self.errors.iter().any(|error| stderr.contains(error));
        let is_end = self.codes.contains(&code) && (self.needs_no_signal || !sent.is_empty());
        is_error || is_end || (code == ABRUPT && sent.len() > 1)
    }
}
